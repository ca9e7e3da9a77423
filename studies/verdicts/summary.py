"""The cases counted: rates of right answers and of wrong names with their intervals, world by world."""

from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from studies.verdicts.cases import groups

NAMES = {
    "as_assumed": "as the model assumes",
    "other_curves": "other muscle curves",
    "other_constants": "other constants",
    "other_data": "other sensors and filters",
    "other_solver": "sample-and-hold of EMG in the solver",
    "outside": "effect not in the catalogue",
}


def summarize(rows: pd.DataFrame) -> pd.DataFrame:
    """One row per world, noise and whether an effect was hidden; rates in percent with their 95 % intervals.

    Whether the answer is right counts only where what is hidden can be seen, a wrong name everywhere.
    """
    return pd.DataFrame([_row(*group) for group in groups(rows)])


def _row(world: str, hidden: str, noise: float, rows: pd.DataFrame) -> dict[str, Any]:
    seen = rows if hidden == "nothing" else rows[rows["signal"] >= 1]
    covered, intervals = int(rows["covered"].sum()), int(rows["intervals"].sum())
    return {
        "world": world,
        "hidden": hidden,
        "noise_deg": noise,
        "sets": len(rows),
        "seen": len(seen),
        **_rate("right", int(seen["right"].sum()), len(seen)),
        **_rate("wrong_name", int(rows["wrong_name"].sum()), len(rows)),
        "coverage_pct": 100 * covered / intervals if intervals else np.nan,
        "intervals": intervals,
        "failed": int((rows["verdict"] == "failed").sum()),
        "seconds_mean": rows["seconds"].mean(),
        "seconds_most": rows["seconds"].max(),
    }


def _rate(name: str, count: int, sets: int) -> dict[str, float]:
    if not sets:
        return dict.fromkeys((f"{name}_pct", f"{name}_low_pct", f"{name}_high_pct"), np.nan)
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
        "the catalogue, that this is said, or with other curves that they are others; counted where nine of ten such "
        "recordings show the effect. A wrong name: anywhere in the answer, of all sets; another family of curves is "
        "none where the curves are others, nor is a class that holds something outside the catalogue where the arm has "
        "that. Each rate with its 95 % interval. Written by `snakemake -s studies/verdicts/Snakefile --cores 2`.",
        "",
        "| world | noise [deg] | sets | can be seen | right [%] | a wrong name [%] | 95 % intervals that hold [%] |",
        "|---" * 7 + "|",
    ]
    for row in summary.to_dict("records"):
        world = NAMES[row["world"]] + (", nothing missing" if row["hidden"] == "nothing" else "")
        noise = f"{row['noise_deg']:g}" if np.isfinite(row["noise_deg"]) else ""
        rates = " | ".join(_said(row, rate) for rate in ("right", "wrong_name"))
        covered = f"{row['coverage_pct']:.1f} of {row['intervals']:.0f}" if row["intervals"] else ""
        lines.append(f"| {world} | {noise} | {row['sets']} | {row['seen']} | {rates} | {covered} |")
    return "\n".join(lines) + "\n"


def _said(row: dict[str, Any], rate: str) -> str:
    share, low, high = (row[f"{rate}_{part}"] for part in ("pct", "low_pct", "high_pct"))
    return f"{share:.0f} ({low:.0f} to {high:.0f})" if np.isfinite(share) else ""
