"""The tables that training and evaluation leave in results/learning/, read back, put together and judged.

Paths end in `{dataset}/{model}/{recipe}/{scales}-scale/{file}`.
"""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.stats import sem, t

from myowave.data.store import read_table

CLEAR = 0.05  # p-value below which a difference is more than the scatter of seeds


def read_histories(paths: Iterable[str | Path]) -> dict[int, pd.DataFrame]:
    """{number of scales: its histories one after the other, coarsest first}, epochs counted through all scales."""
    folders = {_scales(path): Path(path).parent for path in paths}
    return {scales: join_histories(folder, scales) for scales, folder in sorted(folders.items())}


def join_histories(folder: Path, scales: int) -> pd.DataFrame:
    """The histories in one folder, coarsest scale first, epochs counted through all scales."""
    parts, done = [], 0
    for level in reversed(range(scales)):
        history, _ = read_table(folder / f"history-{level}.parquet")
        parts.append(history.assign(epoch=history["epoch"] + done))
        done = parts[-1]["epoch"].max()
    return pd.concat(parts, ignore_index=True)


def read_predictions(paths: Iterable[str | Path]) -> dict[int, pd.DataFrame]:
    """{number of scales: its predictions}."""
    return {_scales(path): read_table(path)[0] for path in paths}


def _scales(path: str | Path) -> int:
    return int(Path(path).parent.name.removesuffix("-scale"))


def judge_scales(summary: pd.DataFrame) -> pd.DataFrame:
    """Whether more scales help: test R2 of the most scales less that of the fewest, by the seeds that both have,
    with its standard error, of each dataset, model and recipe in rows of evaluation.csv that was trained with several.

    Seeds see one draw of the data: a finding may be another in the next (docs/multiresolution.md judged over draws).
    """
    rows = []
    for (dataset, model, recipe), group in summary.groupby(["dataset", "model", "recipe"]):
        scores = {scales: of.set_index("seed")["test_r2"] for scales, of in group.groupby("scales")}
        most, fewest = max(scores), min(scores)
        if most == fewest:
            continue
        more, less = scores[most].align(scores[fewest], join="inner")
        gain = (more - less).to_numpy()
        mean, error = gain.mean(), sem(gain) if len(gain) > 1 else np.nan
        # Five seeds are few: of Student's t, and none where a seed ran away.
        clear = abs(mean) > t.isf(CLEAR / 2, len(gain) - 1) * error
        finding = f"{'helps' if mean > 0 else 'harms'} in this draw" if clear else "not more than the scatter of seeds"
        if np.isnan(gain).any():
            finding = "a seed ran away"
        counted = f"{(gain > 0).sum()} of {len(gain)}"
        rows.append((dataset, model, recipe, f"{most} against {fewest}", mean, error, counted, finding))
    labels = ["dataset", "model", "recipe", "scales"]
    return pd.DataFrame(rows, columns=[*labels, "gain_r2", "standard_error", "seeds_that_gain", "finding"])
