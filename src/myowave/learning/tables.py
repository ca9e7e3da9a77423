"""The tables that training and evaluation leave in results/learning/, read back and put together.

Paths end in `{dataset}/{model}/{recipe}/{scales}-scale/{file}`.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path

import pandas as pd

from myowave.data.store import read_table

_SCORES = ["dataset", "model", "recipe", "scales", "seed", "epochs", "seconds"]  # of any seed, diverged ones included


def read_evaluations(paths: Iterable[str | Path]) -> pd.DataFrame:
    """Rows of all evaluations; columns of parameters that some models do not identify are empty there.

    Raises:
        ValueError: for a file that holds no table.
    """
    return pd.concat([_read_evaluation(path) for path in paths], ignore_index=True)


def _read_evaluation(path: str | Path) -> pd.DataFrame:
    """The rows of an evaluation, one for each seed whose parameters stand beside it."""
    seeds = Path(path).with_name("parameters.csv")
    try:
        table = pd.read_csv(path)
        whole = Path(path).read_bytes().endswith(b"\n") and table[_SCORES].notna().all(axis=None)
        if not whole or (seeds.exists() and {*pd.read_csv(seeds)["seed"]} != {*table["seed"]}):
            raise ValueError("it was cut short")
        return table
    except (ValueError, KeyError) as error:
        raise ValueError(f"{path}: no table of scores ({error}). Remove it, and run again: it is made anew.") from None


def read_histories(paths: Iterable[str | Path]) -> dict[int, pd.DataFrame]:
    """{number of scales: its histories one after the other, coarsest first}, epochs counted through all scales."""
    folders = {_scales(path): Path(path).parent for path in paths}
    return {scales: join_histories(folder, scales) for scales, folder in sorted(folders.items())}


def join_histories(folder: Path, scales: int) -> pd.DataFrame:
    """The histories in one folder, coarsest scale first, epochs counted through all scales."""
    parts, done = [], 0
    for level in reversed(range(scales)):
        history, _ = read_table(folder / f"history-{level}.parquet")
        history["epoch"] += done
        done = history["epoch"].max()
        parts.append(history)
    return pd.concat(parts, ignore_index=True)


def read_predictions(paths: Iterable[str | Path]) -> Mapping[int, pd.DataFrame]:
    """{number of scales: its predictions}."""
    return {_scales(path): read_table(path)[0] for path in paths}


def _scales(path: str | Path) -> int:
    return int(Path(path).parent.name.removesuffix("-scale"))
