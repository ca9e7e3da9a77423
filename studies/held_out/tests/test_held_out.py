"""Questions asked of held-out trials: what trains and what tests."""

from pathlib import Path

import pandas as pd
import yaml

from myowave.settings import Baseline
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
