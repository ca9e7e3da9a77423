"""Muscle curves and paths of a shape that no family holds: nothing else is named for what they do."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.data.simulate import simulate_trials
from myowave.diagnosis.causes import OWN_SHAPES
from myowave.diagnosis.likelihood.components import PATHS
from myowave.diagnosis.likelihood.forcing import moved_by
from myowave.diagnosis.likelihood.shapes import (
    ACTIVE,
    ARM_AT,
    ARM_WIDTH,
    OWN,
    PASSIVE,
    PATH,
    SLOWING,
    WIDTH,
    curve_bumps,
    path_bumps,
    pushes_of_curves,
    pushes_of_paths,
)
from myowave.diagnosis.search.diagnose import weigh
from myowave.diagnosis.search.score import score_effect
from myowave.identification.free_parameters import effect_parameters
from myowave.identification.output_error import fit_model, refit
from myowave.identification.record import make_record
from myowave.physics.curves import Curves
from myowave.physics.effect import Effect, Parameter


@pytest.fixture(scope="module")
def damped(make_fit):
    return make_fit({"joint_damping": {"c": 1.0}})


@pytest.fixture(scope="module")
def lagging(make_fit, base, effects):
    lag = effects["activation_dynamics"]
    fit, model = make_fit({"activation_dynamics": {"rise": 0.1, "decay": 0.2}}), base.with_effects([lag])
    return refit(fit, model, (*fit.free, *effect_parameters(model, lag)))


def of_muscles(height, place):
    """An effect that adds a smooth bump to the active force of some muscles, over the fibre length."""

    def more(force, activation, fibre_length, fibre_velocity, curves, *, w):
        some = torch.zeros(force.shape[-1], dtype=force.dtype)
        some[place] = 1.0
        bump = torch.exp(-0.5 * ((fibre_length - 0.9) / WIDTH) ** 2)
        return force + w * some * height * activation * curves.force_velocity(fibre_velocity) * bump

    parameters = {"w": Parameter(unit="-", low=-3.0, high=3.0, typical=1.0, meaning="bump")}
    return Effect("bump", "muscle", "", more, parameters, "test")


def bent(rad):
    """An effect that adds a smooth bump to the first muscle's moment arm over the angle, with its length."""

    def more(length_mt, moment_arm, q, *, w):
        first = w * torch.eye(length_mt.shape[-1], dtype=q.dtype)[0]
        off = (q - rad) / ARM_WIDTH
        area = ARM_WIDTH * np.sqrt(np.pi / 2) * torch.erf(off / np.sqrt(2))
        return length_mt - first * area, moment_arm + first * torch.exp(-0.5 * off**2)

    parameters = {"w": Parameter("m", low=-0.1, high=0.1, typical=0.01, meaning="bump")}
    return Effect("bent", "path", "", more, parameters, "test")


@pytest.fixture(scope="module")
def make_strange(dataset, base, free, effects):
    """The base model fitted to an arm that hides a bump on the curve of its first muscle, or on its path."""

    def make(noise_deg=0.5, **hidden):
        hiding = dataset.model_copy(update={"hidden_effect": hidden})
        strange = {"bump": of_muscles(ACTIVE, 0), "bent": bent(0.7)}
        trials = simulate_trials("strange", hiding, base, {**effects, **strange})[0]
        noise = np.radians(noise_deg) * np.random.default_rng(3).standard_normal(trials.angle.shape)
        record = make_record(replace(trials, angle=trials.angle + noise), base)
        expected = [replace(p, deviation=0.1 * p.start) for p in free]
        return fit_model(base, record.train, expected, starts=2)

    return make


def moved_as(fit, pushes, effect, alike=0.999):
    """How the one bump moves the arm that does what the effect does, and how one unit of the effect does."""
    columns = fit.normal.without_starts(moved_by(fit, pushes(fit)))
    moved = fit.normal.without_starts(score_effect(fit, effect).start.normal.slope[..., -1:])[..., 0]
    (own,) = [c for c in np.moveaxis(columns, -1, 0) if np.corrcoef(c.ravel(), moved.ravel())[0, 1] > alike]
    return own, moved / effect.parameters["w"].typical


@pytest.mark.parametrize("fitted", ["damped", "lagging"])
def test_a_bump_of_a_curve_does_to_the_motion_what_an_effect_of_that_form_does(fitted, request):
    fit = request.getfixturevalue(fitted)
    one, moved = moved_as(fit, pushes_of_curves, of_muscles(ACTIVE, 0))
    assert np.linalg.norm(one - OWN * moved) < 0.1 * np.linalg.norm(OWN * moved)
    every, moved = moved_as(fit, pushes_of_curves, of_muscles(ACTIVE, slice(None)), 0.998)
    assert np.linalg.norm(every - moved) < 0.1 * np.linalg.norm(moved)


def test_a_bump_of_a_path_does_to_the_motion_what_an_effect_of_that_form_does(damped):
    own, moved = moved_as(damped, pushes_of_paths, bent(ARM_AT[3]))
    seen = damped.sensitive.motion.state[..., 0]
    l1, l2 = (damped.model.muscles[0].path.constants[name] for name in ("l1", "l2"))
    arm = l1 * l2 * torch.sin(seen) / torch.sqrt(l1**2 + l2**2 + 2 * l1 * l2 * torch.cos(seen))
    expected = PATH * float((arm**2).mean().sqrt()) * moved
    assert np.linalg.norm(own - expected) < 0.1 * np.linalg.norm(expected)


def test_what_curves_of_another_shape_leave_is_named_so_and_so_is_damping_beside_them(make_strange, effects):
    few = [effects[name] for name in ("joint_damping", "gravity_tilt", "emg_crosstalk", "extra_delay")]

    def judged(fit):
        return weigh(fit, fit.record, fit.free, few)

    curved = {"bump": {"w": 2.0}}
    alone = judged(make_strange(**curved))
    assert alone.kind == "unknown" and alone.answer.of_shapes and alone.answer.missing > np.radians(0.1)
    assert OWN_SHAPES in alone.answer.probabilities
    beside = judged(make_strange(**curved, joint_damping={"c": 1.0}))
    assert (beside.kind, beside.causes, beside.answer.of_shapes) == ("partial", ("joint_damping",), True)


def test_what_a_path_of_another_shape_leaves_is_named_so_and_not_as_an_offset(make_strange, effects):
    few = [effects[name] for name in ("moment_arm_offset", "pennation", "brachialis", "gravity_tilt")]
    fit = make_strange(bent={"w": 0.03})
    answer = weigh(fit, fit.record, fit.free, few).answer
    assert answer.named == ((OWN_SHAPES,),) and answer.best.on == {PATHS}, "curves have no part in it"


def test_the_length_of_a_path_goes_with_its_moment_arm_as_virtual_work_asks():
    q = torch.linspace(-0.5, 3.0, 50, dtype=torch.float64, requires_grad=True)
    arm, length = path_bumps(q)
    for bump in range(len(ARM_AT)):
        (slope,) = torch.autograd.grad(length[:, bump].sum(), q, retain_graph=True)
        torch.testing.assert_close(-slope, arm[:, bump])
    assert arm.max().item() == pytest.approx(PATH, rel=0.01)


def test_bumps_leave_the_force_at_rest_to_the_largest_force_and_are_small():
    length = torch.linspace(0.4, 1.7, 27, dtype=torch.float64)
    still, full = torch.zeros_like(length), torch.ones_like(length)
    parts = curve_bumps(Curves(), full, length, still)
    velocities = slice(9, 16)  # between those of the active length and those of the passive curve
    assert parts.shape == (27, 21) and (parts[:, velocities] == 0).all() and (parts[:, 20] == 0).all()
    assert parts[:, :9].max() == pytest.approx(ACTIVE, rel=0.01) and parts[:, 16:20].max() == pytest.approx(PASSIVE)
    assert (curve_bumps(Curves(), still, length, full)[:, :16] == 0).all(), "no active force without activation"


@pytest.mark.parametrize("activation", [0.1, 0.5, 1.0])
def test_the_last_bump_slows_muscles_that_are_little_active_as_thelen_does(activation):
    velocity = torch.linspace(-0.3, 0.3, 25, dtype=torch.float64)
    ones, usual = torch.ones_like(velocity), Curves()
    share = (1 - np.exp(-SLOWING * (1 - activation))) / max(1 - activation, 1e-9)  # of v_max, as in Thelen 2003
    slower = Curves(slowing=share)
    change = slower.active(activation * ones, ones, velocity) - usual.active(activation * ones, ones, velocity)
    torch.testing.assert_close(curve_bumps(usual, activation * ones, ones, velocity)[:, 20], change)
