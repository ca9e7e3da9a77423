"""The study makes the worlds that it names, hides what it says, and counts what answers are worth as promised."""

import json
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import torch

from myowave.data.simulate import simulate_trials
from myowave.diagnosis.causes import OWN_SHAPES
from myowave.diagnosis.scoring import grade
from myowave.settings import DiagnosisSettings, Scatter
from studies.shared import GRADES
from studies.verdicts import __main__, mujoco_arm, simulator
from studies.verdicts.cases import SETS, Case, hidden_values, list_cases, make_trials
from studies.verdicts.figures import draw_reliability
from studies.verdicts.judge import Judged, judge_set
from studies.verdicts.sets import draw_set, read_set, write_set
from studies.verdicts.summary import reliability, write_page
from studies.verdicts.worlds import (
    FINER,
    HELD_BACK,
    WORLDS,
    World,
    draw_curves,
    draw_sensors,
    draw_world,
    record,
    sample_and_hold,
)

SCATTER = {"slack": Scatter(relative=0.03), "delay": Scatter(absolute=0.007)}


def a_case(world="as_assumed", hidden=None, noise_deg=0.0, out=()):
    return Case(world, hidden or {}, out, 1, 3, 1.0, noise_deg)


def test_every_hidden_value_is_within_its_bounds_and_not_zero(model, effects):
    for effect in effects.values():
        for strength, turn in ((0.25, 0), (1.0, 1)):
            for name, value in hidden_values(model, effect, strength, turn).items():
                parameter = model.with_effects([effect]).parameters_of(effect)[f"{effect.name}.{name}"]
                assert parameter.low <= value <= parameter.high and value != 0.0


def test_every_world_has_its_sets_and_no_two_are_alike(model, effects):
    cases = list(list_cases(model, effects, 2))
    assert set(SETS) == set(WORLDS) and len({case.name for case in cases}) == len(cases)
    for world, (hidden, clean) in SETS.items():
        some = [case for case in cases if case.world == world]
        assert sum(bool(case.hidden) for case in some) == hidden and len(some) == hidden + clean
    assert all(set(c.taken_out) <= set(c.hidden) and (c.world == "outside") <= bool(c.taken_out) for c in cases)
    assert [case.label for case in cases] != [case.label for case in list_cases(model, effects, 1)]
    assert a_case().seed != Case("as_assumed", {}, (), 2, 3, 1.0, 0.0).seed


def test_what_the_recorder_reports_holds_nothing_of_what_was_drawn(model, effects, dataset):
    case = a_case("other_constants", {"joint_damping": {"c": 0.5}}, noise_deg=1.0)
    world = draw_world(case.world, model, SCATTER, case.random)
    seen, quiet = make_trials(case, world, dataset, effects)
    assert set(world.constants) == {"slack_Bi", "slack_Tri", "delay_Bi", "delay_Tri"}
    assert seen.constants == {} and world.constants["slack_Bi"] != model.defaults["slack_Bi"]
    assert np.degrees((seen.angle - quiet.angle).std()) == pytest.approx(1.0, rel=0.1)


def test_a_set_says_what_shows_and_what_is_true_of_it(model, effects, settings, dataset, tmp_path):
    """A strong effect shows, unless the noise is as large as the motion; out of the catalogue it is no true name."""
    longer = dataset.model_copy(update={"samples": 250})
    out = draw_set(
        a_case("outside", {"joint_damping": {"c": 2.0}}, 0.5, ("joint_damping",)),
        longer,
        settings.diagnosis,
        model,
        effects,
    )
    assert out.wanted == out.true == {"outside"}
    assert "joint_damping" not in {e.name for e in out.known_to(effects)}
    curves = replace(out, case=replace(out.case, taken_out=("thelen_curves",)), signals={"thelen_curves": 2.0})
    assert grade("effect", curves.graded_as((("millard_curves",),)), curves.true, curves.wanted) == "right"
    hidden = replace(curves, case=a_case(hidden={"thelen_curves": {}}))
    for name, of in (("thelen_curves", "right"), (OWN_SHAPES, "class"), ("millard_curves", "wrong")):
        assert grade("effect", hidden.graded_as(((name,),)), hidden.true, hidden.wanted) == of
    weak = draw_set(
        a_case(hidden={"joint_damping": {"c": 0.02}}, noise_deg=3.0), longer, settings.diagnosis, model, effects
    )
    assert weak.wanted == set() and weak.true == {"joint_damping"}
    write_set(weak, tmp_path / "set.pkl")
    weak = read_set(tmp_path / "set.pkl")
    fit = weak.fit(model)
    assert np.degrees(fit.rmse()) == pytest.approx(3.0, rel=0.05)  # the noise
    for name, of in (("joint_damping", "right"), ("fatigue", "wrong")):
        intervals = {"f0_Bi": (0.0, 1e9), "joint_damping.c": (1.0, 2.0)}
        said = Judged("effect", ((name,),), {name: 0.97}, (name,), intervals)
        row = judge_set(weak, "fixed", fit, effects, lambda fit, effects, said=said: said)
        assert row["grade"] == of and row["wrong_name"] == (of == "wrong")
        assert (row["intervals"], row["held"]) == ((2, 1) if of == "right" else (0, 0))
        assert reliability(pd.DataFrame([row]))[-1][2:4] == (1, int(of == "right"))


def test_each_set_is_drawn_and_judged_once_and_counted_by_judge(model, effects, dataset, monkeypatch, tmp_path, capsys):
    """By the command, with two cases of which no EMG keeps one in range, and an answer that is made up."""
    case = a_case(noise_deg=1.0)
    cases = [case, replace(case, turn=4)]
    drawn = draw_set(case, dataset, DiagnosisSettings(starts=1), model, effects)
    calls = []

    def row_of(drawn, judge, fit, effects):
        calls.append(judge)
        return {**rows_of(judge, "right", world=drawn.case.world)[0], "verdict": "effect", "named": "a"}

    monkeypatch.setattr(__main__, "list_cases", lambda base, effects, draw: cases)
    monkeypatch.setattr(__main__, "draw_set", lambda case, *rest: drawn if case.turn == 3 else None)
    monkeypatch.setattr(__main__, "judge_set", row_of)
    for more in (["--draw", "1"], ["--draw", "1", "--judge", "other"], ["--judge", "other", "--again"]):
        monkeypatch.setattr(sys, "argv", ["verdicts", str(tmp_path), *more])
        __main__.main()
    assert calls == ["evidence", "other", "other"]
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "1-as_assumed-clean-003.evidence.json", "1-as_assumed-clean-003.other.json", "1-as_assumed-clean-003.pkl",
        "1-as_assumed-clean-004.pkl",
    ]  # fmt: skip
    assert "| all |  | 1 | 1 | 0 | 0 | 0 | 0 |" in capsys.readouterr().out


def test_without_mujoco_a_draw_says_how_to_install_it(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(__main__, "find_spec", lambda name: None)
    monkeypatch.setattr(sys, "argv", ["verdicts", str(tmp_path), "--draw", "1", "--only", "*-mujoco-000"])
    with pytest.raises(SystemExit):
        __main__.main()
    assert "pip install --no-deps -r studies/verdicts/requirements.txt" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_new_page_keeps_what_earlier_draws_said_and_what_is_written_by_hand(monkeypatch, tmp_path):
    docs, sets = tmp_path / "docs", tmp_path / "sets"
    for folder in (docs, sets):
        folder.mkdir()
    old, new = ({**row, "draw": draw} for draw, row in zip((5, 6), rows_of("evidence", "wrong", "right"), strict=True))
    pd.DataFrame([old]).to_csv(docs / "study_cases.csv", index=False)
    (docs / "study.md").write_text("# Old\n\n## Where it is wrong\nThere.\n")
    (sets / "a.pkl").touch()
    (sets / "a.evidence.json").write_text(json.dumps(new))
    for _ in range(2):  # again, and no arm counts twice
        monkeypatch.setattr(sys, "argv", ["verdicts", str(sets), "--page", str(docs)])
        __main__.main()
        page = (docs / "study.md").read_text()
        assert "Of 1 simulated arms" in page and "All 2 arms of all draws" in page and "# Old" not in page
        assert page.endswith("\n\n## Where it is wrong\nThere.\n") and page.count("## Where it is wrong") == 1
        draws = [pd.read_csv(docs / f"study_{name}.csv")["draw"].tolist() for name in ("before", "cases")]
        assert draws == [[5], [6]]


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


def test_a_sample_and_hold_makes_muscles_later_by_what_the_truth_says(model, effects, dataset):
    def moved(**world):
        return make_trials(a_case(), World(model, **world), dataset, effects)[1].angle

    def off(share):
        late = {n: v + share * dataset.dt_s for n, v in model.defaults.items() if n.startswith("delay")}
        return np.nanstd(moved(constants=late) - held)

    held = moved(sample_and_hold=True)
    assert off(HELD_BACK) < 0.3 * min(off(HELD_BACK - 0.1), off(HELD_BACK + 0.1))


@pytest.mark.parametrize("sensor", [s for s in draw_sensors(np.random.default_rng(0)) if "rate_hz" not in s], ids=str)
def test_a_recorder_changes_what_it_says_and_no_more(trials, model, sensor):
    seen = record(trials, World(model, recording=sensor), 0.0, np.random.default_rng(1))
    of_emg = {name for name in sensor if name.startswith(("emg", "gain"))}
    for what, changed in (("emg", bool(of_emg)), ("angle", bool(set(sensor) - of_emg))):
        assert np.allclose(getattr(seen, what), getattr(trials, what), atol=1e-5) != changed, what
    if "step_deg" in sensor:
        steps = np.degrees(seen.angle) / sensor["step_deg"]
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    if "gain_pct" in sensor:
        assert np.allclose(seen.emg[1:], trials.emg[1:])


def test_coloured_noise_has_the_size_and_memory_that_it_says(trials, model):
    long = type(trials)("x", 0.03, ("1",), ("emg_a",), np.zeros((1, 40_000, 1)), np.zeros((1, 40_000)), (40_000,))
    seen = record(long, World(model, recording={"ar_deg": 1.0, "ar_s": 0.3}), 0.0, np.random.default_rng(1)).angle[0]
    assert np.degrees(seen.std()) == pytest.approx(1.0, rel=0.1)
    assert np.corrcoef(seen[:-10], seen[10:])[0, 1] == pytest.approx(np.exp(-1), abs=0.08)


def test_another_rate_keeps_the_motion(trials, model):
    seen = record(trials, World(model, recording={"rate_hz": 100.0}), 0.0, np.random.default_rng(1))
    assert seen.dt == pytest.approx(0.01)
    time = np.arange(seen.angle.shape[1]) * seen.dt
    np.testing.assert_allclose(
        seen.angle[0], np.interp(time, np.arange(trials.angle.shape[1]) * trials.dt, trials.angle[0]), atol=1e-9
    )


@pytest.mark.parametrize("of", [simulator, pytest.param(mujoco_arm, marks=pytest.mark.mujoco)])
def test_another_simulator_agrees_with_this_one_about_the_paper_s_arm(model, dataset, of):
    """With its parameters nearest to the paper's curves the motion is that of this project within a few degrees, and
    not exactly: the formulas are others."""
    short = dataset.model_copy(update={"trials": 2, "samples": 120, "test": ("2",)})
    ours, _ = simulate_trials("same", short, model, {})
    middle = SimpleNamespace(
        normal=lambda mean, deviation, size=(): np.full(size, mean),
        uniform=lambda low, high: (low + high) / 2,
        standard_normal=lambda size: np.zeros(size),
    )
    arm = of.Arm.draw(middle)
    seen = arm.moved({}, ours.emg, ours.dt, short.start_rad)
    assert 0.01 < np.degrees(np.abs(seen - ours.angle).mean()) < 8.0
    damped = arm.moved({"joint_damping.c": 1.0}, ours.emg, ours.dt, short.start_rad)
    lag = arm.moved({"observation_lag.tau": 0.1}, ours.emg, ours.dt, short.start_rad)
    assert np.abs(damped - seen).max() > 0.01
    np.testing.assert_allclose(lag[:, :-1] + 0.1 * np.gradient(lag, ours.dt, axis=1)[:, :-1], seen[:, :-1], atol=0.02)


@pytest.mark.mujoco
def test_mujoco_hides_what_the_effects_say():
    """Accelerations from rest, the muscles silent, are those of the formulas; dry friction holds the arm."""
    arm, start, step = mujoco_arm.Arm.draw(np.random.default_rng(0)), 0.8, 1e-3
    weight = simulator.GRAVITY * arm.mass

    def accelerates(name="", value=0.0):
        angle = arm.moved({name: value}, np.zeros((1, 4, 2)), step, start)[0]
        return (angle[2] - 2 * angle[1] + angle[0]) / step**2

    still = -weight * np.sin(start) / arm.mass
    assert accelerates() == pytest.approx(still, rel=0.01)
    assert accelerates("gravity_tilt.phi", 0.3) == pytest.approx(-weight * np.sin(start + 0.3) / arm.mass, rel=0.01)
    assert accelerates("forearm_inertia.r", 0.5) == pytest.approx(still / 1.5, rel=0.01)
    assert accelerates("joint_stiffness.k", 3.0) == pytest.approx(still - 3.0 * (start - 1.0) / arm.mass, rel=0.01)
    assert accelerates("constant_torque.tau", 2.0) == pytest.approx(still + 2.0 / arm.mass, rel=0.01)
    held = arm.moved({"coulomb_friction.tau": 20.0}, np.zeros((1, 500, 2)), step, start)
    np.testing.assert_allclose(held, start, atol=np.radians(0.5))


def rows_of(judge, *grades, world="other_curves", shows="a"):
    return [
        {
            "draw": i % 2, "world": world, "hidden": "a", "taken_out": "", "recording": "", "shows": shows,
            "judge": judge, "grade": grade, "wrong_name": grade == "wrong", "wrong_emg_noise": False,
            "probabilities": "a=0.97 b=0.6", "true": "a", "nothing_missing": np.nan, "intervals": 20, "held": 19,
            "seconds": 2.0,
        }
        for i, grade in enumerate(grades)
    ]  # fmt: skip


def test_the_page_counts_answers_names_and_intervals():
    before = pd.DataFrame(rows_of("one", "right", "silent", "wrong"))
    page = write_page(pd.DataFrame(rows_of("one", *GRADES)), before, "1 May 2030", "abc")
    assert "| other muscle curves | an effect shows | 5 | 1 | 1 | 1 | 1 | 1 |" in page
    assert "| 2 of 5: 40 (" in page and "| a wrong name | 1 of 5: 20 (" in page and "95 of 100: 95 (" in page
    first = "Of 5 simulated arms of 1 kinds 1 were judged right, 1 in a class, 1 were left open, 1 missed and 1 wrong"
    assert page.partition("\n\n")[2].startswith(first) and "1 May 2030, at commit abc" in page
    assert "All 8 arms of all draws" in page and "wrong in 2 of 8: 25 (" in page
    assert "at most three in 3 of 8" in page and "at 95 % or more true in 8 of 8: 100 (" in page
    assert "| 0.6 to 0.7 | 0 of 5: 0 (" in page and "| 0.95 to 1 | 5 of 5: 100 (" in page


def test_the_picture_shows_all_worlds():
    rows = pd.DataFrame([*rows_of("one", *GRADES), *rows_of("one", *GRADES, world="outside")])
    _, right = draw_reliability(rows).axes
    labels = [label.get_text() for label in right.get_yticklabels()]
    assert labels == ["effect not in the catalogue", "other muscle curves"]
