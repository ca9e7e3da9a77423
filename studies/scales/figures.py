"""The picture of the comparison: the change of the error by each arm, with intervals over draws."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.plotting import CYCLE, GREY, canvas, title
from studies.scales.arms import ARMS
from studies.scales.page import answer

WIDEST = 150.0  # % beyond which an interval is cut off


def draw_comparison(judged: pd.DataFrame) -> Figure:
    """One panel per dataset, one row per arm, a colour for each condition.

    Args:
        judged: from `judge.judge`.
    """
    datasets, conditions = (list(dict.fromkeys(judged[name])) for name in ("dataset", "condition"))
    arms = [arm for arm in ARMS if arm in set(judged["arm"])]
    figure, axes = canvas(1, len(datasets), width=5.2 + 2.6 * len(datasets), height=1.9 + 0.42 * len(arms), sharey=True)
    for axis, dataset in zip(axes[0], datasets, strict=True):
        axis.axvline(0.0, color=GREY, linewidth=1.0)
        for i, condition in enumerate(conditions):
            rows = judged[(judged["dataset"] == dataset) & (judged["condition"] == condition)]
            place = np.array([-arms.index(arm) for arm in rows["arm"]]) - 0.22 * (i - (len(conditions) - 1) / 2)
            middle = rows["change_pct"].to_numpy()
            ends = np.abs(np.stack([rows["low_pct"], rows["high_pct"]]).clip(-100, WIDEST) - middle)
            axis.errorbar(
                middle, place, xerr=ends, fmt="o", color=CYCLE[i % len(CYCLE)], capsize=3, label=condition, clip_on=True
            )
        axis.set(title=dataset, xlabel="change of RMSE [%]")
        low, high = judged["low_pct"].clip(lower=-100).min(), judged["high_pct"].clip(upper=WIDEST).max()
        axis.set_xlim(low - 5, high + 5)
    axes[0, 0].set_yticks(
        -np.arange(len(arms)), [f"{ARMS[arm].title}\nagainst {ARMS[ARMS[arm].beside or 'one'].title}" for arm in arms]
    )
    axes[0, 0].tick_params(axis="y", labelsize=8)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(conditions))
    title(figure, answer(judged))
    return figure
