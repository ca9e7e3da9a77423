"""Muscle curves in another shape than published: what each constant changes, and what none of them may."""

import math

import pytest
import torch

from myowave.physics.constants import CURVE_CONSTANTS
from myowave.physics.curves import DEGROOTE, ECCENTRIC_FORCE, MILLARD, SHAPE_AF, THELEN, Curves
from myowave.physics.valued import give_values

FAMILIES = {"paper": Curves(), "millard": MILLARD, "degroote": DEGROOTE, "thelen": THELEN}
LENGTHS = torch.linspace(0.3, 1.8, 301, dtype=torch.float64)
VELOCITIES = torch.linspace(-1.2, 1.2, 481, dtype=torch.float64)
SHORTENING, LENGTHENING = VELOCITIES[(VELOCITIES > -1) & (VELOCITIES < 0)], VELOCITIES[VELOCITIES > 0]


def shaped(family="paper", **constants):
    return FAMILIES[family].shaped(values(**constants))


def values(**constants):
    return {name: torch.tensor(constants.get(name, 0.0), dtype=torch.float64) for name in CURVE_CONSTANTS}


def random_shapes(count):
    """Shapes three standard deviations of the settings wide."""
    random = torch.Generator().manual_seed(0)
    size = {"ascending": 0.3, "descending": 0.3, "onset": 0.15}
    for _ in range(count):
        draw = 2 * torch.rand(len(CURVE_CONSTANTS), generator=random, dtype=torch.float64) - 1
        yield {n: size.get(n, 0.9) * float(x) for n, x in zip(CURVE_CONSTANTS, draw, strict=True)}


@pytest.mark.parametrize("family", FAMILIES)
def test_a_shape_of_zeros_changes_nothing(family):
    curves, same = FAMILIES[family], shaped(family)
    torch.testing.assert_close(same.active_length(LENGTHS), curves.active_length(LENGTHS), rtol=0, atol=1e-12)
    torch.testing.assert_close(same.passive(LENGTHS), curves.passive(LENGTHS), rtol=0, atol=1e-12)
    torch.testing.assert_close(same.force_velocity(VELOCITIES), curves.force_velocity(VELOCITIES), rtol=0, atol=1e-12)


@pytest.mark.parametrize("family", FAMILIES)
def test_in_any_shape_a_fibre_at_rest_at_its_optimum_has_force_one_and_none_at_its_largest_speed(family):
    one, rest = (torch.tensor(x, dtype=torch.float64) for x in (1.0, 0.0))
    for constants in random_shapes(20):
        curves = shaped(family, **constants)
        torch.testing.assert_close(curves.active_length(one), FAMILIES[family].active_length(one))
        torch.testing.assert_close(curves.force_velocity(rest), FAMILIES[family].force_velocity(rest).clamp(max=1.0))
        torch.testing.assert_close(curves.force_velocity(-one), FAMILIES[family].force_velocity(-one))


@pytest.mark.parametrize("family", FAMILIES)
def test_in_any_shape_a_fibre_bears_more_the_slower_it_shortens_and_the_faster_it_lengthens(family):
    for constants in random_shapes(20):
        assert torch.diff(shaped(family, **constants).force_velocity(VELOCITIES)).min() > -1e-12, constants


@pytest.mark.parametrize("bend", [-0.5, 0.25, 1.0])
def test_concentric_is_another_constant_of_hills_hyperbola(bend):
    """(1 + v) / (1 - v / Af), with 1 + 1 / Af changed by a factor."""
    af = 1 / ((1 + 1 / SHAPE_AF) * torch.exp(torch.tensor(bend, dtype=torch.float64)) - 1)
    hill = (1 + SHORTENING) / (1 - SHORTENING / af)
    curves = shaped(concentric=bend)
    torch.testing.assert_close(curves.force_velocity(SHORTENING), hill)
    torch.testing.assert_close(curves.force_velocity(LENGTHENING), Curves().force_velocity(LENGTHENING))


def test_yielding_is_the_slope_where_lengthening_begins_and_not_the_largest_force():
    step, far = (torch.tensor(x, dtype=torch.float64) for x in (1e-7, 1e9))
    for yielding in (-0.8, 0.5):
        curves = shaped(yielding=yielding)
        slope = (curves.force_velocity(step) - 1) / (Curves().force_velocity(step) - 1)
        assert slope.log().item() == pytest.approx(yielding, abs=1e-4)
        assert curves.force_velocity(far).item() == pytest.approx(ECCENTRIC_FORCE, abs=1e-6)
        torch.testing.assert_close(curves.force_velocity(SHORTENING), Curves().force_velocity(SHORTENING))


def test_where_a_family_has_no_largest_force_yielding_leaves_what_is_beyond_the_usual_one():
    fast = torch.linspace(1.5, 3.0, 7, dtype=torch.float64)
    usual = FAMILIES["degroote"].force_velocity(fast)
    assert (usual > ECCENTRIC_FORCE).all()
    for yielding in (-0.8, 0.5):
        torch.testing.assert_close(shaped("degroote", yielding=yielding).force_velocity(fast), usual)


def test_eccentric_is_the_most_that_lengthening_adds_from_the_same_slope_on():
    """Thelen's hyperbola, of slope 2 (1 + 1 / 0.25), with the largest force 1.8 of the old where the young have 1.4."""
    gained = 0.8 * 10 * LENGTHENING / (0.8 + 10 * LENGTHENING)
    torch.testing.assert_close(shaped("thelen", eccentric=1.0).force_velocity(LENGTHENING) - 1, gained)


@pytest.mark.parametrize(("name", "side"), [("ascending", -1), ("descending", 1)])
def test_a_limb_of_the_force_length_curve_is_wider_and_the_other_is_as_it_was(name, side):
    off = side * torch.linspace(0.0, 0.6, 61, dtype=torch.float64)
    curves = shaped(**{name: 0.25})
    torch.testing.assert_close(curves.active_length(1 + 1.25 * off), Curves().active_length(1 + off))
    torch.testing.assert_close(curves.active_length(1 - off), Curves().active_length(1 - off))


def test_the_passive_curve_is_multiplied_and_begins_later():
    expected = Curves().passive(LENGTHS) * torch.exp(torch.tensor(0.4, dtype=torch.float64))
    torch.testing.assert_close(shaped(passive=0.4).passive(LENGTHS), expected)
    torch.testing.assert_close(shaped(onset=0.1).passive(LENGTHS + 0.1), Curves().passive(LENGTHS))
    assert shaped(onset=0.1).passive(torch.tensor(1.1, dtype=torch.float64)) == 0


def test_stiffening_is_another_exponent_of_the_passive_curve_with_the_same_force_at_1_3_optimal_lengths():
    """Thelen's (exp(k (l - 1) / 0.6) - 1) / (exp(k) - 1), where Arm26 has k = 4 and his table 5."""

    def rise(k):
        return torch.expm1(k / 0.6 * (LENGTHS.clamp(1.0, 1.6) - 1.0)) / math.expm1(k / 0.6 * 0.3)

    passive = shaped("thelen", stiffening=math.log(4 / 5)).passive(LENGTHS.clamp(max=1.6))
    torch.testing.assert_close(passive, rise(4.0) * THELEN.passive(torch.tensor(1.3, dtype=torch.float64)))


def test_another_family_comes_in_the_same_shape():
    constants = next(random_shapes(1))
    taken, own = shaped(**constants).in_shape(MILLARD), shaped("millard", **constants)
    torch.testing.assert_close(taken.force_velocity(VELOCITIES), own.force_velocity(VELOCITIES))
    torch.testing.assert_close(taken.active_length(LENGTHS), own.active_length(LENGTHS))
    assert Curves().in_shape(MILLARD) is MILLARD, "as published"


def test_derivatives_by_the_shape_are_those_of_the_curves():
    constants = next(random_shapes(1))

    def everything(vector):
        curves = Curves().shaped(dict(zip(CURVE_CONSTANTS, vector, strict=True)))
        lengths, velocities = LENGTHS[5::20], VELOCITIES[25::40]
        return torch.cat([curves.active_length(lengths), curves.passive(lengths), curves.force_velocity(velocities)])

    at = torch.tensor([constants[name] for name in CURVE_CONSTANTS], dtype=torch.float64)
    exact, step = torch.autograd.functional.jacobian(everything, at), 1e-6
    for i, name in enumerate(CURVE_CONSTANTS):
        nudge = step * torch.eye(len(at), dtype=torch.float64)[i]
        difference = (everything(at + nudge) - everything(at - nudge)) / (2 * step)
        torch.testing.assert_close(exact[:, i], difference, rtol=1e-5, atol=1e-7, msg=lambda m, n=name: f"{n}: {m}")
        assert exact[:, i].abs().max() > 0, name


def test_a_model_takes_its_shape_from_its_constants_muscles_and_joint_alike(elbow):
    like = torch.zeros((), dtype=torch.float64)
    assert give_values(elbow, {}, like).curves is elbow.curves, "as published where all are 0"
    valued = give_values(elbow, {"descending_curve": 0.25, "yielding_curve": 0.5}, like)
    expected = elbow.curves.shaped(values(descending=0.25, yielding=0.5))
    for curves in (valued.curves, valued.joint_curves):
        torch.testing.assert_close(curves.active_length(LENGTHS).squeeze(), expected.active_length(LENGTHS))
        torch.testing.assert_close(curves.force_velocity(VELOCITIES).squeeze(), expected.force_velocity(VELOCITIES))
