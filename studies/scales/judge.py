"""Whether a way is better than the one it is compared with: differences in pairs, with intervals over draws."""

import numpy as np
import pandas as pd
from scipy import stats

from studies.scales.ways import WAYS

LEVEL = 0.95


def judge(scores: pd.DataFrame) -> pd.DataFrame:
    """One row per condition, dataset and way that is compared with another.

    The error of a draw is the geometric mean over seeds of the RMSE on the unseen trials, so that a change is a factor
    and one network that runs away is not all that counts. Intervals are t intervals over draws of the logarithm of
    that factor, so wide that all of one condition and dataset hold together in 95 % of studies (Bonferroni).

    Args:
        scores: condition, dataset, draw, and the columns of `compete`.

    Returns:
        condition, dataset, way, against, draws, rmse_deg, against_rmse_deg (medians over draws), change_pct of RMSE,
        low_pct, high_pct, finding: helps, harms, or no clear difference.
    """
    by_draw = (
        np.log(scores.set_index(["condition", "dataset", "draw", "way"])["test_rmse_deg"])
        .groupby(["condition", "dataset", "draw", "way"], sort=False)
        .mean()
        .unstack("way")
    )
    rows = []
    for (condition, dataset), errors in by_draw.groupby(["condition", "dataset"], sort=False):
        pairs = [(a, WAYS[a].against) for a in WAYS if {a, WAYS[a].against} <= set(errors.dropna(axis=1))]
        for way, against in pairs:
            change = (errors[way] - errors[against]).to_numpy()
            low, high = _interval(change, 1 - (1 - LEVEL) / len(pairs))
            rows.append(
                {
                    "condition": condition,
                    "dataset": dataset,
                    "way": way,
                    "against": against,
                    "draws": len(change),
                    "rmse_deg": np.exp(errors[way].median()),
                    "against_rmse_deg": np.exp(errors[against].median()),
                    **{
                        f"{name}_pct": 100 * np.expm1(value)
                        for name, value in (("change", change.mean()), ("low", low), ("high", high))
                    },
                    "finding": "helps" if high < 0 else "harms" if low > 0 else "no clear difference",
                }
            )
    return pd.DataFrame(rows)


def _interval(values: np.ndarray, level: float) -> tuple[float, float]:
    """t interval of a mean; infinite where there is a single value."""
    if len(values) < 2:
        return -np.inf, np.inf
    if np.ptp(values) == 0:
        return float(values[0]), float(values[0])
    interval = stats.ttest_1samp(values, 0.0).confidence_interval(level)
    return float(interval.low), float(interval.high)
