"""Words of the pages: effects by their titles, terms explained, kinds of verdicts."""

import re
from pathlib import Path
from typing import get_args

import pytest

from myowave.diagnosis.report.numbers import degrees, number
from myowave.diagnosis.report.tell import noise, tell
from myowave.diagnosis.report.templates import described, explained, of_muscles, words
from myowave.diagnosis.search.verdict import Kind
from myowave.settings import read_settings

TITLES = {"joint_damping": "damping of the joint", "fatigue": "muscle fatigue"}


@pytest.mark.parametrize("kind", get_args(Kind))
def test_every_kind_of_verdict_has_words(kind, facts):
    told = tell(facts(verdict=kind))
    assert told["headline"] and told["lead"] and told["label"]
    assert tell(facts(verdict=kind, follows=False, horizon_s=0.5))["label"] == "does not follow the motion"


def test_an_effect_stands_by_its_title_where_it_is_first_named():
    text = str(explained("joint_damping, then fatigue; joint_damping again", TITLES))
    first = "damping of the joint (<code>joint_damping</code>), then muscle fatigue (<code>fatigue</code>)"
    assert text == f"{first}; <code>joint_damping</code> again"


@pytest.mark.parametrize(
    "text", ["base+fatigue", "fatigue.k is 1", "prefatigue", "results/fatigue/x", "fatigue+pennation"]
)
def test_names_of_models_and_parameters_stay_as_they_are(text):
    assert explained(text, TITLES) == text


def test_models_go_by_what_they_have_and_muscles_by_what_people_call_them():
    assert described("base", TITLES) == "muscle model"
    three = described("base+joint_damping+hand_load+fatigue", TITLES)
    assert three == "muscle model with damping of the joint, hand load and muscle fatigue"
    network = described("network, rollout, 1-scale, base+fatigue", TITLES)
    assert network == "network, rollout, 1-scale with muscle fatigue"
    assert described("posture, speed and load", TITLES) == "posture, speed and load", "it has no muscles"
    assert of_muscles("force of BIClong, f0_BIClong") == "force of the long head of the biceps, f0_BIClong"
    assert of_muscles("Biceps and Mine") == "Biceps and Mine", "a name that no table knows stays"


def test_every_muscle_of_the_shipped_arms_has_words():
    settings = read_settings([Path(__file__).parents[2] / "config.yaml"])
    known = {muscle for arm in settings.physics.arms.values() for muscle in arm.muscles}
    assert known and known <= set(words("muscles"))


def test_constants_that_hide_an_effect_go_by_what_they_mean(facts):
    verdict = facts(verdict="undecidable", effects=[], outside_usual_range={"f0_Bi": ["joint_damping"]})
    told = tell({**verdict, "parameters": {"base": {"f0_Bi": {"meaning": "maximum isometric force of Bi"}}}})
    force = "maximum isometric force of the biceps"
    assert told["headline"] == f"These trials cannot tell: {force} is unusual, or there is damping of the joint."
    assert told["todo"] == f"measure {force} on the subject"


def test_terms_are_explained_once_in_a_text_and_text_is_escaped():
    html = str(explained("held out RMSE <b>, held out, log odds of 3-scale", TITLES))
    assert html.count("<abbr") == 4 and "&lt;b&gt;" in html
    assert f'<abbr tabindex="0" title="{words("glossary")["held-out"]}">held out</abbr>' in html
    assert re.sub("<[^>]+>", "", html) == "held out RMSE &lt;b&gt;, held out, log odds of 3-scale"


def test_numbers_in_text_have_two_digits_and_no_power_of_ten():
    assert [degrees(x) for x in (6.4752, 0.00283, 37.9, 120.4)] == ["6.5 deg", "0.0028 deg", "38 deg", "120 deg"]
    assert degrees(9.4e-5) == "under 0.001 deg", "nobody could measure it"
    assert degrees(1.04) == "1.0 deg" and degrees(0.6003) == "0.60 deg"
    assert [number(x) for x in (27174.4, 12.345, None)] == ["27174", "12.3", ""], "and tables have three"


def test_a_noise_that_is_all_floor_is_said_to_be_a_bound(facts):
    assert noise(facts()) == "0.50 deg" and noise(facts(noise_is_bound=True)) == "at most 0.50 deg"


def test_parameters_that_hide_the_same_effect_are_told_together(facts):
    def told(**masked: list[str]) -> str:
        return tell(facts(verdict="undecidable", effects=[], outside_usual_range=masked))["headline"]

    assert told(f0_Bi=["x"]) == "These trials cannot tell: f0_Bi is unusual, or there is x."
    assert "f0_Bi and f0_Tri are unusual, or there is x." in told(f0_Bi=["x"], f0_Tri=["x"])
    assert told(f0_Bi=["a", "b"], l0_Bi=["x"]).endswith("or there is a or b; l0_Bi is unusual, or there is x.")


def test_constants_nobody_expects_are_told_beside_an_effect(facts):
    lead = tell(facts(outside_usual_range={"f0_Bi": ["hand_load"]}))["lead"]
    assert "But f0_Bi is unusual, or there is hand load: these trials would look the same" in lead
    assert "unusual" not in tell(facts())["lead"]


def test_torque_that_is_missing_is_told_with_its_size(facts):
    missing = tell(facts())["missing"]
    assert "The muscle model lacks a torque of 0.50 N m RMS" in missing
    assert "with damping of the joint lacks no more torque than noise of the angle would show, 0.040 N m" in missing
