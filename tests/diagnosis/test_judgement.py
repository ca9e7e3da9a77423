"""A verdict says no more than the evidence: named, in a class, unknown, hidden or adequate."""

from dataclasses import replace

import numpy as np
import pytest

from myowave.diagnosis.misfit.independence import Independence
from myowave.diagnosis.search.rank import rank_effects
from myowave.diagnosis.search.selection import Selection
from myowave.diagnosis.search.verdict import judge


def independence(holds):
    return Independence(("angle",), np.array([0.0]), np.array([[0.05 if holds else 0.5]]), np.array([0.1]))


@pytest.fixture(scope="module")
def fit(make_fit):
    return make_fit({"joint_damping": {"c": 1.0}})


@pytest.fixture(scope="module")
def weighed(fit, effects):
    """Candidates for which there is no evidence."""
    ranking = rank_effects(fit, [effects[n] for n in ("joint_damping", "gravity_tilt", "hand_load")])
    return [replace(c, delta_bic=-1.0) for c in ranking]


@pytest.fixture
def named(fit, weighed, effects):
    """The selection of an effect that explains a share of the excess over the noise, and its class."""

    def make(share, members=("joint_damping",)):
        noise = fit.record.samples * fit.record.noise**2
        rss = noise + (1 - share) * (fit.rss - noise)
        simulation = replace(fit.simulation, model=fit.model.with_effects([effects["joint_damping"]]))
        richer = replace(fit, simulation=simulation, normal=replace(fit.normal, rss=np.array(rss)))
        return Selection((fit, richer), (weighed, weighed), {"joint_damping": members})

    return make


@pytest.mark.parametrize(
    ("share", "holds", "kind"),
    [(0.3, False, "unknown"), (0.7, False, "unknown"), (0.9, False, "effect"), (0.7, True, "effect")],
)
def test_effects_are_named_where_they_explain_most_or_leave_no_structure(share, holds, kind, named):
    verdict = judge(named(share), independence(holds))
    assert verdict.kind == kind
    assert verdict.explained == pytest.approx(share)
    assert verdict.effects == ("joint_damping",) and verdict.structure_left != holds


def test_effects_that_cannot_be_told_apart_are_a_class(named):
    verdict = judge(named(0.95, ("joint_damping", "muscle_damping")), independence(True))
    assert verdict.kind == "class" and verdict.alternatives == (("joint_damping", "muscle_damping"),)


def test_without_an_effect_structure_or_evidence_is_unknown_and_nothing_is_adequate(fit, weighed):
    nothing = Selection((fit,), (weighed,))
    usual = replace(fit, values=np.array([p.start for p in fit.free]))
    assert judge(nothing, independence(False)).kind == "unknown"
    assert judge(replace(nothing, ladder=(usual,)), independence(True)).kind == "adequate"
    tempting = [replace(c, delta_bic=11.0) for c in weighed]
    assert judge(replace(nothing, ladder=(usual,), rankings=(tempting,)), independence(True)).kind == "unknown"


@pytest.mark.parametrize(("errors_away", "kind"), [(1.0, "adequate"), (4.0, "undecidable"), (-4.0, "undecidable")])
def test_a_parameter_outside_its_usual_range_may_hide_an_absorbed_effect(errors_away, kind, fit, weighed):
    """Outside by more than two standard errors; only a parameter that an absorbed effect moves counts."""
    assert next(c for c in weighed if c.name == "hand_load").score.absorbed_by
    for name, hidden in (("f0_Bi", ("hand_load",)), ("l0_Bi", ())):
        i = next(i for i, p in enumerate(fit.free) if p.name == name)
        p, error, values = fit.free[i], fit.standard_errors()[name], np.array([p.start for p in fit.free])
        values[i] += np.sign(errors_away) * p.spread * p.start + errors_away * error
        verdict = judge(Selection((replace(fit, values=values),), (weighed,)), independence(True))
        assert verdict.kind == (kind if hidden else "adequate")
        assert verdict.masked == ({name: hidden} if verdict.kind == "undecidable" else {})
