"""What names and answers are worth."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import binomtest

from myowave.plotting import BLUE, CYCLE, GREEN, GREY, ORANGE, RED, SKY, canvas, title
from studies.verdicts.summary import GRADES, reliability
from studies.verdicts.worlds import WORLDS

COLOURS = (GREEN, SKY, "#c9c9c9", ORANGE, RED)


def draw_reliability(rows: pd.DataFrame) -> Figure:
    """Of names given at a probability the share that is true, and what answers are worth in each world.

    Args:
        rows: of `judge.judge_set`.
    """
    judges = dict(list(rows.groupby("judge", sort=False)))
    figure, axes = canvas(1, 2, width=13.0, height=5.2, width_ratios=(1, 1.7))
    _reliability(axes[0, 0], judges)
    labels = rows["world"].map(WORLDS) + (", " + rows["judge"] if len(judges) > 1 else "")
    shares = 100 * pd.crosstab(labels, rows["grade"], normalize="index").reindex(columns=GRADES, fill_value=0)
    bars = axes[0, 1]
    shares.loc[labels.unique()[::-1]].plot.barh(stacked=True, ax=bars, color=COLOURS, width=0.7, legend=False)
    bars.set(xlabel="sets [%]", ylabel="", xlim=(0, 100))
    bars.grid(axis="y", visible=False)
    first = next(iter(judges.values()))
    title(figure, f"A name that is not true in {first['wrong_name'].sum()} of {len(first)} sets")
    figure.legend(*bars.get_legend_handles_labels(), loc="outside lower right", ncols=len(GRADES))
    return figure


def _reliability(axis: Axes, judges: dict[str, pd.DataFrame]) -> None:
    axis.plot([0.5, 1], [0.5, 1], color=GREY, lw=1, ls=":", zorder=0)
    for (judge, rows), colour, marker in zip(judges.items(), (BLUE, RED, *CYCLE), "so^v", strict=False):
        for _, _, n, true, given in reliability(rows):
            low, high = binomtest(true, n).proportion_ci(method="wilson")
            ends = [[true / n - low], [high - true / n]]
            axis.errorbar(given, true / n, ends, color=colour, marker=marker, capsize=3)
            axis.annotate(f"{n}", (given, true / n), (6, -4), textcoords="offset points", fontsize=9, color=colour)
        axis.plot([], [], color=colour, marker=marker, ls="", label=judge)
    axis.set(xlabel="probability given to a name", ylabel="share that is true", ylim=(0, 1.04), xlim=(0.48, 1.05))
    axis.legend(loc="lower right")
