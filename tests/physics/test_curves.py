"""Muscle curves: normalisation, continuity, slopes."""

import pytest
import torch

from myowave.physics.curves import ACTIVE_LENGTH, FORCE_VELOCITY, PASSIVE

LENGTHS = torch.linspace(0.0, 2.2, 44001, dtype=torch.float64)
VELOCITIES = torch.linspace(-1.5, 1.5, 30001, dtype=torch.float64)
STEEPEST = 60.0


def slopes(curve, x):
    return torch.diff(curve(x)) / torch.diff(x)


@pytest.mark.parametrize("name", ACTIVE_LENGTH)
def test_active_force_is_largest_at_optimal_length_and_continuous(name):
    curve = ACTIVE_LENGTH[name]
    force = curve(LENGTHS)
    assert force.min() >= 0
    assert force.max() == pytest.approx(1.0, abs=2e-3)
    assert LENGTHS[force.argmax()] == pytest.approx(1.0, abs=0.02)
    assert slopes(curve, LENGTHS).abs().max() < STEEPEST


@pytest.mark.parametrize("name", PASSIVE)
def test_passive_force_starts_at_optimal_length_and_only_grows(name):
    curve = PASSIVE[name]
    assert (curve(LENGTHS[LENGTHS <= 1]) == 0).all()
    rise = slopes(curve, LENGTHS[LENGTHS >= 1])
    assert rise.min() >= 0
    assert (torch.diff(rise) >= -1e-6).all()  # stiffer and stiffer, then straight
    assert rise.max() < STEEPEST


@pytest.mark.parametrize("name", FORCE_VELOCITY)
def test_force_velocity_curve_is_smooth_where_the_muscle_turns(name):
    curve = FORCE_VELOCITY[name]
    anchors = curve(torch.tensor([-2.0, -1.0, 0.0], dtype=torch.float64))
    torch.testing.assert_close(anchors, torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64), rtol=0, atol=1e-9)
    rise = slopes(curve, VELOCITIES)
    assert rise.min() >= -1e-12
    within = slopes(curve, VELOCITIES[(VELOCITIES > -0.95)])
    assert torch.diff(within).abs().max() < 0.05  # no jump of the slope: C1


@pytest.mark.parametrize(("curves", "x"), [(ACTIVE_LENGTH, LENGTHS), (PASSIVE, LENGTHS), (FORCE_VELOCITY, VELOCITIES)])
def test_derivatives_of_every_curve_are_its_slopes(curves, x):
    for curve in curves.values():
        point = (x[:-1:50] + 0.3 * (x[1] - x[0])).requires_grad_()
        (gradient,) = torch.autograd.grad(curve(point).sum(), point)
        step = 1e-7
        difference = (curve(point + step) - curve(point - step)).detach() / (2 * step)
        torch.testing.assert_close(gradient, difference, rtol=1e-4, atol=1e-4)


def test_millard_active_curve_has_the_values_of_the_independent_simulator():
    """Values that OpenSim 4.6 gives; see the README of the measured example."""
    length = torch.tensor([0.55, 0.60, 0.65, 0.70], dtype=torch.float64)
    published = torch.tensor([0.27, 0.45, 0.63, 0.77], dtype=torch.float64)
    torch.testing.assert_close(ACTIVE_LENGTH["millard"](length), published, rtol=0, atol=0.005)
