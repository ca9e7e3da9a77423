"""Words of the pages: effects by their titles, terms explained, kinds of verdicts, what a map of torque looks like."""

import re
from typing import get_args

import numpy as np
import pandas as pd
import pytest

from myowave.diagnosis.misfit.pattern import find_pattern
from myowave.diagnosis.report.numbers import degrees
from myowave.diagnosis.report.tell import tell, tell_masked
from myowave.diagnosis.report.words import GLOSSARY, KINDS, explained, kind_of
from myowave.diagnosis.search.verdict import Kind

TITLES = {"joint_damping": "damping of the joint", "fatigue": "muscles that tire"}


def test_every_kind_of_verdict_has_words():
    assert set(get_args(Kind)) == set(KINDS)
    assert kind_of({"verdict": "effect", "follows": False}).label == "does not follow the motion"


def test_an_effect_stands_by_its_title_where_it_is_first_named():
    text = str(explained("joint_damping, then fatigue; joint_damping again", TITLES))
    first = "damping of the joint (<code>joint_damping</code>), then muscles that tire (<code>fatigue</code>)"
    assert text == f"{first}; <code>joint_damping</code> again"


@pytest.mark.parametrize(
    "text", ["base+fatigue", "fatigue.k is 1", "prefatigue", "results/fatigue/x", "fatigue+pennation"]
)
def test_names_of_models_and_parameters_stay_as_they_are(text):
    assert explained(text, TITLES) == text


def test_terms_are_explained_once_in_a_text_and_text_is_escaped():
    html = str(explained("held out RMSE <b>, held out, delta BIC of 3-scale", TITLES))
    assert html.count("<abbr") == 4 and "&lt;b&gt;" in html
    assert f'<abbr title="{GLOSSARY["held-out"]}">held out</abbr>' in html
    assert re.sub("<[^>]+>", "", html) == "held out RMSE &lt;b&gt;, held out, delta BIC of 3-scale"


def test_numbers_in_text_have_two_digits_and_no_power_of_ten():
    assert [degrees(x) for x in (6.4752, 0.00283, 37.9, 120.4)] == ["6.5 deg", "0.0028 deg", "38 deg", "120 deg"]
    assert degrees(9.4e-5) == "under 0.0001 deg", "nobody could measure it"


def test_a_noise_that_is_all_floor_is_said_to_be_a_bound(facts):
    assert tell(facts()).noise == "0.5 deg" and tell(facts(noise_is_bound=True)).noise == "at most 0.5 deg"


def test_parameters_that_hide_the_same_effect_are_told_together():
    one, two = {"f0_Bi": ["hand_load"]}, {"f0_Bi": ["hand_load"], "f0_Tri": ["hand_load"]}
    assert tell_masked(one) == "f0_Bi is outside its usual range, or hand_load is there"
    assert tell_masked(two) == "f0_Bi and f0_Tri are outside their usual range, or hand_load is there"
    assert tell_masked(one | {"l0_Bi": ["a", "b"]}).endswith("; l0_Bi is outside its usual range, or a or b is there")


@pytest.fixture
def told_of(facts):
    """What is said of a map of missing torque."""

    def told(cells: pd.DataFrame, rms: float) -> str:
        return tell(
            facts(missing_torque={"base": {"rms_Nm": rms, "pattern": find_pattern(cells)}}, model="base")
        ).missing

    return told


def cells(torque) -> pd.DataFrame:
    """A map of 7 by 7 cells with torque(q, v) and scatter of 0.02 N m."""
    q, v = (x.ravel() for x in np.meshgrid(np.linspace(0.3, 1.8, 7), np.linspace(-2.0, 2.1, 7)))
    values = torque(q, v) + 0.02 * np.random.default_rng(1).normal(size=q.size)
    return pd.DataFrame({"angle_rad": q, "velocity_rad_s": v, "torque_Nm": values, "windows": 5})


@pytest.mark.parametrize(
    ("torque", "told"),
    [
        (lambda q, v: -0.9 * v, "opposes the velocity, by 0.9 N m for each rad/s: that is what damping does"),
        (lambda q, v: 0.9 * v, "goes with the velocity, by 0.9 N m"),
        (
            lambda q, v: -0.5 * np.sign(v),
            "opposes the motion, by about 0.5 N m at any speed: that is what dry friction",
        ),
        (lambda q, v: 0.5 * np.sign(v), "goes with the motion"),
        (lambda q, v: 1.5 + 0 * q, "the same everywhere, +1.5 N m: that is what a constant torque"),
        (lambda q, v: -2 * (q - 1), "pulls towards 57 deg, by 2 N m for each rad away from there"),
        (lambda q, v: 2 * (q - 1), "pushes away from 57 deg"),
        (lambda q, v: np.sin(6 * q) * np.cos(4 * v), "follows no simple pattern"),
    ],
)
def test_a_map_of_missing_torque_is_told_by_its_pattern(torque, told, told_of):
    assert told in told_of(cells(torque), 0.5)


def test_between_damping_and_friction_the_map_may_leave_a_choice(told_of):
    both = told_of(cells(lambda q, v: -0.3 * v - 0.35 * np.sign(v)), 0.5)
    assert "does not tell damping" in both
    assert "does not tell damping" not in told_of(cells(lambda q, v: -0.9 * v), 0.5)


def test_a_map_of_noise_or_of_few_cells_is_not_told(told_of):
    assert "no torque is missing" in told_of(cells(lambda q, v: -0.9 * v), 0.0)
    assert "too few cells" in told_of(cells(lambda q, v: -0.9 * v).head(3), 0.5)
