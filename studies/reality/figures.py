"""What was withheld, what was said, and how far trials kept for testing are missed before and after."""

import textwrap
from itertools import groupby

import pandas as pd
from matplotlib.figure import Figure

from myowave.plotting import BLACK, BLUE, GREEN, GREY, ORANGE, RED, canvas
from studies.reality.page import RUNAWAY, error_before_after, said
from studies.reality.score import GRADES

COLOURS = {"named": GREEN, "class": BLUE, "honest": ORANGE, "silent": GREY, "wrong": RED}
LINE_IN, GAP = 0.185, 0.5  # height of a line of text [in], and between two rows [lines]
WIDTHS = 33, 46  # of what was withheld, and of what was said [letters]
COLUMNS = {"withheld": 0.0, "what was said": 0.35, "which is": 0.85}  # where they begin


def draw_reality(table: pd.DataFrame) -> Figure:
    """A row for each question, as high as its text, below what moves.

    Args:
        table: as `score.score_cases` gives it.
    """
    rows = table.to_dict("records")
    lines = [(textwrap.wrap(row["withheld"], WIDTHS[0]), textwrap.wrap(said(row), WIDTHS[1])) for row in rows]
    height = sum(max(map(len, cells)) + GAP for cells in lines) + 2 * len({row["system"] for row in rows})
    figure, axes = canvas(1, 2, width=11, height=1.2 + LINE_IN * height, width_ratios=(2.6, 1), sharey=True)
    words, errors = axes[0]
    place = 0.0
    for system, group in groupby(zip(rows, lines, strict=True), lambda pair: "{system} ({kind})".format_map(pair[0])):
        words.text(0.0, place + 1, system, va="top", weight="bold")
        place += 2
        for row, (withheld, answer) in group:
            colour, middle = COLOURS[row["grade"]], place + max(len(withheld), len(answer)) / 2
            texts = "\n".join(withheld), "\n".join(answer), GRADES[row["grade"]]
            for left, text, shade in zip(COLUMNS.values(), texts, (BLACK, BLACK, colour), strict=True):
                words.text(left, middle, text, va="center", color=shade)
            pair = [min(float(row[key]), RUNAWAY) for key in ("error_before", "error_after") if pd.notna(row[key])]
            if pair:
                errors.plot(pair, [middle] * len(pair), color=colour, linewidth=3, alpha=0.5)
                errors.plot(pair[0], middle, "o", color=GREY)
                errors.plot(pair[-1], middle, "D", color=colour)
                errors.annotate(error_before_after(row), (max(pair), middle), (8, -4), textcoords="offset points")
            place = 2 * middle - place + GAP
    counts = table["grade"].value_counts()
    told = ", ".join(f"{counts[grade]} {word}" for grade, word in GRADES.items() if grade in counts)
    figure.suptitle(f"Of {len(table)} answers whose truth is known: {told}", x=0.01, ha="left", weight="bold")
    words.set_axis_off()
    words.set_xlim(0, 1)
    for text, left in COLUMNS.items():
        words.text(left, 0.0, text, color=GREY)
    errors.set(xscale="log", ylim=(place, -1))
    errors.set_xlim(right=8 * RUNAWAY)
    errors.set_title(
        "error of unseen trials [deg],\nbefore (dot) and after (diamond)", loc="left", color=GREY, fontsize=10
    )
    errors.spines["left"].set_visible(False)
    errors.tick_params(left=False)
    errors.grid(visible=False, axis="y")
    return figure
