"""The best settings as a recipe, the names of studies, and what a sweep is judged by."""

import numpy as np
import pandas as pd
import pytest
import yaml

from myowave.learning.sweep.objective import with_settings
from myowave.learning.sweep.outcome import compare_scores, override_text, study_name
from myowave.settings import Recipe, Sweep

SWEEP = Sweep(dataset="case1", recipe="rollout", scales=2, dimensions={"hidden": {"low": 4, "high": 64}})
TABLE = pd.DataFrame(
    {
        "trial": [0, 1, 2], "state": ["complete", "complete", "pruned"], "error": [2.0, 1.5, np.nan],
        "hidden": [50, 20, 4], "is_default": [True, False, False],
    }
)  # fmt: skip


def test_the_file_with_the_best_settings_adds_a_recipe_and_changes_none():
    text = override_text(SWEEP, Recipe(), {"hidden": 20}, TABLE, "best.yaml")
    laid_over = yaml.safe_load(text)
    assert laid_over["targets"] == {"recipes": ["rollout", "rollout_best"]}
    assert list(laid_over["learning"]["recipes"]) == ["rollout_best"]
    best = Recipe.model_validate(laid_over["learning"]["recipes"]["rollout_best"])
    assert best == Recipe(hidden=20)
    assert "1.5 deg, of the default 2" in text


def test_epochs_of_a_trial_are_fewer_unless_they_are_searched():
    assert with_settings(Recipe(epochs=900), {"hidden": 8}, epochs=30).epochs == 30
    assert with_settings(Recipe(epochs=900), {"epochs": 77}, epochs=30).epochs == 77
    assert with_settings(Recipe(epochs=900), {"hidden": 8}).epochs == 900


def test_a_study_is_the_same_only_where_errors_can_be_compared(tmp_path):
    data, other = tmp_path / "a.parquet", tmp_path / "b.parquet"
    data.write_bytes(b"trials")
    other.write_bytes(b"other trials")
    judged = {"recipe": {"hidden": 50}, "code": "1"}
    name = study_name(SWEEP, judged, data)
    wider = {"dimensions": {"beta": {"low": 1e-3, "high": 1e-1}}, "trials": 99, "workers": 7, "pruner": "none"}
    assert study_name(Sweep(**SWEEP.model_dump() | wider), judged, data) == name
    for change in ({"seeds": 9}, {"epochs": 9}, {"held_out": 0.5}):
        assert study_name(Sweep(**SWEEP.model_dump() | change), judged, data) != name
    assert study_name(SWEEP, judged | {"code": "2"}, data) != name
    assert study_name(SWEEP, judged, other) != name


def test_scores_of_both_settings_stand_in_one_table():
    default = pd.DataFrame({"seed": [0, 1], "test_mse": [2.0, 3.0]})
    both = compare_scores(default, default.assign(test_mse=1.0))
    assert both["setting"].tolist() == ["default"] * 2 + ["best"] * 2
    assert both["test_mse"].tolist() == pytest.approx([2.0, 3.0, 1.0, 1.0])
