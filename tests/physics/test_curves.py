"""Muscle curves: normalisation, continuity, slopes."""

import numpy as np
import pytest
import torch
from scipy.interpolate import BPoly
from scipy.optimize import brentq

from myowave.physics.curves import FAMILIES, THELEN
from myowave.physics.muscle import activation

LENGTHS = torch.linspace(0.0, 2.2, 44001, dtype=torch.float64)
VELOCITIES = torch.linspace(-1.5, 1.5, 30001, dtype=torch.float64)
STEEPEST = 60.0
ACTIVE_LENGTH = {name: family.active_length for name, family in FAMILIES.items()}
PASSIVE = {name: family.passive for name, family in FAMILIES.items()}
VELOCITY = {name: family.force_velocity for name, family in FAMILIES.items()}


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


@pytest.mark.parametrize("name", VELOCITY)
def test_force_velocity_curve_is_smooth_where_the_muscle_turns(name):
    curve = VELOCITY[name]
    anchors = curve(torch.tensor([-2.0, -1.0, 0.0], dtype=torch.float64))
    torch.testing.assert_close(anchors, torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64), rtol=0, atol=1e-9)
    rise = slopes(curve, VELOCITIES)
    assert rise.min() >= -1e-12
    for within in (VELOCITIES[(VELOCITIES > -0.95) & (VELOCITIES < 0)], VELOCITIES[VELOCITIES > 0]):
        assert torch.diff(slopes(curve, within)).abs().max() < 0.05  # no jump of the slope: C1
    before, after = slopes(curve, torch.tensor([-1e-4, 0.0, 1e-4], dtype=torch.float64))
    assert after / before == pytest.approx(2.0 if name == "thelen" else 1.0, abs=0.01)


@pytest.mark.parametrize(("curves", "x"), [(ACTIVE_LENGTH, LENGTHS), (PASSIVE, LENGTHS), (VELOCITY, VELOCITIES)])
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


def double(*values):
    return torch.tensor(np.array(values, dtype=float).ravel())


def test_taneja_curves_are_eqs_49_and_50_as_printed():
    def active(x):
        return 9 * (x - 0.4) ** 2 if x <= 0.6 else 1 - 4 * (1 - x) ** 2 if x <= 1.4 else 9 * (x - 1.6) ** 2

    def passive(x):
        gamma1, gamma2 = 0.075, 6.6
        if x <= 1.4:
            return 0.0 if x <= 1 else gamma1 * (np.exp(gamma2 * (x - 1)) - 1)
        end = np.exp(0.4 * gamma2)
        return gamma1 * gamma2 * end * x + gamma1 * ((1 - 1.4 * gamma2) * end - 1)

    inside, wide = np.linspace(0.4, 1.6, 49), np.linspace(0.3, 2.2, 60)
    torch.testing.assert_close(ACTIVE_LENGTH["taneja"](double(inside)), double([active(x) for x in inside]))
    torch.testing.assert_close(PASSIVE["taneja"](double(wide)), double([passive(x) for x in wide]))
    assert (ACTIVE_LENGTH["taneja"](double(0.1, 0.39, 1.61, 2.0)) == 0).all(), "no force outside"


def test_hill_velocity_is_the_inverse_of_the_force_that_hill_prints():
    """Shortening v = (F - 1) / (1 + F / Af), Thelen 2003, Eq. 6; lengthening as fast for every force below 1.4 as the
    hyperbola with this limit and the same slope at rest."""
    shape, largest = 0.25, 1.4
    shortening, lengthening = np.linspace(0, 1, 21), np.linspace(1, 1.39, 21)
    velocity = (shortening - 1) / (1 + shortening / shape)
    torch.testing.assert_close(VELOCITY["hill"](double(velocity)), double(shortening))
    slope = 1 + 1 / shape
    velocity = (lengthening - 1) * (largest - 1) / (slope * (largest - lengthening))
    torch.testing.assert_close(VELOCITY["hill"](double(velocity)), double(lengthening))


def test_hill_force_tends_to_its_largest_and_has_one_slope_at_rest():
    curve, step = VELOCITY["hill"], 1e-6
    assert curve(double(1e9)).item() == pytest.approx(1.4, abs=1e-6)
    assert curve(double(1e3)).item() < 1.4
    before, rest, after = curve(double(-step, 0.0, step)).tolist()
    assert (rest - before) / step == pytest.approx((after - rest) / step, rel=1e-4) == pytest.approx(5.0, rel=1e-4)


def bezier(x, x0, y0, slope0, x1, y1, slope1, curviness):
    """Millard et al. 2013: the quintic Bezier curve that leaves and enters along the tangents of its ends."""
    corner_x = (y1 - y0 - slope1 * x1 + slope0 * x0) / (slope0 - slope1)
    corner = np.array([corner_x, y0 + slope0 * (corner_x - x0)])
    first, last, pull = np.array([x0, y0]), np.array([x1, y1]), 0.1 + 0.8 * curviness
    bent, bent_last = first + pull * (corner - first), last + pull * (corner - last)
    points = np.stack([first, bent, bent, bent_last, bent_last, last])
    across, up = (BPoly(axis[:, None], [0, 1]) for axis in points.T)
    return float(up(brentq(lambda u: across(u) - x, 0, 1, xtol=1e-14)))


def chain(x, knots, curviness):
    """Bezier curves from knot (x, y, slope) to knot, one curviness each; straight on beyond the ends."""
    if x <= knots[0][0] or x >= knots[-1][0]:
        at, y, slope = knots[0] if x <= knots[0][0] else knots[-1]
        return y + slope * (x - at)
    i = next(i for i, knot in enumerate(knots[1:]) if x < knot[0])
    return bezier(x, *knots[i], *knots[i + 1], curviness[i])


# Default values of OpenSim 4 for the curves of Millard et al. 2013: ActiveForceLengthCurve (0.4441, 0.73, 1.8123,
# slope 0.8616), FiberForceLengthCurve (strain 0.7, slopes 0.2 and 2 / 0.7), ForceVelocityCurve (0.25, 5, 0.15, 1.4).
TURN = 1 - 0.8616 * (0.95 - 0.73)  # height at 0.73
MILLARD_KNOTS = {
    "active": (
        [
            (0.4441, 0, 0), ((0.4441 + 0.73) / 2, TURN / 2, 1.25 * TURN / (0.73 - 0.4441)),
            ((0.73 + 0.95) / 2, (TURN + 1) / 2, 0.8616), (1, 1, 0),
            ((1.05 + 1.8123) / 2, 0.5, -1 / (1.7623 - 1.05)), (1.8123, 0, 0),
        ],
        [1] * 5,
    ),
    "passive": ([(1, 0, 0), (1.035, 0.2 * 0.035 / 2, 0.2), (1.7, 1, 2 / 0.7)], [0.75] * 2),
    "velocity": (
        [(-1, 0, 0), (-0.9, 0.25 * 0.05, 0.25), (0, 1, 5), (0.9, 1.4 - 0.15 * 0.05, 0.15), (1, 1.4, 0)],
        [0.6, 0.6, 0.9, 0.9],
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "curve", "low", "high"),
    [
        ("active", ACTIVE_LENGTH["millard"], 0.3, 2.0),
        ("passive", PASSIVE["millard"], 0.8, 2.0),
        ("velocity", VELOCITY["millard"], -1.2, 1.2),
    ],
)
def test_millard_curves_are_bezier_curves_between_the_published_knots(name, curve, low, high):
    x = np.linspace(low, high, 60)
    expected = [chain(each, *MILLARD_KNOTS[name]) for each in x]
    torch.testing.assert_close(curve(double(x)), double(expected), rtol=0, atol=1e-6)


def test_degroote_curves_are_the_printed_ones():
    """De Groote et al. 2016, supplement, with their three digits."""
    bells = [(0.815, 1.055, 0.162, 0.063), (0.433, 0.717, -0.030, 0.200), (0.100, 1.000, 0.354, 0.0)]
    d1, d2, d3, d4 = -0.318, -8.149, -0.374, 0.886
    length, velocity = np.linspace(0.4, 1.6, 40), np.linspace(-1, 1, 41)
    active = sum(b1 * np.exp(-0.5 * (length - b2) ** 2 / (b3 + b4 * length) ** 2) for b1, b2, b3, b4 in bells)
    passive = (np.exp(4 * np.maximum(length - 1, 0) / 0.6) - 1) / (np.exp(4) - 1)
    inner = d2 * velocity + d3
    force = d1 * np.log(inner + np.sqrt(inner**2 + 1)) + d4
    for curves, x, expected in (
        (ACTIVE_LENGTH, length, active), (PASSIVE, length, passive), (VELOCITY, velocity, np.maximum(force, 0))
    ):  # fmt: skip
        torch.testing.assert_close(curves["degroote"](double(x)), double(expected), rtol=0, atol=0.015)
    unit = [ACTIVE_LENGTH["degroote"](double(1.0)), PASSIVE["degroote"](double(1.6))]
    torch.testing.assert_close(torch.cat(unit), torch.ones(2, dtype=torch.float64), rtol=0, atol=1e-6)


def test_thelen_curves_are_the_printed_ones():
    """Thelen 2003, Eqs. 3, 4, 6 and 7 for young adults: force from a fibre velocity is the inverse of what he prints,
    v = (0.25 + 0.75 a) v_max (F - a f_l) / b."""
    length = np.linspace(0.4, 1.6, 30)
    bell, strained = np.exp(-((length - 1) ** 2) / 0.45), (np.exp(5 * (length - 1) / 0.6) - 1) / (np.exp(5) - 1)
    torch.testing.assert_close(ACTIVE_LENGTH["thelen"](double(length)), double(bell))
    torch.testing.assert_close(PASSIVE["thelen"](double(length)), double(np.maximum(strained, 0)))
    at_rest = double(1.0)
    for a in (0.1, 0.5, 1.0):
        for force in (*np.linspace(0.0, a, 8), *np.linspace(1.001 * a, 1.39 * a, 8)):
            slow = a + force / 0.25
            fast = (2 + 2 / 0.25) * (a * 1.4 - force) / (1.4 - 1)
            velocity = (0.25 + 0.75 * a) * (force - a) / (slow if force <= a else fast)
            assert THELEN.active(double(a), at_rest, double(velocity)).item() == pytest.approx(force, abs=1e-12)
    # Beyond a strain of 0.6 the passive curve goes on straight.
    beyond = PASSIVE["thelen"](double(1.6, 1.7, 1.8))
    assert beyond[2] - beyond[1] == pytest.approx((beyond[1] - beyond[0]).item()) == pytest.approx(0.1 * 8.39, rel=0.01)


@pytest.mark.parametrize("shape", [-1e-3, 0.0, 5e-7, 1e-3])
def test_activation_changes_with_its_shape_there_too_where_it_is_the_excitation(shape):
    shape = torch.tensor(shape, dtype=torch.float64, requires_grad=True)
    excitation = torch.linspace(0.0, 1.0, 11, dtype=torch.float64).requires_grad_()
    found = activation(excitation, shape)
    by_excitation, by_shape = torch.autograd.grad(found[3], (excitation, shape), create_graph=True)
    (by_both,) = torch.autograd.grad(by_excitation[3], shape)
    assert by_shape.item() == pytest.approx(0.3 * (0.3 - 1) / 2, abs=1e-4)
    assert by_both.item() == pytest.approx(0.3 - 0.5, abs=1e-3)
    torch.testing.assert_close(found.detach(), excitation.detach(), rtol=0, atol=2e-4)
