"""What the catalogue does not hold and that would do as well as an effect that is named."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.diagnosis.misfit.repeated import correcting_effects, corrections
from myowave.diagnosis.misfit.terms import torque_terms
from myowave.diagnosis.search import conclude
from myowave.diagnosis.search.conclude import search
from myowave.diagnosis.search.rank import rank_effects
from myowave.diagnosis.search.score import score_effect
from myowave.diagnosis.search.selection import Selection
from myowave.diagnosis.search.stand_ins import StandIns, find_stand_ins, find_stand_ins_for_all
from myowave.diagnosis.search.verdict import judge
from myowave.identification.output_error import refit


@pytest.fixture(scope="module")
def damped(make_fit):
    return make_fit({"joint_damping": {"c": 1.0}})


def weigh(fit, effects, *names):
    """The stand-ins of the first effect, where the catalogue holds only some."""
    ranking = rank_effects(fit, [effects[name] for name in names])
    return find_stand_ins(fit, next(c for c in ranking if c.name == names[0]), ranking)


def test_an_effect_that_is_in_the_data_has_no_equal_outside_the_catalogue(damped, effects):
    found = weigh(damped, effects, "joint_damping")
    assert found.names == () and not found.better


def test_where_the_effect_in_the_data_is_not_in_the_catalogue_its_torque_does_better_than_another(damped, effects):
    found = weigh(damped, effects, "muscle_damping")
    assert found.better and found.names[0] == "a torque like qdot"


def test_what_the_catalogue_holds_under_another_name_is_no_stand_in(damped, effects):
    found = weigh(damped, effects, "muscle_damping", "joint_damping")
    assert "a torque like qdot" not in found.names


def test_an_effect_that_something_outside_the_catalogue_outdoes_is_not_named(damped, effects):
    verdict = judge(search(damped, [effects["muscle_damping"], effects["fatigue"]]))
    assert verdict.effects == () and verdict.kind in ("unknown", "adequate")


def test_what_would_do_as_well_makes_a_class(damped, effects):
    found = search(damped, [effects["joint_damping"]])
    (alone,) = found.stand_ins.values()
    assert judge(found).kind == "effect"
    others = {"joint_damping": replace(alone, names=("a torque like q qdot",))}
    verdict = judge(replace(found, stand_ins=others))
    assert verdict.kind == "class" and verdict.stand_ins == {"joint_damping": ("a torque like q qdot",)}
    assert judge(replace(found, stand_ins={"joint_damping": replace(alone, better=True)})).kind == "unknown"


def test_an_angle_that_lags_would_do_for_muscles_that_do(make_fit, effects):
    lagging = make_fit({"observation_lag": {"tau": 0.01}})
    assert "an angle that is late" in weigh(lagging, effects, "activation_dynamics").names
    assert "an angle that is late" not in weigh(lagging, effects, "activation_dynamics", "clock_shift").names


def test_one_cause_outside_the_catalogue_that_does_better_than_two_effects_refutes_both(make_fit, effects):
    heavy = make_fit({"forearm_inertia": {"r": 0.6}})
    pair = [effects[name] for name in ("constant_torque", "gravity_tilt")]
    ranking = rank_effects(heavy, pair)
    model = heavy.model.with_effects(pair)
    both = refit(heavy, model, [*heavy.free, *(p for c in ranking for p in c.score.free)])
    alone = find_stand_ins_for_all(heavy, both, ranking)
    assert alone.better and alone.names[0] == "a torque like qddot"
    told = StandIns(("a torque like q",)).or_instead_of_all(alone)
    assert told.better and told.names == ("a torque like q", "a torque like qddot instead of all effects named")
    found = conclude._weigh_each(conclude.conclude(Selection((heavy, both), (ranking, []))), tuple(pair), ())
    assert set(found.stand_ins) == {effect.name for effect in pair}
    assert all(o.better and o.names[-1].endswith("instead of all effects named") for o in found.stand_ins.values())


def test_corrections_are_named_by_what_they_go_with(damped):
    names = list(corrections(damped))
    assert len(set(names)) == len(names)
    assert {"a torque like q", "excitation of Bi like that of Tri", "a torque like a_Tri qdot"} <= set(names)


def test_terms_are_what_they_are_called():
    q, v, a = torch.tensor(0.5), torch.tensor(-2.0), torch.tensor([0.3, 0.8])
    of_motion = {"1": 1, "q": 0.5, "q^2": 0.25, "sin(2 q)": math.sin(1), "qdot": -2, "qdot |qdot|": -4}
    of_motion |= {"the sign of qdot": -1, "q qdot": -1}
    parts = {"": 1, "^2": None, " q": 0.5, " q^2": 0.25, " qdot": -2, " qdot |qdot|": -4}
    expected = {
        f"a_{muscle}{name}": own * own if factor is None else own * factor
        for muscle, own in (("Bi", 0.3), ("Tri", 0.8))
        for name, factor in parts.items()
    }
    middle = 1.5
    found = {name: float(term(q + middle, v, a)) for name, term in torque_terms(["Bi", "Tri"], middle).items()}
    assert found == pytest.approx(of_motion | expected)


@pytest.mark.parametrize(("what", "flexor"), [("that of Tri", 0.55), ("its square", 0.22), ("a constant", 0.7)])
def test_excitations_are_more_by_what_they_are_called(damped, what, flexor):
    effect = correcting_effects(damped)[f"excitation of Bi like {what}"]
    more = effect.function(torch.tensor([0.2, 0.7]), torch.tensor([1.0, -1.0]), x=torch.tensor(0.5))
    assert more.tolist() == pytest.approx([flexor, 0.7])


def test_an_effect_made_of_a_part_of_the_correction_does_to_the_motion_what_the_part_does(damped):
    parts, effects = corrections(damped), correcting_effects(damped)
    assert len(effects) == 8 + 2 * 6 + 1 + 2 * 3 + 3 and set(effects) < set(parts)
    for name, effect in effects.items():
        score = score_effect(damped, effect)
        moved = damped.normal.without_starts(score.start.normal.slope[..., -1:])[..., 0]
        # A part counts as it is where a step begins, an effect all the way, and in its own unit.
        part = parts[name] * (parts[name] * moved).sum() / (parts[name] ** 2).sum()
        assert np.linalg.norm(moved - part) < 0.1 * np.linalg.norm(moved), name


def test_a_part_that_promises_less_than_an_effect_is_fitted_before_the_effect_is_believed(make_fit, effects):
    strongly_damped = make_fit({"joint_damping": {"c": 3.0}})
    ranking = rank_effects(strongly_damped, [effects["muscle_damping"]])
    (wrong,) = ranking
    assert wrong.delta_bic > 100 and wrong.score.drop > strongly_damped.objective / 2
    found = find_stand_ins(strongly_damped, wrong, ranking)
    assert found.better and found.names == ("a torque like qdot",)
