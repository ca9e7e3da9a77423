"""What names and answers are worth."""

import pandas as pd
from matplotlib.figure import Figure
from scipy.stats import binomtest

from myowave.plotting import BLUE, GREEN, GREY, ORANGE, RED, SKY, canvas, title
from studies.shared import GRADES
from studies.verdicts.summary import reliability
from studies.verdicts.worlds import WORLDS

COLOURS = (GREEN, SKY, "#c9c9c9", ORANGE, RED)


def draw_reliability(rows: pd.DataFrame) -> Figure:
    """Of effects with a probability the share that is true, and what answers are worth for each kind of arm.

    Args:
        rows: of `judge.judge_set`, of one judge.
    """
    figure, axes = canvas(1, 2, width=13.0, height=5.2, width_ratios=(1, 1.7))
    names, bars = axes[0]
    names.plot([0.5, 1], [0.5, 1], color=GREY, lw=1, ls=":", zorder=0)
    for _, _, n, true, given in reliability(rows):
        low, high = binomtest(true, n).proportion_ci(method="wilson")
        names.errorbar(given, true / n, [[true / n - low], [high - true / n]], color=BLUE, marker="s", capsize=3)
        names.annotate(f"{n}", (given, true / n), (6, -4), textcoords="offset points", fontsize=9, color=BLUE)
    names.set(xlabel="probability of an effect", ylabel="share that is true", ylim=(0, 1.04), xlim=(0.48, 1.05))
    worlds = rows["world"].map(WORLDS)
    shares = 100 * pd.crosstab(worlds, rows["grade"], normalize="index").reindex(columns=list(GRADES), fill_value=0)
    shares.loc[worlds.unique()[::-1]].plot.barh(stacked=True, ax=bars, color=COLOURS, width=0.7, legend=False)
    bars.set(xlabel="arms [%]", ylabel="", xlim=(0, 100))
    bars.grid(axis="y", visible=False)
    title(figure, f"A verdict has a name that is not true for {rows['wrong_name'].sum()} of {len(rows)} arms")
    figure.legend(bars.get_legend_handles_labels()[0], GRADES.values(), loc="outside lower right", ncols=len(GRADES))
    return figure
