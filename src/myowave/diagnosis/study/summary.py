"""The study counted: rates of right answers and of wrong names with their intervals, world by world."""

from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from myowave.diagnosis.study.cases import groups


def summarize(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per world, noise and whether an effect was hidden; rates in percent with their 95 % intervals.

    Only effects above their own smallest detectable value count, but for those that were taken out of the catalogue.
    """
    return pd.DataFrame([_row(*group) for group in groups(rows)])


def _row(world: str, hidden: str, noise: float, rows: pd.DataFrame) -> dict[str, Any]:
    covered, intervals = int(rows["covered"].sum()), int(rows["intervals"].sum())
    return {
        "world": world,
        "hidden": hidden,
        "noise_deg": noise,
        "sets": len(rows),
        **_rate("right", int(rows["right"].sum()), len(rows)),
        **_rate("wrong_name", int(rows["wrong_name"].sum()), len(rows)),
        "coverage_pct": 100 * covered / intervals if intervals else np.nan,
        "intervals": intervals,
        "failed": int((rows["verdict"] == "failed").sum()),
        "seconds_mean": rows["seconds"].mean(),
        "seconds_most": rows["seconds"].max(),
    }


def _rate(name: str, count: int, sets: int) -> dict[str, float]:
    low, high = binomtest(count, sets).proportion_ci(method="wilson")
    return {f"{name}_pct": 100 * count / sets, f"{name}_low_pct": 100 * low, f"{name}_high_pct": 100 * high}
