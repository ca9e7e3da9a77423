"""Questions asked of held-out trials: what trains and what tests."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from myowave.settings import Baseline
from studies.held_out.page import by_question, differences, interval, lowest
from studies.held_out.score import score_baselines, split_trials
from studies.held_out.settings import HeldOut
from studies.shared import read_section


def test_the_shipped_questions_are_about_trials_that_are_there_and_each_is_asked_of_three(settings):
    own = yaml.safe_load((Path(__file__).parents[1] / "settings.yaml").read_text(encoding="utf-8"))["held_out"]
    held_out = read_section(HeldOut, "held_out", own, settings)
    tested = {
        question: {(name, t) for name, split in of.items() for t in split.test}
        for question, of in held_out.questions.items()
    }
    assert len(tested.pop("unseen_lean")) == 1, "the one trial that leans more than all others"
    assert all(len(draws) >= 3 for draws in tested.values())


def test_each_test_trial_is_scored_by_itself_and_by_nothing_but_the_training_trials(trials, model):
    split = split_trials(trials, ["2"], ["1", "3"])
    assert split.names == ("2", "1", "3") and split.train == ("2",)
    rows = pd.concat(score_baselines({"line": Baseline(kind="ridge")}, split, model, 2))
    assert len(rows) == 8 and set(rows["trial"]) == {"1", "3"} and set(rows["inputs"]) == {"given", "weighed"}
    assert rows.groupby(["trial", "inputs"])["test_r2"].nunique().eq(1).all(), "ridge has no chance in it"


@pytest.fixture
def scores():
    """Errors of made-up methods: the network errs 4 deg, 2 deg more where the load is given, and 1 deg more with three
    scales on an unseen load; trees err 5 and 7 deg."""
    rows = []
    for question, splits in {
        "like_the_others": ["a"],
        "unseen_load": ["up", "down"],
        "few_trials": ["1 trial a"],
    }.items():
        for split, trial, seed in ((s, t, k) for s in splits for t in range(3) for k in range(2)):
            for inputs in ("given", "weighed"):
                for method, scales in (("trees", 1), ("own", 1), ("own", 3)):
                    error = 5.0 if method == "trees" else 4.0 + (scales == 3) * (question == "unseen_load")
                    error += 2.0 * (inputs == "given") + 0.1 * trial + 0.01 * seed * trial
                    keys = dict(question=question, split=split, trial=f"{split}{trial}", seed=seed, inputs=inputs)
                    rows.append(keys | dict(method=method, scales=scales, test_rmse_deg=error, test_r2=1 - error / 100))
    return pd.DataFrame(rows)


def test_differences_are_paired_by_trial_and_those_of_the_network_are_against_the_best_baseline(scores):
    noise = np.random.default_rng(0).normal(0, 0.1, len(scores))
    lines = differences(scores.assign(test_rmse_deg=scores["test_rmse_deg"] + noise)).splitlines()
    assert lines[0] == "| change | like the others (3) | unseen load (6) | 1 to 4 trials (3) |"
    values = {
        line.split(" | ")[0].strip("| "): [float(v.strip("* |").split()[0]) for v in line.split(" | ")[1:]]
        for line in lines[2:]
    }
    np.testing.assert_allclose(values["the network for the best baseline"], -1.0, atol=0.3)
    np.testing.assert_allclose(values["EMG over weight for the load given"], -2.0, atol=0.3)
    np.testing.assert_allclose(values["3 scales for 1, load given"], [0.0, 1.0, 0.0], atol=0.3)


def test_an_interval_is_the_t_interval_of_paired_differences():
    change = pd.Series([1.0, 2.0, 4.0])
    half = 4.302653 * change.std(ddof=1) / np.sqrt(3)  # of Student's t with two degrees of freedom
    np.testing.assert_allclose(interval(change), [change.mean() - half, change.mean() + half], rtol=1e-5)


def test_the_best_of_each_question_is_bold_and_the_lowest_is_that_of_any_trial_and_seed(scores):
    head, _, *lines = by_question(scores).splitlines()
    assert head == "| method | like the others | up | down | 1 trial |"
    bold = [line.split(" | ")[0] for line in lines if "**" in line]
    assert bold == ["| network, 1 scale, EMG over weight", "| network, 3 scales, EMG over weight"]
    assert lowest(scores) == pytest.approx({"down": 1 - 0.0422, "up": 1 - 0.0422})
