"""Identification beside training: the truth from wrong starts, seed by seed, with effects or without."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from myowave.data.simulate import simulate_trials
from myowave.identification.free_parameters import free_parameters, start_values
from myowave.identification.output_error import fit_model
from myowave.identification.record import make_record
from myowave.learning.identification import Identification
from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.settings import Identify, SimulatedDataset


@pytest.fixture(scope="module")
def four() -> dict[str, Identify]:
    spreads = {"f0_Bi": 0.2, "l0_Bi": 0.1, "f0_Tri": 0.2, "l0_Tri": 0.1}
    return {name: Identify(start_spread=spread) for name, spread in spreads.items()}


def begin(model, trials, wanted, *, finest=True, seeds=(0, 1)):
    free = free_parameters(model, wanted, trials.known(model.defaults))
    return free, Identification(model, trials, free, torch.from_numpy(start_values(free, seeds)), finest=finest)


def search(*args, **options):
    free, identification = begin(*args, **options)
    while not identification.done:
        identification.step()
    return free, identification


def relative_error(values, free, model):
    truth = torch.tensor([model.defaults[p.name] for p in free], dtype=torch.float64)
    return (values / truth - 1).abs()


def test_trajectories_find_the_truth_nearly_exactly(model, trials, four):
    free, identification = begin(model, trials, four)
    assert relative_error(identification.values, free, model).max() > 0.05
    while not identification.done:
        identification.step()
    assert relative_error(identification.values, free, model).max() < 1e-5
    assert (identification.mse.sqrt() < np.radians(1e-3)).all()


def test_coarser_scales_stop_after_the_weak_form(model, trials, four):
    free, coarse = search(model, trials, four, finest=False)
    _, fine = search(model, trials, four)
    assert relative_error(coarse.values, free, model).max() < 5e-4
    assert (fine.mse < coarse.mse).all()


def test_a_seed_is_identified_the_same_alone_and_among_others(model, trials, four):
    _, together = search(model, trials, four, seeds=(3, 5))
    _, alone = search(model, trials, four, seeds=(5,))
    torch.testing.assert_close(together.values[1], alone.values[0], rtol=1e-9, atol=0)


def test_noise_on_the_angle_stays_within_the_standard_errors(model, trials, four):
    noise = np.random.default_rng(0).normal(0, np.radians(0.5), trials.angle.shape)
    free, identification = search(model, replace(trials, angle=trials.angle + noise), four, seeds=(0,))
    errors, correlations, _ = identification.judge()
    truth = torch.tensor([model.defaults[p.name] for p in free], dtype=torch.float64)
    assert ((identification.values - truth).abs() < 4 * errors).all()
    assert (errors / truth < 0.05).all()
    torch.testing.assert_close(torch.diagonal(correlations[0]), torch.ones(4, dtype=torch.float64))


def test_standard_errors_are_those_of_least_squares_in_noise_of_any_colour(model, trials, four):
    """Estimates H J^T r, H = (J^T J)^-1, scatter by H J^T C J H, with the covariance C of the noise at hand and the
    slopes J that no start of a trial can imitate."""
    free, samples, size = free_parameters(model, four, ()), trials.angle.shape[1], np.radians(0.3)
    normal = fit_model(model, make_record(trials, model), free).normal
    slopes = normal.without_starts(normal.slope)
    inverse = np.linalg.inv(np.einsum("tnp,tnq->pq", slopes, slopes))
    for colour in (0.0, 0.9):
        white = np.random.default_rng(4).standard_normal((len(trials.names), 100 + samples))
        noise = size * lfilter([np.sqrt(1 - colour**2)], [1.0, -colour], white)[:, 100:]
        covariance = size**2 * toeplitz(colour ** np.arange(samples))
        scatter = inverse @ np.einsum("tnp,nm,tmq->pq", slopes, covariance, slopes) @ inverse
        expected = np.array([p.scale for p in free]) * np.sqrt(np.diag(scatter))
        _, identification = search(model, replace(trials, angle=trials.angle + noise), four, seeds=(0,))
        errors, *_ = identification.judge()
        assert 0.7 < np.exp(np.log(errors[0].numpy() / expected).mean()) < 1.4, colour


@pytest.mark.parametrize(
    ("effect", "short", "value"),
    [("joint_damping", "c", 3.0), ("fatigue", "k", 0.4), ("angle_scale", "s", 0.1)],
)
def test_an_effect_of_the_model_is_identified_too(settings, model, four, effect, short, value):
    """Also one with a state of its own and one on the sensor, which no residual along the angle holds."""
    dataset = SimulatedDataset(
        kind="simulated", trials=3, samples=200, test=("3",), hidden_effect={effect: {short: value}}
    )
    trials, _ = simulate_trials("hidden", dataset, model, catalogue(()))
    richer = build_model(f"base+{effect}", settings.physics.of_arm("paper"))
    free, identification = search(richer, trials, four)
    found = identification.values[:, [p.name for p in free].index(f"{effect}.{short}")]
    torch.testing.assert_close(found, torch.full_like(found, value), rtol=1e-3, atol=0)


def test_bounds_hold_where_the_truth_lies_beyond(model, trials):
    _, identification = search(model, trials, {"f0_Bi": Identify(start_spread=0.0, low=310.0, high=340.0)})
    torch.testing.assert_close(identification.values, torch.full((2, 1), 310.0, dtype=torch.float64))


def test_known_constants_take_part_and_are_not_identified(model, trials, four):
    """With twice the mass, muscles must be twice as strong for the same motion."""
    known = replace(trials, constants={"mass": 2.0, "l0_Bi": 0.6})
    free, identification = search(model, known, four, seeds=(0,))
    found = dict(zip([p.name for p in free], identification.values[0].tolist(), strict=True))
    assert set(found) == {"f0_Bi", "f0_Tri", "l0_Tri"}
    assert found["f0_Bi"] == pytest.approx(600, rel=1e-3) and found["f0_Tri"] == pytest.approx(600, rel=1e-3)


def test_a_condition_of_one_trial_is_known_there_and_nowhere_else(model, four):
    dataset = SimulatedDataset(
        kind="simulated", trials=3, samples=200, emg_noise=0.1, test=("3",), conditions={"2": {"load": 0.5}}
    )
    loaded, _ = simulate_trials("loaded", dataset, model, catalogue(()))
    free, identification = search(model, loaded, four, finest=False)
    assert relative_error(identification.values, free, model).max() < 1e-3
    elsewhere = replace(loaded, conditions={"1": {"load": 0.5}})
    free, identification = search(model, elsewhere, four, finest=False)
    assert relative_error(identification.values, free, model).max() > 1e-2


def test_a_motion_that_diverges_is_worth_nothing_and_ends_no_training(model, trials, four):
    free, identification = begin(model, trials, four)
    identification._values[1] = np.nan
    errors, correlations, _ = identification.judge()
    assert identification.mse.isfinite().tolist() == [True, False]
    assert errors[0].isfinite().all() and errors[1].isnan().all() and correlations[1].isnan().all()


def test_trials_of_different_length_identify_as_well(model, trials, four):
    lengths = (200, 150, 200)
    pieces = [slice(0, n) for n in lengths]
    uneven = type(trials).from_sequences(
        dataset="uneven",
        dt=trials.dt,
        names=trials.names,
        channels=trials.channels,
        test=trials.test,
        emg=[trials.emg[i, p] for i, p in enumerate(pieces)],
        angle=[trials.angle[i, p] for i, p in enumerate(pieces)],
    )
    free, identification = search(model, uneven, four)
    assert relative_error(identification.values, free, model).max() < 1e-4
    assert identification.mse.isfinite().all()
