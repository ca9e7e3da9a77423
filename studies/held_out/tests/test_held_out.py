"""Questions asked of held-out trials: what trains and what tests, paired differences, and the page."""

from datetime import date
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from myowave.settings import Baseline
from studies.held_out.answers import answer, differences, write_page
from studies.held_out.figures import draw_answers
from studies.held_out.score import score_baselines, split_trials
from studies.held_out.settings import HeldOut
from studies.shared import read_section

ROOT = Path(__file__).parents[3]


@pytest.fixture
def section():
    return yaml.safe_load((ROOT / "studies/held_out/settings.yaml").read_text(encoding="utf-8"))["held_out"]


def test_the_shipped_questions_are_about_trials_that_are_there_and_each_is_asked_of_three(section, settings):
    held_out = read_section(HeldOut, "held_out", section, settings)
    tested = {
        question: {(name, t) for name, split in of.items() for t in split.test}
        for question, of in held_out.questions.items()
    }
    assert len(tested.pop("unseen_lean")) == 1, "the one trial that leans more than all others"
    assert all(len(draws) >= 3 for draws in tested.values())


FAULTS = {
    "trains and tests": (("train", ["load2.75_1"]), "load2.75_1 would train and test"),
    "no such trial": (("train", ["load9_1"]), "load9_1"),
    "nothing to test": (("test", []), "not empty"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_split_that_cannot_be_is_a_message(section, settings, fault):
    (key, value), says = FAULTS[fault]
    split = {"train": ["load2.75_2"], "test": ["load2.75_1"], key: value}
    with pytest.raises(ValueError, match=says):
        read_section(HeldOut, "held_out", section | {"questions": {"few_trials": {"a": split}}}, settings)


def test_inputs_that_no_method_has_are_a_message(section, settings):
    with pytest.raises(ValueError, match=r"held_out\.inputs\.odd\.emg_ovr"):
        read_section(HeldOut, "held_out", section | {"inputs": {"odd": {"emg_ovr": "weight"}}}, settings)


def test_each_test_trial_is_scored_by_itself_and_by_nothing_but_the_training_trials(trials, model):
    split = split_trials(trials, ["2"], ["1", "3"])
    assert split.names == ("2", "1", "3") and split.train == ("2",)
    rows = score_baselines({"line": Baseline(kind="ridge")}, {}, split, model, (0, 1))
    assert len(rows) == 4 and set(rows["trial"]) == {"1", "3"} and set(rows["method"]) == {"line"}
    assert rows.groupby("trial")["test_r2"].nunique().eq(1).all(), "ridge has no chance in it"


@pytest.fixture
def scores() -> pd.DataFrame:
    """A rival and a network; EMG over weight helps both on another load, by 0.2 and in each trial a little more."""
    rows = []
    for question, split, better in (("like_the_others", "first", 0.0), ("unseen_load", "light to heavy", 0.2)):
        for i, trial in enumerate("abc"):
            for seed, scatter in ((0, -0.01), (1, 0.01)):
                for method, scales, r2 in (("cnn", 1, 0.9), ("net", 1, 0.7), ("net", 3, 0.7)):
                    for inputs, gain in (("told", 0.0), ("weighed", better + 0.01 * i * bool(better))):
                        rows.append(
                            (question, split, trial, method, scales, inputs, seed, r2 - better + gain + scatter)
                        )
    names = ["question", "split", "trial", "method", "scales", "inputs", "seed", "test_r2"]
    return pd.DataFrame(rows, columns=names).assign(test_rmse_deg=1.0)


def test_differences_are_paired_and_their_intervals_are_over_trials_not_seeds(scores):
    found = differences(scores, "net").set_index(["question", "change"])
    none = found.loc["like_the_others", "3 scales for 1, load told"]
    assert none["gain"] == pytest.approx(0) and none["low"] == pytest.approx(0) and none["draws"] == 3
    gain = found.loc["unseen_load", "EMG over weight, net"]
    # Of 0.20, 0.21, 0.22: t of 2 degrees of freedom is 4.303.
    assert gain["gain"] == pytest.approx(0.21)
    assert gain["high"] - gain["gain"] == pytest.approx(4.303 * 0.01 / np.sqrt(3), rel=1e-3)
    assert found.loc["unseen_load", "net for cnn, load told"]["gain"] == pytest.approx(-0.2)


def test_a_single_trial_has_no_interval(scores):
    found = differences(scores[scores["trial"] == "a"], "net")
    assert found["low"].isna().all() and found["gain"].notna().all()


def test_page_and_picture_say_who_is_best_whoever_it_is(scores):
    assert answer(scores).startswith("Best R²: a trial like the others: cnn (0.900)")
    page = write_page(scores, differences(scores, "net"), "net", date(2026, 11, 24))
    assert "24 November 2026" in page and "| cnn | **0.900** |" in page and "**+0.210 (+0.185 to +0.235)**" in page
    scores.loc[scores["method"] == "net", "test_r2"] += 0.3
    assert "a trial like the others: net (1.000)" in answer(scores)
    figure = draw_answers(scores, "net")
    assert [axis.get_title() for axis in figure.axes if axis.get_visible()] == [
        "like the others",
        "light to heavy",
    ]
