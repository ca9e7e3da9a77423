"""The fast rollout and its hand-written backward pass are the definition in plain torch and its gradient."""

from dataclasses import replace

import pytest
import torch

from myowave.learning.methods.rollout.fast import Rollouts, Workspace, roll_out_gru
from myowave.learning.network import Architecture, Network, Scaling, initialise
from myowave.learning.prediction import run_free

SCALING = Scaling((0.0, 0.0), (1.0, 1.0), 0.0, angle_std=1.0, step_std=0.2, bend_std=0.06, duration=1.0)
SEEDS, WINDOWS, HISTORY, STEPS, HIDDEN = 2, 3, 3, 6, 5


@pytest.fixture
def problem():
    random = torch.Generator().manual_seed(0)

    def normal(*shape):
        return torch.randn(*shape, generator=random, dtype=torch.float64)

    architecture = Architecture("rollout", HIDDEN, 2, HISTORY)
    weights = initialise(architecture, range(SEEDS))
    weights = {name: w.double() + 0.1 * normal(*w.shape) for name, w in weights.items()}  # biases are not 0 either
    network = Network(architecture, SCALING, weights).trainable()
    x, z, v = normal(WINDOWS, HISTORY + STEPS, 2), normal(SEEDS, WINDOWS, HISTORY), normal(SEEDS, WINDOWS, HISTORY)
    return network, (x, z, v)


def weigh(predicted):
    """A loss in which every prediction counts, each for something else."""
    return (predicted.square() * torch.linspace(0.5, 2.0, predicted.numel()).reshape(predicted.shape)).sum()


def gradients_of(predicted, network):
    gradients = torch.autograd.grad(weigh(predicted), tuple(network.weights.values()))
    return dict(zip(network.weights, gradients, strict=True))


@pytest.mark.parametrize("inputs_by_seed", [False, True])
def test_the_fast_rollout_and_its_gradients_equal_those_of_plain_torch(problem, inputs_by_seed):
    network, (x, z, v) = problem
    if inputs_by_seed:
        x = torch.stack([x, x.flip(0)])
    plain = run_free(network, x, z, v)
    fast = roll_out_gru(network, x, z, v, Workspace())
    torch.testing.assert_close(fast, plain, rtol=1e-12, atol=1e-12)
    expected, found = gradients_of(plain, network), gradients_of(fast, network)
    for name in network.weights:
        torch.testing.assert_close(found[name], expected[name], rtol=1e-10, atol=1e-12, msg=name)


def test_gradients_by_hand_equal_finite_differences(problem):
    network, data = problem
    gradients = gradients_of(roll_out_gru(network, *data, Workspace()), network)
    for name, value in network.weights.items():
        place = tuple(size - 1 for size in value.shape)
        losses = []
        for nudge in (1e-5, -1e-5):
            moved = value.detach().clone()
            moved[place] += nudge
            nudged = replace(network, weights={**network.weights, name: moved})
            losses.append(weigh(run_free(nudged, *data)).item())
        difference = (losses[0] - losses[1]) / 2e-5
        assert gradients[name][place].item() == pytest.approx(difference, rel=1e-6, abs=1e-8), name


def test_memory_used_again_for_other_windows_changes_nothing(problem):
    network, (x, z, v) = problem
    workspace = Workspace()
    first = gradients_of(roll_out_gru(network, x, z, v, workspace), network)
    gradients_of(roll_out_gru(network, x[:2], z[:, :2], v[:, :2], workspace), network)
    gradients_of(roll_out_gru(network, x.flip(0), z.flip(1), v.flip(1), workspace), network)
    again = gradients_of(roll_out_gru(network, x, z, v, workspace), network)
    for name in first:
        assert torch.equal(first[name], again[name]), name


def test_rollouts_of_shapes_that_alternate_do_not_disturb_each_other(problem):
    network, (x, z, v) = problem
    rollouts, fewer = Rollouts(network), (x[:2], z[:, :2], v[:, :2])
    both = rollouts(x, z, v), rollouts(*fewer)
    for predicted, given in zip(both, ((x, z, v), fewer), strict=True):
        found, expected = gradients_of(predicted, network), gradients_of(run_free(network, *given), network)
        for name in network.weights:
            torch.testing.assert_close(found[name], expected[name], rtol=1e-10, atol=1e-12, msg=name)


def test_a_backward_pass_that_comes_too_late_is_refused(problem):
    network, data = problem
    workspace = Workspace()
    first = roll_out_gru(network, *data, workspace)
    roll_out_gru(network, *data, workspace)
    with pytest.raises(AssertionError, match="before the backward pass"):
        weigh(first).backward()


def test_a_network_without_output_extrapolates_linearly(problem):
    network, (x, z, v) = problem
    silent = {name: torch.zeros_like(network.weights[name]) for name in ("output", "output_bias")}
    predicted = run_free(replace(network, weights={**network.weights, **silent}), x, z, v)
    expected = z[..., -1:] + SCALING.step * v[..., -1:] * torch.arange(1, STEPS + 1)
    torch.testing.assert_close(predicted, expected)
