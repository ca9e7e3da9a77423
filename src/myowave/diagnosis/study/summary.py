"""The study counted: rates of right answers and of wrong names with their intervals, world by world."""

from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from myowave.diagnosis.study.cases import groups

NAMES = {
    "as_assumed": "as the model assumes",
    "other_curves": "other muscle curves",
    "other_constants": "other constants",
    "other_data": "other sensors and filters",
    "other_solver": "EMG held by the solver",
    "outside": "effect not in the catalogue",
}


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


def write_page(summary: pd.DataFrame) -> str:
    """The rates as a table in Markdown.

    Args:
        summary: from `summarize`.
    """
    lines = [
        "# How often the diagnosis is right",
        "",
        f"{summary['sets'].sum()} simulated arms, each diagnosed as a recording of its own, in "
        f"{summary['seconds_mean'].mul(summary['sets']).sum() / 60:.0f} minutes of one core. Right: the hidden effect "
        "stands alone, in a class or as part of what is named; where nothing is hidden, or what is hidden is not in "
        "the catalogue, that this is said. Effects count from the size on that nine of ten such recordings show. Each "
        "rate with its 95 % interval. Written by `snakemake hidden_effects --cores 2`.",
        "",
        "| world | noise [deg] | sets | right [%] | a wrong name [%] | 95 % intervals that hold [%] |",
        "|---" * 6 + "|",
    ]
    for row in summary.to_dict("records"):
        world = NAMES[row["world"]] + (", nothing missing" if row["hidden"] == "nothing" else "")
        noise = f"{row['noise_deg']:g}" if np.isfinite(row["noise_deg"]) else ""
        rates = " | ".join(
            f"{row[f'{rate}_pct']:.0f} ({row[f'{rate}_low_pct']:.0f} to {row[f'{rate}_high_pct']:.0f})"
            for rate in ("right", "wrong_name")
        )
        held = f"{row['coverage_pct']:.1f} of {row['intervals']:.0f}" if row["intervals"] else ""
        lines.append(f"| {world} | {noise} | {row['sets']} | {rates} | {held} |")
    return "\n".join(lines) + "\n"
