"""The comparison in words, and as one page of Markdown."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from studies.scales.ways import WAYS

ASKED = "coarse_to_fine"


def answer(judged: pd.DataFrame) -> str:
    """Where training from coarse to fine beats as many steps and restarts at one scale, in a sentence."""
    rows = judged[judged["way"] == ASKED]
    several = rows["condition"].nunique() > 1
    found: dict[str, list[str]] = {"helps": [], "harms": [], "no clear difference": []}
    for row in rows.itertuples():
        where = f"{row.dataset}, {row.condition}" if several else str(row.dataset)
        found[str(row.finding)].append(f"{where} ({row.change_pct:+.0f} %)")
    parts = [f"{finding} in {'; '.join(where)}" for finding, where in found.items() if where]
    return f"Coarse to fine against as many restarts at one scale: {'. '.join(parts)}."


def write_page(judged: pd.DataFrame, scores: pd.DataFrame, study: Mapping[str, Any], picture: str) -> str:
    """The answer, how it was found, and all comparisons.

    Args:
        judged: from `judge.judge`.
        scores: what it judged.
        study: settings of the comparison, `scales`.
        picture: name of the file with the picture, beside the page.
    """
    seeds, steps = scores["seed"].nunique(), scores.groupby("condition")["steps"].min()
    draws = judged["draws"]
    number = f"{draws.min()}" if draws.min() == draws.max() else f"{draws.min()} to {draws.max()}"
    conditions = [
        f"- `{name}`: recipe `{condition['recipe']}`, {steps[name]} steps"
        + "".join(f", {key} {value}" for key, value in condition["changes"].items())
        for name, condition in study["conditions"].items()
        if name in steps
    ]
    header = (
        "| condition | dataset | way | against | RMSE [deg] | against [deg] | change [%] | interval [%] | finding |"
    )
    rows = [
        f"| {r.condition} | {r.dataset} | {WAYS[str(r.way)].title} | {WAYS[str(r.against)].title} | {r.rmse_deg:.2f} | "
        f"{r.against_rmse_deg:.2f} | {r.change_pct:+.0f} | {r.low_pct:+.0f} to {r.high_pct:+.0f} | {r.finding} |"
        for r in judged.itertuples()
    ]
    parts = [
        "# Where do more scales help?",
        answer(judged),
        f"![change of the error by each way]({picture})",
        f"Written by `snakemake -s studies/scales/Snakefile`: {study['scales']} scales, {number} draws of each "
        f"dataset, {seeds} seeds. The error is that of a free run over trials that no training saw. Each way is "
        "compared, draw by draw, with one that differs in a single thing; ways have as many steps of the optimiser, "
        "and those with several stages as many restarts, but for the last two, which have as many times the steps as "
        "there are scales. "
        "Intervals are over draws, and hold for all ways of a dataset together in 95 % of such studies.",
        "\n".join(conditions),
        "\n".join([header, "| --- " * 9 + "|", *rows]),
    ]
    return "\n\n".join(parts) + "\n"
