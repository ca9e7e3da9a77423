"""Muscle curves of a shape that no family holds: nothing else is named for what they do."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.signal import butter, filtfilt

from myowave.data.simulate import simulate_trials
from myowave.diagnosis.causes import OWN_CURVES
from myowave.diagnosis.evidence import EVIDENCE, delta_bic, independent_samples
from myowave.diagnosis.misfit import left
from myowave.diagnosis.misfit.own_curves import (
    ACTIVE,
    PASSIVE,
    WIDTH,
    CurvesOut,
    bumps,
    integrate_out_curves,
    own_curves,
)
from myowave.diagnosis.misfit.repeated import Repeated
from myowave.diagnosis.misfit.size import size_of_misfit
from myowave.diagnosis.search import conclude, stand_ins
from myowave.diagnosis.search.conclude import search
from myowave.diagnosis.search.rank import rank_effects
from myowave.diagnosis.search.score import score_effect
from myowave.diagnosis.search.selection import Selection, select_effects
from myowave.diagnosis.search.stand_ins import StandIns, evidence_for_any_curves, find_stand_ins
from myowave.diagnosis.search.verdict import judge
from myowave.identification.output_error import fit_model, refit
from myowave.identification.record import make_record
from myowave.identification.whitening import MotionBand
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


@pytest.fixture(scope="module")
def strange(make_strange):
    return make_strange()


def test_a_bump_does_to_the_motion_what_an_effect_of_that_form_does(damped):
    columns = own_curves(damped)
    score = score_effect(damped, of_one_muscle(ACTIVE))
    moved = damped.normal.without_starts(score.start.normal.slope[..., -1:])[..., 0]
    (own,) = [c for c in np.moveaxis(columns, -1, 0) if np.corrcoef(c.ravel(), moved.ravel())[0, 1] > 0.999]
    assert np.linalg.norm(own - moved) < 0.1 * np.linalg.norm(moved)


def test_bumps_leave_the_force_at_rest_to_the_largest_force_and_are_small():
    length = torch.linspace(0.4, 1.7, 27, dtype=torch.float64)
    still, full = torch.zeros_like(length), torch.ones_like(length)
    parts = bumps(Curves(), full, length, still)
    velocities = slice(9, 16)  # between those of the active length and those of the passive curve
    assert parts.shape == (27, 20) and (parts[:, velocities] == 0).all()
    assert parts[:, :9].max() == pytest.approx(ACTIVE, rel=0.01) and parts[:, 16:].max() == pytest.approx(PASSIVE)
    assert (bumps(Curves(), still, length, full)[:, :16] == 0).all(), "no active force without activation"


def test_freed_curves_lower_the_objective_by_what_they_promise(strange):
    curves = integrate_out_curves(strange, strange.record.noise**2)
    assert strange.objective - float(curves.normal.objective) == pytest.approx(curves.drop, rel=0.01)
    noise = strange.record.samples * strange.record.noise**2
    assert 0.5 * (strange.objective - noise) < curves.drop < strange.objective and curves.occam > 0
    assert integrate_out_curves(strange, 100 * strange.record.noise**2).occam < curves.occam, (
        "poorer data narrow them less"
    )


def test_what_curves_of_another_shape_leave_goes_with_them(strange):
    assert size_of_misfit(strange).significant
    found = conclude.conclude(Selection((strange,), ([],)))
    assert not found.left.only_noise and found.left.of_curves
    verdict = judge(found)
    assert verdict.kind == "unknown" and verdict.of_curves and verdict.causes == ()


def test_curves_that_cost_more_than_they_explain_explain_nothing(strange, monkeypatch):
    monkeypatch.setattr(left, "integrate_out_curves", lambda *args: replace(integrate_out_curves(*args), occam=1e4))
    assert not conclude.conclude(Selection((strange,), ([],))).left.of_curves


@pytest.mark.parametrize("seen", [("slow", "repeated"), ("slow",), ("repeated",)])
def test_what_damping_leaves_does_not_go_with_curves_be_it_only_slow_or_only_repeated(damped, seen, monkeypatch):
    nothing_slow = replace(size_of_misfit(damped), ratio=1.0)
    if "slow" not in seen:
        monkeypatch.setattr(left, "size_of", lambda *args: nothing_slow)
    if "repeated" not in seen:
        nothing = Repeated(0.0, 1.0, damped.variance)
        monkeypatch.setattr(left, "repeated_misfit", lambda *args: nothing)
    found = conclude.conclude(Selection((damped,), ([],)))
    assert not found.left.only_noise and not found.left.of_curves


def test_a_search_among_no_effects_finds_none(damped):
    assert judge(search(damped, [])).effects == ()


def test_an_effect_is_evident_beside_curves_where_it_is_there_and_not_where_only_curves_differ(
    damped, strange, effects
):
    (there,) = rank_effects(damped, [effects["joint_damping"]])
    assert evidence_for_any_curves(damped, there) > 30
    (wrong,) = rank_effects(strange, [effects["pennation"]])
    assert wrong.delta_bic > 2 * EVIDENCE and evidence_for_any_curves(strange, wrong) < EVIDENCE / 2


def test_what_curves_cost_without_an_effect_and_not_with_it_speaks_for_it(damped, effects, monkeypatch):
    (there,) = rank_effects(damped, [effects["joint_damping"]])
    costs = {damped.model.name: 10.0, there.refitted.model.name: 4.0}
    nothing = {name: CurvesOut(0.0, cost, damped.normal) for name, cost in costs.items()}
    monkeypatch.setattr(stand_ins, "integrate_out_curves", lambda fit, variance: nothing[fit.model.name])
    own = delta_bic(damped, there.refitted.objective, 1, independent_samples(there.refitted))
    assert evidence_for_any_curves(damped, there) == pytest.approx(own + 6.0)


def test_an_effect_that_only_curves_call_for_is_one_of_a_class(strange, effects):
    ranking = rank_effects(strange, [effects["pennation"]])
    found = find_stand_ins(strange, ranking[0], ranking)
    assert found.curves and found.names[-1] == OWN_CURVES


@pytest.mark.parametrize("share", [0.5, 1.5])
def test_beside_curves_as_much_evidence_is_asked_for_as_of_any_effect(damped, effects, monkeypatch, share):
    monkeypatch.setattr(stand_ins, "evidence_for_any_curves", lambda *args: share * EVIDENCE)
    ranking = rank_effects(damped, [effects["joint_damping"]])
    assert find_stand_ins(damped, ranking[0], ranking).curves == (share < 1)


def test_a_rest_that_goes_with_curves_leaves_the_name_of_an_effect_that_stands_beside_them(
    damped, effects, monkeypatch
):
    monkeypatch.setattr(conclude, "MOST_OF_IT", 1.1)  # what is left counts, however little
    found = search(damped, [effects["joint_damping"]])
    rest = replace(found, left=replace(found.left, only_noise=False, of_curves=True))
    verdict = judge(rest)
    assert verdict.kind == "partial" and verdict.effects == ("joint_damping",) and verdict.of_curves
    absorbed = {"joint_damping": StandIns((OWN_CURVES,))}
    assert judge(replace(rest, stand_ins=absorbed)).kind == "unknown"
    assert judge(replace(rest, left=replace(rest.left, of_curves=False))).kind == "unknown"
    assert judge(replace(found, stand_ins=absorbed)).kind == "class"


def test_what_only_curves_call_for_is_not_named_beside_an_effect_that_is_there(make_strange, effects):
    both = make_strange(noise_deg=0.3, joint_damping={"c": 1.0})
    names = ["joint_damping", "pennation", "brachialis"]
    asked_for = select_effects(both, [effects[name] for name in names])
    assert set(asked_for.effects) == {"joint_damping", "pennation"}
    found = search(both, [effects[name] for name in names])
    verdict = judge(found)
    assert verdict.effects == ("joint_damping",) and verdict.kind == "partial" and verdict.of_curves
    assert set(found.stand_ins) == set(found.given_others) == {"joint_damping"}
    assert {c.name for c in found.selection.rankings[-1]} == set(names[1:])


def test_curves_are_free_behind_a_filter_too(make_strange):
    strange = make_strange(noise_deg=0.0)
    noise = np.radians(0.5) * np.random.default_rng(7).standard_normal(strange.record.angle.shape)
    angle = strange.record.angle + filtfilt(*butter(2, 5.0, fs=1 / strange.record.dt), noise)
    record = replace(strange.record, angle=angle)
    found = search(refit(replace(strange, record=record), strange.model, strange.free), [])
    assert (
        isinstance(found.selection.fit.record.filter, MotionBand) and not found.left.only_noise and found.left.of_curves
    )


def test_nothing_is_put_before_curves_that_explain_it_all(damped, effects, monkeypatch):
    """An effect that may not be named must not hide that curves explain what the model without it leaves."""
    monkeypatch.setattr(conclude.Findings, "reportable", property(lambda found: False))
    monkeypatch.setattr(left, "goes_with_curves", lambda fit, size: fit.model.name == "base")
    found = search(damped, [effects["joint_damping"]])
    assert found.selection.effects == () and found.left.of_curves
