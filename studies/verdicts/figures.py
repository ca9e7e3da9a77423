"""What names and answers are worth."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import binomtest

from myowave.plotting import BLUE, CYCLE, GREEN, GREY, ORANGE, RED, SKY, canvas, title
from studies.verdicts.summary import GRADES, NAMES, reliability

COLOURS = dict(zip(GRADES, (GREEN, SKY, "#c9c9c9", ORANGE, RED), strict=True))


def draw_reliability(rows: pd.DataFrame) -> Figure:
    """Of names given at a probability the share that is true, and what answers are worth in each world.

    Args:
        rows: of `judges.judge_set`.
    """
    judges = list(dict.fromkeys(rows["judge"]))
    figure, axes = canvas(1, 2, width=13.0, height=5.2, width_ratios=(1, 1.7))
    _reliability(axes[0, 0], rows, judges)
    _grades(axes[0, 1], rows, judges)
    best = rows[rows["judge"] == judges[0]]
    title(figure, f"A name that is not true in {best['wrong_name'].sum()} of {len(best)} sets")
    figure.legend(*axes[0, 1].get_legend_handles_labels(), loc="outside lower right", ncols=len(GRADES))
    return figure


def _reliability(axis: Axes, rows: pd.DataFrame, judges: list[str]) -> None:
    axis.plot([0.5, 1], [0.5, 1], color=GREY, lw=1, ls=":", zorder=0)
    for judge, colour, marker in zip(judges, (BLUE, RED, *CYCLE), "so^v", strict=False):
        found = [f for f in reliability(rows[rows["judge"] == judge].to_dict("records")) if f[2]]
        if not found:
            continue
        given = np.array([p for *_, p in found])
        share = np.array([true / n for _, _, n, true, _ in found])
        ends = np.array([binomtest(true, n).proportion_ci(method="wilson") for _, _, n, true, _ in found]).T
        error = np.stack([share - ends[0], ends[1] - share]).clip(0)
        axis.errorbar(given, share, yerr=error, color=colour, marker=marker, capsize=3, ls="", label=judge)
        for x, y, (_, _, n, _, _) in zip(given, share, found, strict=True):
            axis.annotate(f"{n}", (x, y), (6, -4), textcoords="offset points", fontsize=9, color=colour)
    axis.set(xlabel="probability given to a name", ylabel="share that is true", ylim=(0, 1.04), xlim=(0.48, 1.05))
    axis.legend(loc="lower right")


def _grades(axis: Axes, rows: pd.DataFrame, judges: list[str]) -> None:
    worlds = [world for world in NAMES if (rows["world"] == world).any()]
    places, labels = [], []
    for i, world in enumerate(worlds):
        for k, judge in enumerate(judges):
            some = rows[(rows["world"] == world) & (rows["judge"] == judge)]
            place, left = -i - 0.8 * k / len(judges), 0.0
            for grade in GRADES:
                share = 100 * float(some["grade"].eq(grade).mean())
                first = grade if i == k == 0 else None
                axis.barh(place, share, 0.7 / len(judges), left, color=COLOURS[grade], label=first)
                left += share
            places.append(place)
            labels.append(f"{NAMES[world]} ({len(some)}), {judge}" if k == 0 else judge)
    axis.set_yticks(places, labels, fontsize=9)
    axis.set(xlabel="sets [%]", xlim=(0, 100))
    axis.grid(axis="y", visible=False)
