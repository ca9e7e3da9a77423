"""The hand-written backward pass is the gradient of the definition in plain torch."""

import pytest
import torch

from myowave.learning.network import Architecture, initialise
from myowave.learning.rollout import Units, Workspace, roll_out, rollout_gradients

UNITS = Units(bend=0.3, step=0.2)
SEEDS, WINDOWS, HISTORY, STEPS, HIDDEN = 2, 3, 3, 6, 5


@pytest.fixture
def problem():
    random = torch.Generator().manual_seed(0)

    def normal(*shape):
        return torch.randn(*shape, generator=random, dtype=torch.float64)

    architecture = Architecture("gru", HIDDEN, 2, increments=True, time_input=False)
    weights = initialise(architecture, range(SEEDS), torch.device("cpu"))
    weights = {name: w.double() + 0.1 * normal(*w.shape) for name, w in weights.items()}  # biases are not 0 either
    x, z, v = normal(WINDOWS, HISTORY + STEPS, 2), normal(SEEDS, WINDOWS, HISTORY), normal(SEEDS, WINDOWS, HISTORY)
    target, weight = normal(SEEDS, WINDOWS, STEPS), normal(SEEDS, WINDOWS, 1).abs()
    return architecture, weights, x, z, v, target, weight


def loss_of(architecture, weights, x, z, v, target, weight):
    return (weight * (roll_out(architecture, UNITS, weights, x, z, v) - target).square()).sum((1, 2))


def test_gradients_by_hand_equal_those_of_autograd(problem):
    architecture, weights, *data = problem
    weights = {name: value.requires_grad_() for name, value in weights.items()}
    expected = loss_of(architecture, weights, *data)
    expected.sum().backward()
    with torch.no_grad():
        loss, gradients = rollout_gradients(UNITS, weights, *data, Workspace())
    torch.testing.assert_close(loss, expected.detach(), rtol=1e-10, atol=0)
    for name, value in weights.items():
        torch.testing.assert_close(gradients[name], value.grad, rtol=1e-6, atol=1e-9, msg=name)


def test_gradients_by_hand_equal_finite_differences(problem):
    architecture, weights, *data = problem
    _, gradients = rollout_gradients(UNITS, weights, *data, Workspace())
    for name, value in weights.items():
        place = tuple(size - 1 for size in value.shape)
        losses = []
        for nudge in (1e-5, -1e-5):
            moved = value.clone()
            moved[place] += nudge
            losses.append(loss_of(architecture, {**weights, name: moved}, *data).sum())
        difference = (losses[0] - losses[1]) / 2e-5
        torch.testing.assert_close(gradients[name][place], difference, rtol=1e-5, atol=1e-8, msg=name)


def test_memory_used_again_for_other_windows_changes_nothing(problem):
    _, weights, x, z, v, target, weight = problem
    workspace = Workspace()
    _, first = rollout_gradients(UNITS, weights, x, z, v, target, weight, workspace)
    first = {name: value.clone() for name, value in first.items()}
    rollout_gradients(UNITS, weights, x[:2], z[:, :2], v[:, :2], target[:, :2], weight[:, :2], workspace)
    _, again = rollout_gradients(UNITS, weights, x, z, v, target, weight, workspace)
    for name in first:
        assert torch.equal(first[name], again[name]), name


def test_a_network_without_output_extrapolates_linearly(problem):
    architecture, weights, x, z, v, _, _ = problem
    still = {**weights, "output": torch.zeros_like(weights["output"]), "output_bias": torch.zeros(SEEDS, 1, 1).double()}
    predicted = roll_out(architecture, UNITS, still, x, z, v)
    expected = z[..., -1:] + UNITS.step * v[..., -1:] * torch.arange(1, STEPS + 1)
    torch.testing.assert_close(predicted, expected)
