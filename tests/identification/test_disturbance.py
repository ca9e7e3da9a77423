"""Noise of the EMG is estimated from how the motion wanders, and is none where the motion does not."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.signal import butter, filtfilt, savgol_filter

from myowave.data.simulate import simulate_trials
from myowave.identification.disturbance import estimate_disturbance, excitation_forcing
from myowave.identification.output_error import Fit, fit_model, refit
from myowave.identification.record import make_record
from myowave.identification.whitening import MotionBand
from myowave.physics.motion import simulate
from myowave.settings import SimulatedDataset

NOISE_DEG = 0.5


@pytest.fixture(scope="module")
def driven(base):
    """Trials in which EMG never falls below 0.1, so that noise of either sign moves the muscles."""
    dataset = SimulatedDataset(kind="simulated", trials=4, samples=200, test=("4",), seed=3, emg_noise=0.0)
    trials = simulate_trials("driven", dataset, base, {})[0]
    return replace(trials, emg=0.1 + 0.8 * trials.emg)


@pytest.fixture(scope="module")
def fit(driven, base, free):
    """The base model fitted to trials whose recorded EMG has noise that did not drive the arm, (size, seed)."""

    def make(emg_noise: float, seed: int = 0, cutoff_hz: float | None = None) -> Fit:
        random = np.random.default_rng(seed)
        simulation = make_record(driven, base).simulation(base, {})
        q = simulate(simulation, torch.full((4,), np.pi / 6, dtype=torch.float64)).angle.numpy()
        angle = q + np.radians(NOISE_DEG) * random.standard_normal(q.shape)
        if cutoff_hz is not None:
            angle = filtfilt(*butter(2, cutoff_hz, fs=1 / driven.dt), angle, axis=-1)
        recorded = driven.emg + emg_noise * random.standard_normal(driven.emg.shape)
        record = make_record(replace(driven, angle=angle, emg=recorded), base)
        return fit_model(base, record.train, free)

    return make


@pytest.mark.parametrize("seed", range(3))
def test_noise_of_the_emg_is_found_with_its_size(fit, seed):
    found = estimate_disturbance(fit(0.02, seed))
    assert found.emg == pytest.approx(0.02, rel=0.35)
    assert np.degrees(found.angle) == pytest.approx(NOISE_DEG, rel=0.15)
    assert found.gain > 100


@pytest.mark.parametrize("seed", range(3))
def test_none_is_found_where_the_emg_is_what_drove_the_arm(fit, seed):
    found = estimate_disturbance(fit(0.0, seed))
    assert found.emg < 0.003 and found.gain < 0
    assert np.degrees(found.angle) == pytest.approx(NOISE_DEG, rel=0.1)


def within(fit: Fit, edge_hz: float = 1.5) -> Fit:
    """The same fit by what is slow."""
    record = replace(fit.record, filter=MotionBand.of(fit.record.valid, edge_hz * fit.record.dt))
    return refit(replace(fit, record=record), fit.model, fit.free)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("cutoff_hz", [4.0, 8.0])
def test_noise_of_the_emg_is_found_behind_a_filter(fit, seed, cutoff_hz):
    found = estimate_disturbance(within(fit(0.02, seed, cutoff_hz)))
    assert found.emg == pytest.approx(0.02, rel=0.35)
    assert np.degrees(found.angle) == pytest.approx(NOISE_DEG, rel=0.35)
    assert found.gain > 5 and isinstance(found.whitener, MotionBand)


@pytest.mark.parametrize("window", [5, 9])
def test_nor_need_the_filter_be_the_one_that_is_assumed(fit, window):
    made = fit(0.02, 3)
    smooth = savgol_filter(made.record.angle, window, 2, axis=-1)
    found = estimate_disturbance(within(replace(made, record=replace(made.record, angle=smooth))))
    assert found.emg == pytest.approx(0.02, rel=0.35)
    assert np.degrees(found.angle) == pytest.approx(NOISE_DEG, rel=0.35)


@pytest.mark.parametrize("seed", range(3))
def test_none_is_found_behind_a_filter_where_the_emg_is_what_drove_the_arm(fit, seed):
    found = estimate_disturbance(within(fit(0.0, seed, 4.0)))
    assert found.gain < 0
    assert np.degrees(found.angle) == pytest.approx(NOISE_DEG, rel=0.2)


def minus_twice_log_likelihood(fit: Fit, emg: float, angle: float) -> float:
    """Of the residual as one Gaussian with all its covariances, but for a constant: no filter walks along it."""
    jacobian, forcing, total = fit.linear.jacobian.numpy(), excitation_forcing(fit), 0.0
    first = np.diag(np.radians([5.0, 50.0]))  # an angle and a velocity that a trial may start with instead
    for t, residual in enumerate(fit.residual):
        causes, by_cause = first, [first[0]]
        for step, push in zip(jacobian[t], emg * forcing[t], strict=True):
            causes = np.hstack([step @ causes, push])
            by_cause.append(causes[0])
        answers = np.zeros((len(residual), len(by_cause[-1])))
        for n, row in enumerate(by_cause):
            answers[n, : len(row)] = row
        covariance = answers @ answers.T + angle**2 * np.eye(len(residual))
        total += np.linalg.slogdet(covariance)[1] + residual @ np.linalg.solve(covariance, residual)
    return total


@pytest.mark.parametrize("emg_noise", [0.0, 0.02])
def test_the_gain_of_a_force_is_that_of_likelihood_less_what_bic_charges_for_it(fit, emg_noise):
    made = fit(emg_noise)
    found, samples = estimate_disturbance(made), made.record.samples
    left = sum(
        np.linalg.lstsq(by_start, residual, rcond=None)[1].item()
        for by_start, residual in zip(made.normal.by_start, made.residual, strict=True)
    )
    without = samples * (np.log(left / samples) + 1)
    gain = without - minus_twice_log_likelihood(made, found.emg, found.angle)
    assert found.gain == pytest.approx(gain - np.log(samples), abs=0.05)


def test_a_force_that_is_not_there_costs_what_bic_charges_for_it_behind_a_filter_too(fit):
    """The logarithm of the samples, of which noise alone gives back a few units."""
    found = estimate_disturbance(within(fit(0.0, 1, 4.0)))
    assert found.gain == pytest.approx(-np.log(600), abs=3.0)


def test_a_fit_beside_a_force_that_is_not_there_needs_none(fit):
    """It leaves its trials to start where the noise of their first samples is, and that is no wandering."""
    plain, other = fit(0.0), fit(0.05, seed=1)
    force = estimate_disturbance(other)
    record = replace(plain.record, filter=force.whitener, noise=force.angle)
    beside = refit(replace(plain, record=record), plain.model, plain.free)
    moved = replace(plain, sensitive=beside.sensitive, starts=beside.starts)
    assert moved.rss > 1.2 * plain.rss, "its raw residual is no longer the smallest"
    assert estimate_disturbance(moved).gain < 0


def test_innovations_beside_the_force_are_white_where_the_residual_is_slow(fit):
    made = fit(0.03)
    found = estimate_disturbance(made)
    new = found.whitener.innovations(made.residual[..., None])[..., 0]

    def correlation(values):
        return float((values[:, 1:] * values[:, :-1]).sum() / (values**2).sum())

    assert correlation(made.residual) > 0.5 and abs(correlation(new)) < 0.15
    assert np.sqrt((new**2).mean()) == pytest.approx(found.angle, rel=0.1)


def test_the_forcing_is_what_more_excitation_adds_to_the_state(fit):
    """One more in all excitations at once, by the trial's own simulation with EMG that is 1e-4 higher."""
    made = fit(0.0)
    forcing = excitation_forcing(made)
    assert forcing.shape == (*made.linear.after.shape, 2)
    flexor, extensor = np.moveaxis(forcing[..., 1, :], -1, 0)
    assert (flexor > 0).mean() > 0.95 and (extensor < 0).mean() > 0.95
    simulation, step = made.simulation, 1e-4
    more = replace(simulation, emg=simulation.emg + step)
    start = torch.from_numpy(made.starts)
    angles = [simulate(s, start[:, 0], start[:, 1]).q.numpy() for s in (simulation, more)]
    state = np.zeros((len(made.record.names), 2))
    moved = [state[:, 0]]
    for n in range(forcing.shape[1]):
        state = (made.linear.jacobian.numpy()[:, n] @ state[..., None])[..., 0] + forcing[:, n].sum(-1)
        moved.append(state[:, 0])
    np.testing.assert_allclose(np.stack(moved, -1), (angles[1] - angles[0]) / step, rtol=0.03, atol=0.03)
