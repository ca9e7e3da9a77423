"""What was withheld, what was said, and how far trials kept for testing are missed before and after."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.plotting import BLUE, GREEN, GREY, ORANGE, RED, canvas
from studies.reality.page import RUNAWAY, error_before_after, said

COLOURS = {"named": GREEN, "class": BLUE, "honest": ORANGE, "silent": GREY, "wrong": RED}
LINE_IN, GAP = 0.16, 1.5  # height of a line of text, and between two rows, in such lines


def draw_reality(table: pd.DataFrame) -> Figure:
    """A row for each question, as high as its text.

    Args:
        table: as `score.score_cases` gives it.
    """
    rows = table.to_dict("records")
    heights = np.array([max(2, said(row).count("\n") + 1) + GAP for row in rows])
    places = heights.cumsum() - heights / 2
    figure, axes = canvas(1, 2, width=15, height=1.2 + LINE_IN * heights.sum(), width_ratios=(1.8, 1), sharey=True)
    words, errors = axes[0]
    small = {"va": "center", "fontsize": 9}
    pairs = table[["error_before", "error_after"]].astype(float).clip(upper=RUNAWAY)
    for n, (place, row) in enumerate(zip(places, rows, strict=True)):
        colour, pair = COLOURS[row["grade"]], pairs.iloc[n]
        words.text(0.0, place, "{system} ({kind})\nnot told: {withheld}".format_map(row), **small)
        words.text(0.47, place, said(row), color=colour, weight="bold", **small)
        words.text(0.99, place, row["grade"], ha="right", color=colour, **small)
        errors.plot(pair, [place, place], color=colour, linewidth=2.5, alpha=0.5)
        errors.plot(pair[:1], [place], "o", color=GREY, label=None if n else "before")
        errors.plot(pair[1:], [place], "D", color=colour, label=None if n else "after")
        if pair.notna().all():
            errors.annotate(error_before_after(row), (pair.max(), place), (8, 0), textcoords="offset points", **small)
    counts = table["grade"].value_counts()
    told = ", ".join(f"{counts[grade]} {grade}" for grade in COLOURS if grade in counts)
    figure.suptitle(f"Of {len(table)} questions with a known answer: {told}", x=0.01, ha="left", weight="bold")
    words.set_axis_off()
    words.set_xlim(0, 1)
    words.text(0.0, -0.4, "what moves, and what was withheld", fontsize=10, weight="bold")
    words.text(0.47, -0.4, "what was said", fontsize=10, weight="bold")
    errors.set(xscale="log", xlabel="error of trials that no fit has seen [deg]", ylim=(heights.sum() + GAP, -2 * GAP))
    errors.set_xlim(right=12 * RUNAWAY)
    errors.spines["left"].set_visible(False)
    errors.tick_params(left=False)
    errors.grid(visible=False, axis="y")
    errors.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return figure
