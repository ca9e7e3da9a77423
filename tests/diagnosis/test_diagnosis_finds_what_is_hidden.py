"""From trials to verdict: what is hidden is named, what is not there is not, what cannot be told is said."""

import json
from dataclasses import replace

import numpy as np
import pytest

from myowave.data.simulate import simulate_trials
from myowave.diagnosis.report.facts import verdict_facts
from myowave.diagnosis.report.tables import TABLES, predictions_table
from myowave.diagnosis.report.tell import tell
from myowave.diagnosis.scoring import add_truth
from myowave.diagnosis.search.answer import Answer
from myowave.diagnosis.search.diagnose import diagnose
from myowave.diagnosis.search.weigh import weigh_models
from myowave.settings import DiagnosisSettings, SimulatedDataset

SETTINGS = DiagnosisSettings(starts=2)
KEYS = {"verdict", "effects", "alternatives", "rmse_deg", "parameters", "next_trial"}


FEW = (
    "joint_damping",
    "emg_crosstalk",
    "vmax_change",
    "moment_arm_offset",
    "gravity_tilt",
    "fatigue",
    "hand_load",
    "extra_delay",
    "clock_shift",
    "activation_dynamics",
)


@pytest.fixture(scope="module")
def few(effects):
    """A smaller catalogue, for speed."""
    return {name: effects[name] for name in FEW}


@pytest.fixture(scope="module")
def damped(make_trials, base, few, identify):
    trials = make_trials({"joint_damping": {"c": 1.5}})
    return diagnose(trials, base, few.values(), identify, SETTINGS)


def test_the_hidden_effect_is_named_with_its_value(damped):
    summary = verdict_facts(damped)
    assert summary["verdict"] == "effect" and summary["effects"] == ["joint_damping"]
    found = summary["parameters"]["base+joint_damping"]["joint_damping.c"]
    assert found["value"] == pytest.approx(1.5, abs=4 * found["se"])


def test_adding_the_effect_lowers_both_errors_to_the_noise(damped):
    rmse = verdict_facts(damped)["rmse_deg"]
    assert rmse["base+joint_damping"]["train"] < 1.05 * 0.5 < rmse["base"]["train"]
    assert rmse["base+joint_damping"]["heldout"] < rmse["base"]["heldout"]


def test_the_verdict_has_its_keys_and_survives_json(damped):
    summary = json.loads(json.dumps(add_truth(verdict_facts(damped), None)))
    assert set(summary) >= KEYS
    assert summary["parameters"]["base"]["f0_Bi"]["error_pct"] is None


def test_only_scoring_brings_in_the_truth(damped):
    scored = add_truth(verdict_facts(damped), {"parameters": {"f0_Bi": 200.0}, "effects": ["joint_damping"]})
    entry = scored["parameters"]["base"]["f0_Bi"]
    assert entry["error_pct"] == pytest.approx(100 * (entry["value"] / 200.0 - 1))


def test_every_table_has_rows_for_every_model(damped):
    models = {rung.name for rung in damped.rungs}
    for name, table in TABLES.items():
        assert set(table(damped)["model"]) == models, name
    predictions = predictions_table(damped)
    assert set(predictions["role"]) == {"train", "test"}
    error = np.degrees(predictions["angle_rad"] - predictions["predicted_rad"])
    training = error[(predictions["model"] == "base") & (predictions["role"] == "train")]
    assert np.sqrt((training**2).mean()) == pytest.approx(verdict_facts(damped)["rmse_deg"]["base"]["train"])


def test_a_model_that_somebody_names_has_a_rung_of_its_own(make_trials, base, few, identify):
    """Beside what the search visits: fitted, tried on the held-out trial, in all tables, and without a say."""
    trials = make_trials({"joint_damping": {"c": 1.5}})
    candidates = [few[n] for n in ("joint_damping", "gravity_tilt")]
    both, tilt = base.with_effects(few[n] for n in ("joint_damping", "gravity_tilt")), [few["gravity_tilt"]]
    found = diagnose(trials, base, candidates, identify, SETTINGS, models=[base, base.with_effects(tilt), both])
    summary = verdict_facts(found)
    assert summary["effects"] == ["joint_damping"] and summary["model"] == "base+joint_damping"
    assert [rung.name for rung in found.named] == ["base+gravity_tilt", both.name], "base is on the ladder already"
    rmse = summary["rmse_deg"]
    assert rmse["base+gravity_tilt"]["train"] < rmse["base"]["train"]
    left = {rung.name: rung.fit.objective for rung in found.tried}
    assert left[both.name] <= left["base+joint_damping"] * (1 + 1e-6) < left["base+gravity_tilt"]
    assert set(summary["parameters"]["base+gravity_tilt"]) == {*identify, "gravity_tilt.phi"}
    ladder = TABLES["ladder"](found).set_index("model")
    assert ladder["named"].to_dict() == {name: name not in ("base", "base+joint_damping") for name in rmse}
    assert ladder["heldout_rmse_deg"].notna().all()


def test_the_test_trial_takes_no_part_in_any_decision(make_trials, base, few, identify):
    """Noise is estimated from the trials, too: from those that train."""
    candidates = [few[n] for n in ("joint_damping", "gravity_tilt", "hand_load")]
    one = make_trials({"joint_damping": {"c": 1.0}})
    other = replace(one, angle=one.angle.copy(), emg=one.emg.copy())
    random, (test,) = np.random.default_rng(1), one.index(one.test)
    other.angle[test] = 0.9 + 0.3 * random.standard_normal(other.angle[test].shape)
    other.emg[test] = random.random(other.emg[test].shape)
    seen, unseen = (diagnose(trials, base, candidates, identify, SETTINGS) for trials in (one, other))
    assert seen.verdict.kind == unseen.verdict.kind and seen.noise_deg == unseen.noise_deg
    assert seen.verdict.answer.probabilities == unseen.verdict.answer.probabilities
    assert seen.draft.formula == unseen.draft.formula and seen.proposals == unseen.proposals
    for ranked, again in zip(seen.verdict.ladder.rankings, unseen.verdict.ladder.rankings, strict=True):
        assert [weighed(c) for c in ranked] == [weighed(c) for c in again]
    for rung, again in zip(seen.rungs, unseen.rungs, strict=True):
        np.testing.assert_array_equal(rung.fit.values, again.fit.values)
        assert rung.fit.standard_errors() == again.fit.standard_errors()
        assert rung.missing.rms == again.missing.rms
    assert seen.rungs[-1].heldout.rmse < 0.1 * unseen.rungs[-1].heldout.rmse, "only held-out scores are of that trial"


def weighed(candidate):
    return candidate.name, candidate.log_odds, candidate.detectable, candidate.score.visible


def test_clean_trials_are_adequate(make_trials, base, few, identify):
    found = diagnose(make_trials(), base, few.values(), identify, SETTINGS)
    assert found.verdict.kind == "adequate" and found.verdict.causes == ()
    assert "hand_load" in found.verdict.absorbed


def test_two_effects_are_both_found(make_fit, few):
    fit = make_fit({"joint_damping": {"c": 1.0}, "emg_crosstalk": {"x": 0.15}})
    assert set(weigh_models(fit, few.values()).best.effects) == {"joint_damping", "emg_crosstalk"}


def test_what_the_catalogue_lacks_is_called_unknown_and_drafted(make_trials, base, few, identify):
    trials = make_trials({"joint_damping": {"c": 1.5}})
    unfit = [few[n] for n in ("hand_load", "gravity_tilt", "fatigue")]
    found = diagnose(trials, base, unfit, identify, SETTINGS)
    assert found.verdict.kind == "unknown" and verdict_facts(found)["effects"] == []
    assert "qdot" in found.draft.formula


def test_what_is_taken_for_noise_where_no_model_is_right_is_not_called_noise(make_trials, base, few, identify, facts):
    trials = make_trials({"clock_drift": {"d": -0.02}}, noise_deg=0.24)
    found = diagnose(trials, base, [few["hand_load"]], identify, SETTINGS)
    assert found.verdict.kind == "unknown" and np.degrees(found.verdict.answer.angle_noise) > 0.5
    assert found.noise_deg == pytest.approx(0.24, abs=0.03)
    lead = tell(facts() | add_truth(verdict_facts(found), None))["lead"]
    assert f"Judged without a model, the noise of the angle is {found.noise_deg:.2g} deg." in lead
    assert "at most 0.050 deg, or it was filtered." in tell(smooth(facts(verdict="unknown", effects=[])))["lead"]
    assert "The noise of the angle is at most 0.050 deg." in tell(smooth(facts()))["lead"]


def smooth(facts):
    """An angle without noise that shows."""
    errors = {name: {**one, "noise": 0.05} for name, one in facts["rmse_deg"].items()}
    return {**facts, "noise_is_bound": True, "rmse_deg": errors}


def test_no_torque_is_drafted_for_what_goes_with_muscle_curves(make_trials, base, identify, monkeypatch):
    trials = make_trials({"joint_damping": {"c": 1.5}})
    assert diagnose(trials, base, [], identify, SETTINGS).draft.formula != "0"
    monkeypatch.setattr(Answer, "of_shapes", True)
    assert diagnose(trials, base, [], identify, SETTINGS).draft.formula == "0"


def test_a_class_comes_with_the_trial_that_would_separate_it(make_trials, base, effects, identify):
    trials = make_trials({"joint_damping": {"c": 0.8}}, noise_deg=1.0)
    candidates = [effects[name] for name in ("joint_damping", "muscle_damping", "vmax_change", "hand_load")]
    found = diagnose(trials, base, candidates, identify, SETTINGS)
    assert found.verdict.kind == "class"
    assert {"joint_damping", "muscle_damping"} <= set(found.verdict.named[0])
    assert found.proposals


@pytest.mark.parametrize("known", [{}, {"4": {"load": 1.0}, "5": {"load": 1.0}}])
def test_a_load_that_nobody_noted_is_found_where_a_known_one_was_held_in_some_trials(base, few, known):
    """In one condition it is the same motion as weaker muscles; the trial to record next is one with a known load."""
    hidden = {"hand_load": {"m": 0.5}}
    dataset = SimulatedDataset(
        kind="simulated", samples=200, test=("3",), seed=3, angle_noise_deg=0.5, conditions=known, hidden_effect=hidden
    )
    trials, _ = simulate_trials("loads", dataset, base, few)
    candidates = [few[name] for name in ("hand_load", "joint_damping", "gravity_tilt")]
    found = diagnose(trials, base, candidates, dataset.identify, SETTINGS)
    summary = verdict_facts(found)
    if not known:
        assert summary["verdict"] == "undecidable" and summary["effects"] == []
        assert set(found.verdict.absorbed["hand_load"]) == {"f0_Bi", "f0_Tri"}
        assert summary["next_trial"]["trial"] == "known load of 1 kg"
        return
    assert summary["verdict"] == "effect" and summary["effects"] == ["hand_load"] and not found.verdict.absorbed
    estimate = summary["parameters"]["base+hand_load"]["hand_load.m"]
    assert estimate["value"] == pytest.approx(0.5, abs=4 * estimate["se"]) and estimate["se"] < 0.1
    assert summary["parameters"]["base+hand_load"]["f0_Bi"]["value"] == pytest.approx(300.0, rel=0.05)
