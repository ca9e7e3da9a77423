"""Identification: the truth is found from wrong starts, bounds hold, and one effect more is one parameter more."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from myowave.data.simulate import simulate_trials
from myowave.learning.identification import Identification
from myowave.learning.parameters import identify
from myowave.learning.shooting import Shooting
from myowave.learning.weak import WeakResidual, gauss_newton
from myowave.physics.build import build_model
from myowave.physics.effects import catalogue
from myowave.settings import Identify, SimulatedDataset


@pytest.fixture(scope="module")
def four() -> dict[str, Identify]:
    spreads = {"f0_Bi": 0.2, "l0_Bi": 0.1, "f0_Tri": 0.2, "l0_Tri": 0.1}
    return {name: Identify(start_spread=spread) for name, spread in spreads.items()}


def search(model, trials, wanted, *, finest=True, seeds=(0, 1)):
    identified, raw = identify(model, wanted, trials.constants, seeds)
    start = identified.values(raw)
    identification = Identification(model, trials, identified, raw, finest=finest)
    while not identification.done:
        identification.step()
    return identified, start, identified.values(identification.raw), identification


def relative_error(values, names, model):
    truth = torch.tensor([model.defaults[name] for name in names], dtype=torch.float64)
    return (values / truth - 1).abs()


def test_the_weak_residual_finds_the_truth_to_a_twentieth_of_a_percent(model, trials, four):
    identified, raw = identify(model, four, {}, (0, 1))
    sequence = WeakResidual.of(model, trials).along(torch.from_numpy(trials.angle)[None])
    damping = torch.full((2,), 1e-3, dtype=torch.float64)
    for _ in range(8):
        raw, damping = gauss_newton(sequence, identified, raw, damping)
    assert relative_error(identified.values(raw), identified.names, model).max() < 5e-4


def test_trajectories_find_the_truth_nearly_exactly(model, trials, four):
    identified, start, values, _ = search(model, trials, four)
    assert relative_error(start, identified.names, model).max() > 0.05
    assert relative_error(values, identified.names, model).max() < 1e-4


def test_noise_on_the_angle_stays_within_the_standard_errors(model, trials, four):
    noise = np.random.default_rng(0).normal(0, np.radians(0.5), trials.angle.shape)
    noisy = replace(trials, angle=trials.angle + noise)
    identified, _, values, identification = search(model, noisy, four, seeds=(0,))
    errors, correlations = identification.uncertainty()
    truth = torch.tensor([model.defaults[name] for name in identified.names], dtype=torch.float64)
    assert ((values - truth).abs() < 5 * errors).all()
    assert (errors / truth < 0.05).all()
    torch.testing.assert_close(torch.diagonal(correlations[0]), torch.ones(4, dtype=torch.float64))


def test_standard_errors_are_those_of_least_squares_in_noise_of_any_colour(model, trials, four):
    """Estimates H J^T r, H = (J^T J)^-1, scatter by H J^T C J H, with the covariance C of the noise at hand."""
    names, samples, size = trials.names, trials.angle.shape[1], np.radians(0.3)
    identified, raw = identify(model, {name: Identify(start_spread=0.0) for name in four}, {}, (0,))
    slopes = Shooting.of(model, trials, identified, raw).linearise()[1][0].numpy()
    inverse = np.linalg.inv(np.einsum("tnp,tnq->pq", slopes, slopes))
    for colour in (0.0, 0.9):
        white = np.random.default_rng(4).standard_normal((len(names), 100 + samples))
        noise = size * lfilter([np.sqrt(1 - colour**2)], [1.0, -colour], white)[:, 100:]
        noise[:, :2] = 0.0  # they tell the starts
        covariance = size**2 * toeplitz(colour ** np.arange(samples))
        scatter = inverse @ np.einsum("tnp,nm,tmq->pq", slopes, covariance, slopes) @ inverse
        expected = identified.values(raw)[0].numpy() * np.sqrt(np.diag(scatter))
        noisy = replace(trials, angle=trials.angle + noise)
        errors, _ = Identification(model, noisy, identified, raw, finest=True).uncertainty()
        assert 0.7 < np.exp(np.log(errors[0].numpy() / expected).mean()) < 1.4, colour


def test_an_effect_of_the_model_is_identified_too(settings, model, four):
    dataset = SimulatedDataset(
        kind="simulated", trials=3, samples=200, test=("3",), hidden_effect={"joint_damping": {"c": 0.4}}
    )
    damped, _ = simulate_trials("damped", dataset, model, catalogue(()))
    richer = build_model("base+joint_damping", settings.physics)
    identified, _, values, _ = search(richer, damped, four)
    c = values[:, identified.names.index("joint_damping.c")]
    torch.testing.assert_close(c, torch.full_like(c, 0.4), rtol=1e-3, atol=0)


def test_bounds_hold_where_the_truth_lies_beyond(model, trials):
    wanted = {"f0_Bi": Identify(start_spread=0.0, low=310.0, high=340.0)}
    _, _, values, _ = search(model, trials, wanted)
    assert ((values > 310.0) & (values < 340.0)).all()


def test_literature_values_confine_as_printed(model):
    """Eq. 41: anything between 0 and the mean of the literature values, and nothing else."""
    identified, raw = identify(model, {"f0_Bi": Identify(literature=(400.0, 800.0))}, {}, (0,))
    assert raw.shape == (1, 2)
    start = identified.values(raw).item()
    assert abs(start / 300 - 1) <= 0.2
    low, high = (identified.values(torch.full_like(raw, sign * 50.0)).item() for sign in (-1, 1))
    assert low == pytest.approx(0.0, abs=1e-6) and high == pytest.approx(600.0)
    one_only = identified.values(torch.tensor([[50.0, -50.0]], dtype=torch.float64)).item()
    assert one_only == pytest.approx(200.0)


def test_starts_depend_on_the_seed_and_stay_in_the_spread(model, four):
    identified, raw = identify(model, four, {}, range(20))
    error = relative_error(identified.values(raw), identified.names, model)
    spread = torch.tensor([four[name].start_spread for name in identified.names])
    assert (error <= spread + 1e-12).all() and (error.amax(0) > 0.5 * spread).all()
    fewer, again = identify(model, {"l0_Tri": four["l0_Tri"]}, {}, [7])
    assert fewer.values(again).item() == identified.values(raw)[7, identified.names.index("l0_Tri")].item()


def test_known_constants_replace_nominal_ones(model, trials, four):
    heavy = replace(trials, constants={"f0_Bi": 500.0})
    identified, raw = identify(model, {"f0_Bi": Identify(start_spread=0.0)}, heavy.constants, (0,))
    assert identified.values(raw).item() == 500.0


def test_a_condition_of_one_trial_is_known_there_and_nowhere_else(model, four):
    dataset = SimulatedDataset(
        kind="simulated", trials=3, samples=200, emg_noise=0.1, test=("3",), conditions={"2": {"load": 0.5}}
    )
    loaded, _ = simulate_trials("loaded", dataset, model, catalogue(()))
    identified, _, values, _ = search(model, loaded, four, finest=False)
    assert relative_error(values, identified.names, model).max() < 1e-3
    elsewhere = replace(loaded, conditions={"1": {"load": 0.5}})
    identified, _, values, _ = search(model, elsewhere, four, finest=False)
    assert relative_error(values, identified.names, model).max() > 1e-2


def test_trajectories_begin_where_the_measured_ones_do_and_as_fast(model, trials, four):
    begin, names = 60, trials.names
    moving = type(trials).from_sequences(
        dataset="moving", dt=trials.dt, names=names, channels=trials.channels, emg=trials.emg[:, begin:],
        angle=trials.angle[:, begin:],
    )  # fmt: skip
    identified, raw = identify(model, four, {}, (0, 1))
    angle, speed = Shooting.of(model, moving, identified, raw).start.unbind(-1)
    expected = np.gradient(trials.angle, trials.dt, axis=1)[:, begin]
    assert np.abs(expected).max() > 0.3
    for seed in (0, 1):
        np.testing.assert_array_equal(angle[seed], trials.angle[:, begin])
        np.testing.assert_allclose(speed[seed], expected, rtol=0, atol=0.2)


def test_an_unknown_parameter_is_refused(model):
    with pytest.raises(ValueError, match="no parameter f9_Bi"):
        identify(model, {"f9_Bi": Identify()}, {}, (0,))


def test_trials_of_different_length_identify_as_well(model, trials, four):
    lengths = (200, 150, 200)
    pieces = [slice(0, n) for n in lengths]
    uneven = type(trials).from_sequences(
        dataset="uneven", dt=trials.dt, names=trials.names, channels=trials.channels, test=trials.test,
        emg=[trials.emg[i, p] for i, p in enumerate(pieces)], angle=[trials.angle[i, p] for i, p in enumerate(pieces)],
    )  # fmt: skip
    identified, _, values, identification = search(model, uneven, four)
    assert relative_error(values, identified.names, model).max() < 1e-3
    assert math.isfinite(identification.mse.max())
