"""Motion that obeys the sampled equation: the residual at the samples is 0 along it."""

import numpy as np
import pytest
import torch

from myowave.data.simulate import simulate_trials
from myowave.data.trials import Trials
from myowave.learning.methods.paper.residual import Pieces, Residual
from myowave.settings import SimulatedDataset
from studies.paper.sampled import sampled


@pytest.fixture(scope="module")
def exact(model) -> Trials:
    dataset = SimulatedDataset(kind="simulated", trials=3, samples=300, emg_noise=0.2, test=("3",))
    return simulate_trials("small", dataset, model, {})[0]


@pytest.fixture(scope="module")
def stepped(model, exact) -> Trials:
    return sampled(model, exact)


def left(model, trials: Trials, *, averaged: bool) -> float:
    """The largest residual along the measured angle, with the true parameters."""
    count, samples = trials.angle.shape
    pieces = Pieces(torch.arange(count), torch.zeros(count, dtype=torch.long), samples)
    q = pieces.of(torch.from_numpy(trials.angle))[None]
    bend = (q[..., 2:] - 2 * q[..., 1:-1] + q[..., :-2]) / trials.dt**2
    names = ("f0_Bi", "l0_Bi", "f0_Tri", "l0_Tri")
    params = {name: torch.tensor([[model.defaults[name]]], dtype=torch.float64) for name in names}
    residual = Residual(model, trials, names, torch.device("cpu"), averaged=averaged)
    return float(residual.along_sequence(params, pieces, q, bend).abs().max())


def test_a_sampled_motion_leaves_nothing_of_the_equation_at_the_samples(model, stepped, exact):
    assert left(model, stepped, averaged=False) < 1e-6 and left(model, stepped, averaged=True) > 0.1
    assert left(model, exact, averaged=True) < 0.5 * left(model, exact, averaged=False)


def test_a_sampled_motion_is_near_the_exact_one(stepped, exact):
    np.testing.assert_array_equal(stepped.emg, exact.emg)
    gap = np.abs(stepped.angle - exact.angle).max()
    assert 1e-5 < gap < 0.02 and stepped.dataset == "small_sampled"
