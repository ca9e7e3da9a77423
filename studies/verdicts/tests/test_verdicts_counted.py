"""The benchmark makes the worlds that it names, hides what it says, and counts right and wrong as promised."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
import yaml
from scipy.stats import binomtest

from myowave.diagnosis.search.verdict import Verdict
from myowave.settings import Scatter
from studies.verdicts.cases import Case, hidden_values, list_cases, make_trials, score
from studies.verdicts.figures import draw_rates
from studies.verdicts.settings import Verdicts
from studies.verdicts.summary import summarize, write_page
from studies.verdicts.worlds import ALLOWED, FINER, World, draw_curves, draw_world, record, sample_and_hold

SCATTER = {"slack": Scatter(relative=0.03), "delay": Scatter(absolute=0.007)}
PLAN = Verdicts.model_validate(
    yaml.safe_load((Path(__file__).parents[1] / "settings.yaml").read_text(encoding="utf-8"))["verdicts"]
)


def a_case(world="as_assumed", hidden=None, noise_deg=0.0, out=()):
    return Case(world, hidden or {}, out, 3, 1.0, noise_deg)


def test_every_hidden_value_is_within_its_bounds_and_not_zero(model, effects):
    for effect in effects.values():
        for strength, turn in ((0.25, 0), (1.0, 1)):
            for name, value in hidden_values(model, effect, strength, turn).items():
                parameter = model.with_effects([effect]).parameters_of(effect)[f"{effect.name}.{name}"]
                assert parameter.low <= value <= parameter.high and value != 0.0


def test_all_effects_and_noises_come_round_in_every_world(model, effects):
    plan = PLAN.model_copy(update={"cases": len(effects), "clean_sets": 5})
    for world in ALLOWED:
        cases = list_cases(world, model, effects, plan)
        assert {name for case in cases for name in case.hidden} == set(effects)
        assert sum(not case.hidden for case in cases) == (0 if world == "outside" else 5)
        assert all(case.taken_out for case in cases) == (world == "outside")
        assert {case.noise_deg for case in cases} == ({0.3, 1.0, 3.0} if world == "as_assumed" else {1.0})


def test_few_cases_are_another_sample_of_the_catalogue_in_each_world_and_a_part_of_more(model, effects):
    def hidden(world, cases):
        plan = PLAN.model_copy(update={"cases": cases, "clean_sets": 1})
        return [(case.label, case.strength) for case in list_cases(world, model, effects, plan) if case.hidden]

    few = {world: hidden(world, 6) for world in ALLOWED}
    assert all(hidden(world, 9)[: len(cases)] == cases for world, cases in few.items())
    first = [{name for name, _ in cases} for cases in few.values()]
    assert all(one != other for i, one in enumerate(first) for other in first[:i])


def test_what_the_recorder_reports_holds_nothing_of_what_was_drawn(model, effects, dataset):
    case = a_case("other_constants", {"joint_damping": {"c": 0.5}})
    world = draw_world(case.world, model, SCATTER, case.random)
    trials = make_trials(case, world, dataset, effects)
    assert set(world.constants) == {"slack_Bi", "slack_Tri", "delay_Bi", "delay_Tri"}
    assert trials.constants == {} and world.constants["slack_Bi"] != model.defaults["slack_Bi"]


def named(*effects, kind="effect", stand_ins=None):
    others = {name: ("a torque like q",) for name in stand_ins or ()}
    return Verdict(kind, effects, (), others, (), {}, {}, 1.0, False, 0.0, 0.0, {})


@pytest.mark.parametrize(
    "case, verdict, right, wrong",
    [
        (a_case(hidden={"pennation": {}}), named("pennation"), True, False),
        (
            a_case(hidden={"pennation": {}}),
            named("joint_damping", kind="class", stand_ins=["joint_damping"]),
            False,
            True,
        ),
        # Curves of no family are in no catalogue: a class that says so holds the truth, a family says what is there.
        (a_case("other_curves"), named("fatigue", kind="class", stand_ins=["fatigue"]), True, False),
        (a_case("other_curves"), named("fatigue"), False, True),
        (a_case("other_curves"), named("thelen_curves"), True, False),
        (a_case("outside", {"fatigue": {}}, out=("fatigue",)), named("pennation"), False, True),
        (a_case("outside", {"fatigue": {}}, out=("fatigue",)), named(kind="unknown"), True, False),
        (a_case("outside", {"millard_curves": {}}, out=("millard_curves",)), named("thelen_curves"), False, False),
    ],
)
def test_a_verdict_is_right_where_it_holds_the_truth(case, verdict, right, wrong):
    scored = score(case, verdict)
    assert (scored["right"], scored["wrong_name"]) == (right, wrong)


def test_other_curves_are_muscle_curves_and_differ_from_arm_to_arm():
    lengths, velocities = torch.linspace(0.3, 1.9, 400).double(), torch.linspace(-1.0, 1.0, 400).double()
    drawn = [draw_curves(np.random.default_rng(seed)) for seed in range(6)]
    for curves in drawn:
        active = curves.active_length(lengths)
        assert active.max() == pytest.approx(1.0, abs=1e-4) and active.min() >= 0.0
        assert (torch.diff(curves.passive(lengths)) >= 0).all()
        force = curves.force_velocity(velocities)
        assert (torch.diff(force) >= -1e-12).all() and force[0] == pytest.approx(0.0, abs=1e-6)
        assert curves.force_velocity(torch.zeros(1).double()).item() == pytest.approx(1.0, abs=1e-3)
    assert len({round(curves.active_length(torch.tensor([0.8]).double()).item(), 6) for curves in drawn}) == 6


def test_emg_of_a_sample_and_hold_stays_as_it_is_until_the_next_sample():
    emg = torch.rand(2, 5, 3)
    fine = sample_and_hold(emg)
    assert fine.shape == (2, 4 * FINER + 1, 3)
    assert torch.equal(fine[:, FINER : 2 * FINER], emg[:, 1:2].expand(-1, FINER, -1))


@pytest.mark.parametrize(
    ("recording", "changes"), [({"step_deg": 1.0}, "angle"), ({"emg_noise": 0.05}, "emg"), ({"angle_hz": 5.0}, "angle")]
)
def test_a_recorder_changes_what_it_says_and_no_more(trials, model, recording, changes):
    seen = record(trials, World(model, recording=recording), np.random.default_rng(1))
    other = {"angle": "emg", "emg": "angle"}[changes]
    np.testing.assert_array_equal(getattr(seen, other), getattr(trials, other))
    assert not np.allclose(getattr(seen, changes), getattr(trials, changes), atol=1e-4)
    if "step_deg" in recording:
        np.testing.assert_allclose(np.degrees(seen.angle), np.round(np.degrees(seen.angle)), atol=1e-9)


def test_another_rate_keeps_the_motion(trials, model):
    seen = record(trials, World(model, recording={"rate_hz": 100.0}), np.random.default_rng(1))
    assert seen.dt == pytest.approx(0.01)
    time = np.arange(seen.angle.shape[1]) * seen.dt
    np.testing.assert_allclose(
        seen.angle[0], np.interp(time, np.arange(trials.angle.shape[1]) * trials.dt, trials.angle[0]), atol=1e-9
    )


def rows_of(*rows):
    columns = ["world", "hidden", "taken_out", "noise_deg", "signal", "right", "wrong_name", "verdict", "intervals"]
    frame = pd.DataFrame(rows, columns=columns)
    return frame.assign(covered=frame["intervals"] - 1, seconds=2.0)


def test_only_visible_effects_count_and_sets_without_any_are_counted_apart():
    rows = rows_of(
        ("as_assumed", "a", "", 1.0, 2.0, True, False, "effect", 20),
        ("as_assumed", "a", "", 1.0, 2.0, False, True, "effect", 20),
        ("as_assumed", "a", "", 1.0, 0.5, False, False, "adequate", 20),
        ("as_assumed", "none", "", 1.0, 0.0, True, False, "adequate", 20),
        ("outside", "b", "b", 1.0, 0.1, True, False, "unknown", 20),
    )
    summary = summarize(rows).set_index(["world", "hidden"])
    seen = summary.loc[("as_assumed", "effect")]
    assert (seen["sets"], seen["seen"], seen["right_pct"], seen["coverage_pct"]) == (3, 2, 50.0, 95.0)
    assert seen["wrong_name_pct"] == pytest.approx(100 / 3), "a wrong name is one where nothing could be seen, too"
    low, high = binomtest(1, 2).proportion_ci(method="wilson")
    assert (seen["right_low_pct"], seen["right_high_pct"]) == pytest.approx((100 * low, 100 * high))
    assert summary.loc[("as_assumed", "nothing"), "sets"] == 1
    hidden = summary.loc[("outside", "effect")]
    assert (hidden["sets"], hidden["seen"]) == (1, 0) and np.isnan(hidden["right_pct"])


def test_the_picture_has_a_row_for_each_world():
    rows = rows_of(
        *[(world, "a", "", 1.0, 2.0, True, False, "effect", 20) for world in ALLOWED],
        *[(world, "none", "", 1.0, 0.0, True, False, "adequate", 20) for world in ALLOWED if world != "outside"],
    )
    left, right = draw_rates(summarize(rows)).axes
    assert len(left.get_yticks()) == len(ALLOWED) and len(right.get_yticks()) == len(ALLOWED) - 1


def test_the_page_has_a_line_for_each_world_with_its_rates_and_intervals():
    rows = rows_of(
        *[("other_curves", "a", "", 1.0, 2.0, i < 9, i == 9, "effect", 20) for i in range(10)],
        ("other_curves", "none", "", 1.0, 0.0, True, False, "adequate", 20),
    )
    line, nothing = write_page(summarize(rows)).splitlines()[-2:]
    low, high = (100 * x for x in binomtest(9, 10).proportion_ci(method="wilson"))
    assert line.startswith(f"| other muscle curves | 1 | 10 | 10 | 90 ({low:.0f} to {high:.0f}) | 10 (")
    assert line.endswith("| 95.0 of 200 |") and "nothing missing" in nothing
