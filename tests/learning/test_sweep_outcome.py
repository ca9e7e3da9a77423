"""The best settings as a recipe, the names of studies, and what a sweep is judged by."""

import numpy as np
import pandas as pd
import pytest
import yaml

from myowave.learning.sweep.outcome import edge_of, override_text, search_name, summary_text
from myowave.settings import Dimension, RolloutRecipe, Sweep

SWEEP = Sweep(dataset="case1", recipe="rollout", scales=2, dimensions={"hidden": {"low": 4, "high": 64}})
TABLE = pd.DataFrame(
    {
        "trial": [0, 1, 2],
        "state": ["complete", "complete", "pruned"],
        "error": [2.0, 1.5, np.nan],
        "hidden": [50, 20, 4],
        "is_default": [True, False, False],
    }
)


def test_the_file_with_the_best_settings_adds_a_recipe_and_changes_none():
    text = override_text(SWEEP, RolloutRecipe(), {"hidden": 20}, TABLE, "best.yaml")
    laid_over = yaml.safe_load(text)
    both = ["rollout", "rollout_best"]
    assert laid_over["targets"] == {"recipes": both, "own_recipes": {SWEEP.dataset: both}}
    assert list(laid_over["learning"]["recipes"]) == ["rollout_best"]
    best = RolloutRecipe.model_validate(laid_over["learning"]["recipes"]["rollout_best"])
    assert best == RolloutRecipe(hidden=20)
    assert "1.5 deg, of the default 2 deg (25.0 % less" in text


def test_a_search_is_the_same_only_where_errors_can_be_compared(tmp_path):
    data, other = tmp_path / "a.parquet", tmp_path / "b.parquet"
    data.write_bytes(b"trials")
    other.write_bytes(b"other trials")
    judged = {"recipe": {"hidden": 50}, "code": "1"}
    name = search_name(SWEEP, judged, data)
    wider = {"dimensions": {"hidden": {"low": 2, "high": 99}}, "trials": 99, "workers": 7}
    assert search_name(Sweep(**SWEEP.model_dump() | wider), judged, data) == name
    logarithmic = {"dimensions": {"hidden": {"low": 4, "high": 64, "log": True}}}
    another = {"dimensions": SWEEP.model_dump()["dimensions"] | {"beta": {"low": 1e-3, "high": 1e-1}}}
    for change in ({"seeds": 9}, {"epochs": 9}, {"scales": 3}, logarithmic, another):
        assert search_name(Sweep(**SWEEP.model_dump() | change), judged, data) != name
    assert search_name(SWEEP, judged | {"code": "2"}, data) != name
    assert search_name(SWEEP, judged, other) != name


@pytest.mark.parametrize(
    ("dimension", "value", "edge"),
    [
        ({"low": 1e-5, "high": 0.1, "log": True}, 1.1e-5, "low"),
        ({"low": 1e-5, "high": 0.1, "log": True}, 1e-3, ""),  # 1 % of the range, but in its middle as it is searched
        ({"low": 2, "high": 6}, 6, "high"),
        ({"low": 2, "high": 6}, 5, ""),
    ],
)
def test_the_edge_of_a_range_is_told_as_it_is_searched(dimension, value, edge):
    assert edge_of(Dimension(**dimension), value) == edge


def test_the_summary_says_which_range_was_too_narrow():
    inside = summary_text(SWEEP, {"hidden": 50}, {"hidden": 20}, TABLE)
    assert "1.5 deg" in inside and "| hidden | 20 | 50 | 4 to 64 |" in inside and "edge" not in inside
    at_edge = summary_text(SWEEP, {"hidden": 50}, {"hidden": 64}, TABLE)
    assert "high edge" in at_edge and "learning.sweep.dimensions.hidden.high" in at_edge
