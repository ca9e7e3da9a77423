"""Grades, the table, and an answer where the truth is known because it is simulated here."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml

from myowave.data.trials import Trials
from myowave.diagnosis.causes import SILENT
from myowave.diagnosis.changed.ask import Answered, Change, Family
from myowave.physics.model import Model
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation
from myowave.settings import DiagnosisSettings, Identify
from myowave.settings.data import Changed
from studies.reality import answer as answers_of
from studies.reality.answer import answer_case, as_asked
from studies.reality.figures import draw_reality
from studies.reality.page import said, write_page
from studies.reality.score import COLUMNS, GRADES, RIVALS, grade, score_cases
from studies.reality.settings import Case

STUDY = Path(__file__).parents[1]
CASES = yaml.safe_load((STUDY / "settings.yaml").read_text())["reality"]["cases"]
TRUTH = yaml.safe_load((STUDY / "truth.yaml").read_text())


def answer(verdict, names=(), classes=(), masked=()):
    return {
        "verdict": verdict,
        "names": list(names),
        "class": [list(c) for c in classes],
        "sizes": {"load_friction.mu": [0.41, 0.38, 0.44]},
        "nearest": [],
        "masked": list(masked),
        "error_before": 20.0,
        "error_after": 5.0,
        **dict.fromkeys(RIVALS, ["joint_damping"]),
    }


TWO = {"names": [["a"], ["b", "c"]]}


@pytest.mark.parametrize(
    ("given", "truth", "expected"),
    [
        (answer("effect", ["a", "c"]), TWO, "named"),
        (answer("partial", ["a", "b"]), TWO, "named"),
        (answer("class", ["a", "d"], [["d", "b"]]), TWO, "class"),
        (answer("class", ["a", "d"], [["d", "e"]]), TWO, "wrong"),
        (answer("partial", ["a", "b"], [["a", "outside"]]), TWO, "class"),
        (answer("partial", ["a", "d"], [["d", "outside"]]), TWO, "wrong"),
        (answer("partial", ["a"]), TWO, "honest"),
        (answer("effect", ["a"]), TWO, "wrong"),
        (answer("effect", ["a"], masked=["c", "d"]), TWO, "honest"),
        (answer("effect", ["a"], masked=["d"]), TWO, "wrong"),
        (answer("partial", ["d"]), TWO, "wrong"),
        (answer("unknown"), TWO, "honest"),
        (answer("adequate"), TWO, "silent"),
        (answer("unknown"), {"outside": True}, "honest"),
        (answer("effect", ["a"], masked=["a"]), {"names": [["a"]], "outside": True}, "wrong"),
        (answer("partial", ["a"]), {"names": [["a"]], "outside": True}, "honest"),
        (answer("adequate"), {"nothing": True}, "named"),
        (answer("effect", ["a"]), {"nothing": True}, "wrong"),
        (answer("unknown"), {"nothing": True}, "wrong"),
    ],
)
def test_a_grade_follows_from_what_is_said_and_what_is_true(given, truth, expected):
    assert grade(given, truth) == expected and expected in GRADES


def test_each_case_has_a_truth_which_the_scorer_alone_reads(effects):
    assert set(CASES) == set(TRUTH)
    told = {name for truth in TRUTH.values() for one in truth.get("names", []) for name in one}
    assert told <= {*effects, SILENT}
    rules = (STUDY / "Snakefile").read_text().split("\nrule ")
    assert [rule.split(":")[0] for rule in rules if "truth.yaml" in rule] == ["score_cases"]


def test_the_table_and_the_picture_have_a_row_for_each_case():
    driven = answer("effect", ["load_friction", "coulomb_friction"])
    answers = {name: answer("unknown") for name in CASES} | {"servo_driven": driven}
    answers["person_heavier"] |= dict.fromkeys(["error_before", "error_after"])
    answers["servo_drops"]["error_before"] = float("inf")
    table = score_cases(CASES, answers, TRUTH)
    assert list(table.columns) == COLUMNS and len(table) == len(CASES)
    row = table.set_index("withheld").loc[CASES["servo_driven"]["withheld"]]
    assert row["size_true"] == 0.4 and row["size_low"] < 0.4 < row["size_high"] and row["grade"] == "named"
    assert row["lasso"] == "joint_damping"
    texts = [" ".join(text.get_text().split()) for axes in draw_reality(table).axes for text in axes.texts]
    for case in CASES.values():
        assert any(case["withheld"] in text for text in texts)
    assert "friction that grows with the load, dry friction of the joint" in texts
    page = write_page(table)
    assert "servo that is off (measured) | friction of the gears | something unknown |  | runs away → 5 |" in page
    assert "half of the trials | something unknown |  |  | left open" in page
    assert "dry friction of the joint | 0.41, 0.38 to 0.44 (0.4) | 20 → 5 | right | joint damping" in page
    assert f"Of {len(CASES)} answers 1 right, none right in part, " in page
    table.loc[0, "lasso"] = "a, b, c, d"
    assert "| 4 effects |" in write_page(table), "the table has their names"


def test_a_class_is_told_with_the_number_of_others():
    row = {"verdict": "partial", "names": "joint_damping", "class": "joint_damping or coulomb_friction", "masked": ""}
    assert said(row) == "damping of the joint (or 1 other) and something else"
    row["class"] += " or outside"
    assert said(row) == "damping of the joint (or 1 other) or something like it, and something else"
    row |= {"names": "joint_damping, hand_load", "class": "joint_damping or outside; hand_load or outside"}
    assert "nobody noted or something like them, and something else" in said(row), "once for all"
    row["names"] = "joint_damping"
    row |= {"verdict": "effect", "class": "", "masked": "hand_load"}
    assert said(row) == "damping of the joint and perhaps one of 1 (unusual constants)"
    row = {"verdict": "unknown", "names": "", "class": "", "nearest": "joint_damping"}
    assert said(row) == "something unknown (nearest: damping of the joint)"


def test_a_machine_whose_friction_is_withheld_is_answered_with_it_and_its_size(effects):
    dt, samples, noise = 0.01, 300, np.radians(0.1)
    machine = Model((), {"mass": 1.0, "com": 0.2, "inertia": 0.05, "grip": 0.2})
    true = machine.with_effects([effects["coulomb_friction"]])
    emg = torch.zeros(4, samples, 0, dtype=torch.float64)
    start = torch.tensor([1.5, 1.0, 0.7, 1.2], dtype=torch.float64)
    angle = simulate(Simulation(true, {"coulomb_friction.tau": 0.05}, emg, dt, substeps=8), start).angle.numpy()
    angle = angle + noise * np.random.default_rng(1).standard_normal(angle.shape)
    trials = Trials("swings", dt, ("a", "b", "c", "d"), (), emg.numpy(), angle, (samples,) * 4, ("d",))
    few = {n: effects[n] for n in ("joint_damping", "coulomb_friction", "quadratic_drag", "emg_gain")}
    case = Case(dataset="swings", kind="simulated", system="a swing", withheld="friction", leave_out=("emg_gain",))
    identify = {"inertia": Identify(start_spread=0.2)}
    found = answer_case(case, trials, machine, few, identify, DiagnosisSettings(starts=2))
    assert found["verdict"] == "effect" and found["names"] == ["coulomb_friction"]
    value, low, high = found["sizes"]["coulomb_friction.tau"]
    assert value == pytest.approx(0.05, rel=0.03) and low < value < high < 0.06
    assert found["error_after"] < 0.15 < 3 < found["error_before"]
    assert "coulomb_friction" in found["lasso"]


def test_what_is_withheld_goes_and_what_is_put_in_comes_from_the_samples_before():
    emg, angle = np.arange(40.0).reshape(2, 10, 2) / 100, np.zeros((2, 10))
    emg[0, 8:] = emg[0, 7]  # the first trial is shorter, and held
    trials = Trials(
        "x", 0.01, ("a", "b"), ("emg_x", "emg_y"), emg, angle, (8, 10), (), {"a": {"tilt": 0.1, "load": 1.0}}
    )
    trials = replace(trials, signals={"tilt_rad": angle}, over_time={"tilt": "tilt_rad"})
    put = {"trials": ["a"], "channels": ["emg_y"], "gain": 0.5, "delay_s": 0.02}
    case = Case(dataset="x", kind="measured", system="a", withheld="b", told={"tilt": 0.0}, put_in=put)
    asked = as_asked(trials, case)
    assert asked.conditions == {"a": {"tilt": 0.0, "load": 1.0}, "b": {"tilt": 0.0}} and not asked.over_time
    np.testing.assert_array_equal(asked.emg[1], emg[1])
    np.testing.assert_array_equal(asked.emg[0, :, 0], emg[0, :, 0])
    np.testing.assert_array_equal(asked.emg[0, 2:8, 1], 0.5 * emg[0, :6, 1])
    np.testing.assert_array_equal(asked.emg[0, 7:, 1], asked.emg[0, 7, 1])


@pytest.mark.parametrize(
    ("weight", "unchanged", "verdict"),
    [(0.7, 0.0, "class"), (0.99, 0.0, "effect"), (0.99, 0.9, "adequate"), (0.99, 0.2, "undecidable")],
)
def test_what_changed_is_asked_with_what_is_told_and_the_likeliest_is_named(
    weight, unchanged, verdict, trials, model, effects, monkeypatch
):
    changed = {"reference": ["1"], "against": ["2", "3"], "electrodes_stayed": True}
    case = Case(dataset="x", kind="measured", system="a", withheld="b", told={"load": 1.25}, changed=changed)

    def what_changed(trials, base, effects, groups, scatter, report):
        assert groups == Changed.model_validate(changed)
        assert set(map(str, trials.conditions.values())) == {"{'load': 1.25}"}
        change = Change("hand_load", "a load", ("hand_load.m",), "", "kg", -5.0, 5.0, 0.3, 1.2, (1.0, 1.4))
        weighed = replace(change, probability=weight), replace(change, effect="emg_gain", probability=1 - weight)
        family = Family(tuple(replace(c, probability=(1 - unchanged) * c.probability) for c in weighed), unchanged)
        return Answered(groups, family, None, None, (), {}, ())

    monkeypatch.setattr(answers_of, "what_changed", what_changed)
    found = answer_case(case, trials, model, effects, {}, DiagnosisSettings())
    named = verdict in ("class", "effect")
    assert found["verdict"] == verdict and found["names"] == ["hand_load"] * named
    assert found["class"] == [["hand_load", "emg_gain"]] * (verdict == "class")
    assert found["nearest"] == ["hand_load"] * (verdict == "undecidable"), "what nobody can tell has a likeliest"
    assert found["sizes"].get("hand_load.m", []) == [1.2, 1.0, 1.4] * named
