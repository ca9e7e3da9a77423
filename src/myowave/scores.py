"""The one definition of the scores that tables, pictures, pages and MLflow show, how they are read, and what these call
baselines."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

# Of the baselines of config.yaml, on pages and in pictures; tables keep their names, and others have no title.
TITLES = {
    "hold": "hold the first angle",
    "ridge": "ridge on lagged EMG",
    "trees": "boosted trees",
    "gru_plain": "plain GRU",
    "cnn": "causal convolution",
}
WORST = {"test_rmse_deg": np.inf, "test_mse": np.inf, "test_nmse": np.inf, "test_r2": -np.inf}
_SCORES = ["dataset", "model", "recipe", "scales", "seed", "epochs", "seconds"]  # of any seed, diverged ones included


def median_over_seeds(evaluation: pd.DataFrame) -> pd.Series:
    """The numbers that are shown of a network, from its rows of evaluation.csv: medians over its seeds; one whose
    prediction is not finite counts as the worst."""
    return evaluation.select_dtypes("number").fillna(WORST).median()


def read_evaluations(paths: Iterable[str | Path]) -> pd.DataFrame:
    """Rows of all evaluations; columns of parameters that some models do not identify are empty there."""
    return pd.concat(map(read_evaluation, paths), ignore_index=True)


def read_evaluation(path: str | Path, asked: int | None = None) -> pd.DataFrame:
    """Rows of an evaluation.csv. A ValueError for a file that holds no table, or not as many seeds as were `asked` for,
    where that is known."""
    seeds = Path(path).with_name("parameters.csv")  # beside it, where a network was evaluated
    try:
        table = pd.read_csv(path)
        whole = Path(path).read_bytes().endswith(b"\n") and table[_SCORES].notna().all(axis=None)
        if not whole or (seeds.exists() and {*pd.read_csv(seeds)["seed"]} != {*table["seed"]}):
            raise ValueError("it was cut short")
        if asked not in (None, len(table)):
            raise ValueError(f"it has {len(table)} of {asked} seeds")
        return table
    except (ValueError, KeyError) as error:
        raise ValueError(f"{path}: no table of scores ({error}). Remove it, and run again: it is made anew.") from None
