"""A verdict says no more than the evidence: named, in a class, in part, unknown, hidden or adequate."""

from dataclasses import replace

import numpy as np
import pytest

from myowave.diagnosis.misfit.left import Left
from myowave.diagnosis.misfit.repeated import Repeated
from myowave.diagnosis.misfit.size import Size
from myowave.diagnosis.search.conclude import Findings
from myowave.diagnosis.search.rank import rank_effects
from myowave.diagnosis.search.selection import Selection
from myowave.diagnosis.search.verdict import judge

NOISE, MISSING = np.radians(0.5), np.radians(0.3)


@pytest.fixture(scope="module")
def fit(make_fit):
    return make_fit({"joint_damping": {"c": 1.0}})


@pytest.fixture(scope="module")
def weighed(fit, effects):
    """Candidates for which there is no evidence."""
    ranking = rank_effects(fit, [effects[n] for n in ("joint_damping", "gravity_tilt", "hand_load")])
    return [replace(c, delta_bic=-1.0) for c in ranking]


@pytest.fixture
def usual(fit):
    """The fit with all parameters where searches start."""
    return replace(fit, values=np.array([p.start for p in fit.free]))


def found(selection, *, only_noise=True, slow=0.0, repeated=0.0):
    """What a search over pieces found: what is certainly left is slow, or repeated in all trials, in variances of
    independent samples."""
    chance = 20.0**0.5 if slow else 0.0
    size = Size(NOISE, 0.0 if only_noise else MISSING, 1.0 + (slow + chance) / 10.0, 1.4, 1.0, 10.0)
    left = Left(size, Repeated(10.0 + 20.0**0.5 + repeated, 10.0, NOISE**2), only_noise)
    return Findings(selection, left)


@pytest.fixture
def named(fit, weighed, effects):
    """The selection of an effect that takes most of the misfit away, and its class."""

    def make(members=("joint_damping",)):
        simulation = replace(fit.simulation, model=fit.model.with_effects([effects["joint_damping"]]))
        richer = replace(fit, simulation=simulation, normal=replace(fit.normal, rss=0.1 * fit.normal.rss))
        return Selection((fit, richer), (weighed, weighed), {"joint_damping": members})

    return make


@pytest.mark.parametrize("kind_of_rest", ["slow", "repeated"])
@pytest.mark.parametrize(
    ("share", "only_noise", "kind"),
    [(0.3, False, "unknown"), (0.85, False, "unknown"), (0.97, False, "partial"), (0.3, True, "effect")],
)
def test_effects_are_named_where_they_explain_nearly_all_or_leave_noise(share, only_noise, kind, kind_of_rest, named):
    """Whether what is left is slow or repeated in all trials: the larger one counts."""
    selection = named()
    gained = (selection.ladder[0].objective - selection.fit.objective) / selection.fit.independent_variance
    verdict = judge(found(selection, only_noise=only_noise, **{kind_of_rest: gained * (1 / share - 1)}))
    assert verdict.kind == kind
    assert verdict.explained == pytest.approx(share)
    assert verdict.structure_left != only_noise
    assert verdict.missing >= MISSING if not only_noise else verdict.missing == 0.0
    nothing = kind == "unknown"
    assert verdict.effects == verdict.causes == (() if nothing else ("joint_damping",))
    assert verdict.nearest == (("joint_damping",) if nothing else ())


def test_effects_that_cannot_be_told_apart_are_a_class(named):
    members = ("joint_damping", "muscle_damping")
    verdict = judge(found(named(members)))
    assert verdict.kind == "class" and verdict.alternatives == (members,)
    unknown = judge(found(named(members), only_noise=False, slow=1e9))
    assert unknown.kind == "unknown" and unknown.alternatives == ()


def test_without_an_effect_what_is_left_is_unknown_and_nothing_is_adequate(fit, weighed, usual):
    nothing = Selection((usual,), (weighed,))
    assert judge(found(nothing)).kind == "adequate"
    unknown = judge(found(nothing, only_noise=False, slow=50.0))
    assert unknown.kind == "unknown" and unknown.explained == 0.0 and unknown.missing >= MISSING


def test_a_model_that_does_not_follow_is_unknown_whatever_it_leaves(named, weighed, usual):
    for selection in (named(), Selection((usual,), (weighed,))):
        verdict = judge(found(selection), follows=False)
        assert verdict.kind == "unknown" and not verdict.follows and not verdict.effects


@pytest.mark.parametrize(("errors_away", "kind"), [(1.0, "adequate"), (4.0, "undecidable"), (-4.0, "undecidable")])
def test_a_parameter_outside_its_usual_range_may_hide_an_absorbed_effect(errors_away, kind, fit, weighed):
    """Outside by more than two standard errors; only a parameter that an absorbed effect moves counts."""
    assert next(c for c in weighed if c.name == "hand_load").score.absorbed_by
    for name, hidden in (("f0_Bi", ("hand_load",)), ("l0_Bi", ())):
        i = next(i for i, p in enumerate(fit.free) if p.name == name)
        p, error, values = fit.free[i], fit.standard_errors()[name], np.array([p.start for p in fit.free])
        values[i] += np.sign(errors_away) * p.spread * p.start + errors_away * error
        verdict = judge(found(Selection((replace(fit, values=values),), (weighed,))))
        assert verdict.kind == (kind if hidden else "adequate")
        assert verdict.masked == ({name: hidden} if verdict.kind == "undecidable" else {})
