"""The picture of the comparison: the change of the error by each way, with intervals over draws."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.plotting import CYCLE, GREY, canvas, title
from studies.scales.page import answer
from studies.scales.ways import WAYS

WIDEST = 150.0  # % beyond which an interval is cut off


def draw_comparison(judged: pd.DataFrame) -> Figure:
    """One panel per dataset, one row per way, a colour for each condition.

    Args:
        judged: from `judge.judge`.
    """
    datasets, conditions = (list(dict.fromkeys(judged[name])) for name in ("dataset", "condition"))
    ways = [way for way in WAYS if way in set(judged["way"])]
    figure, axes = canvas(1, len(datasets), width=5.2 + 2.6 * len(datasets), height=1.9 + 0.42 * len(ways), sharey=True)
    for axis, dataset in zip(axes[0], datasets, strict=True):
        axis.axvline(0.0, color=GREY, linewidth=1.0)
        for i, condition in enumerate(conditions):
            rows = judged[(judged["dataset"] == dataset) & (judged["condition"] == condition)]
            place = np.array([-ways.index(way) for way in rows["way"]]) - 0.22 * (i - (len(conditions) - 1) / 2)
            middle = rows["change_pct"].to_numpy()
            ends = np.abs(np.stack([rows["low_pct"], rows["high_pct"]]).clip(-100, WIDEST) - middle)
            axis.errorbar(
                middle, place, xerr=ends, fmt="o", color=CYCLE[i % len(CYCLE)], capsize=3, label=condition, clip_on=True
            )
        axis.set(title=dataset, xlabel="change of RMSE [%]")
        low, high = judged["low_pct"].clip(lower=-100).min(), judged["high_pct"].clip(upper=WIDEST).max()
        axis.set_xlim(low - 5, high + 5)
    axes[0, 0].set_yticks(
        -np.arange(len(ways)), [f"{WAYS[way].title}\nagainst {WAYS[WAYS[way].against or 'one'].title}" for way in ways]
    )
    axes[0, 0].tick_params(axis="y", labelsize=8)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(conditions))
    title(figure, answer(judged))
    return figure
