"""Muscle curves of a shape that no family holds: nothing else is named for what they do."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.data.simulate import simulate_trials
from myowave.diagnosis.causes import OWN_CURVES
from myowave.diagnosis.likelihood.pushes import ACTIVE, PASSIVE, WIDTH, bumps, moved_by, pushes_of_curves
from myowave.diagnosis.search.diagnose import weigh
from myowave.diagnosis.search.score import score_effect
from myowave.identification.output_error import fit_model
from myowave.identification.record import make_record
from myowave.physics.curves import Curves
from myowave.physics.effect import Effect, Parameter


@pytest.fixture(scope="module")
def damped(make_fit):
    return make_fit({"joint_damping": {"c": 1.0}})


def of_one_muscle(height):
    """An effect that adds a smooth bump to the active force of the first muscle only, over the fibre length."""

    def more(force, activation, fibre_length, fibre_velocity, curves, *, w):
        one = torch.zeros(force.shape[-1], dtype=force.dtype)
        one[0] = 1.0
        bump = torch.exp(-0.5 * ((fibre_length - 0.9) / WIDTH) ** 2)
        return force + w * one * height * activation * curves.force_velocity(fibre_velocity) * bump

    parameters = {"w": Parameter(unit="-", low=-3.0, high=3.0, typical=1.0, meaning="bump")}
    return Effect("bump", "muscle", "", more, parameters, "test")


@pytest.fixture(scope="module")
def make_strange(dataset, base, free, effects):
    """The base model fitted to an arm whose first muscle has a bump on its curve, and what else is hidden there."""

    def make(noise_deg=0.5, **hidden):
        hiding = dataset.model_copy(update={"hidden_effect": {"bump": {"w": 2.0}, **hidden}})
        trials = simulate_trials("strange", hiding, base, {**effects, "bump": of_one_muscle(ACTIVE)})[0]
        noise = np.radians(noise_deg) * np.random.default_rng(3).standard_normal(trials.angle.shape)
        record = make_record(replace(trials, angle=trials.angle + noise), base)
        expected = [replace(p, deviation=0.1 * p.start) for p in free]
        return fit_model(base, record.train, expected, starts=2)

    return make


def test_a_bump_does_to_the_motion_what_an_effect_of_that_form_does(damped):
    columns = damped.normal.without_starts(moved_by(damped, pushes_of_curves(damped)))
    score = score_effect(damped, of_one_muscle(ACTIVE))
    moved = damped.normal.without_starts(score.start.normal.slope[..., -1:])[..., 0]
    (own,) = [c for c in np.moveaxis(columns, -1, 0) if np.corrcoef(c.ravel(), moved.ravel())[0, 1] > 0.999]
    assert np.linalg.norm(own - moved) < 0.1 * np.linalg.norm(moved)


def test_what_curves_of_another_shape_leave_is_named_so_and_so_is_damping_beside_them(make_strange, effects):
    few = [effects[name] for name in ("joint_damping", "gravity_tilt", "emg_crosstalk", "extra_delay")]

    def judged(fit):
        return weigh(fit, fit.record, fit.free, few)

    alone = judged(make_strange())
    assert alone.kind == "unknown" and alone.answer.of_curves and alone.answer.missing > np.radians(0.1)
    assert OWN_CURVES in alone.answer.probabilities
    beside = judged(make_strange(joint_damping={"c": 1.0}))
    assert (beside.kind, beside.effects, beside.answer.of_curves) == ("partial", ("joint_damping",), True)


def test_bumps_leave_the_force_at_rest_to_the_largest_force_and_are_small():
    length = torch.linspace(0.4, 1.7, 27, dtype=torch.float64)
    still, full = torch.zeros_like(length), torch.ones_like(length)
    parts = bumps(Curves(), full, length, still)
    velocities = slice(9, 16)  # between those of the active length and those of the passive curve
    assert parts.shape == (27, 20) and (parts[:, velocities] == 0).all()
    assert parts[:, :9].max() == pytest.approx(ACTIVE, rel=0.01) and parts[:, 16:].max() == pytest.approx(PASSIVE)
    assert (bumps(Curves(), still, length, full)[:, :16] == 0).all(), "no active force without activation"
