"""What was withheld, what was said, and how far trials kept for testing are missed before and after."""

from collections.abc import Mapping
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from myowave.physics.effects import catalogue
from myowave.plotting import BLUE, GREEN, GREY, ORANGE, RED, canvas

COLOURS = {"named": GREEN, "class": BLUE, "honest": ORANGE, "silent": GREY, "wrong": RED}
RUNAWAY = 60.0  # deg; what misses more follows no longer
PLAIN = {"adequate": "nothing is missing", "unknown": "something unknown", "undecidable": "cannot be told"}


def draw_reality(table: pd.DataFrame) -> Figure:
    """A row for each question.

    Args:
        table: as `score.score_cases` gives it.
    """
    count = len(table)
    figure, axes = canvas(1, 2, width=13.5, height=1.2 + 0.7 * count, width_ratios=(1.8, 1), sharey=True)
    words, errors = axes[0]
    for place, row in enumerate(table.to_dict("records")):
        words.text(0.0, place, "{system} ({kind})\nnot told: {withheld}".format_map(row), va="center", fontsize=9)
        colour, told = COLOURS[row["grade"]], said(row)
        words.text(0.47, place, told, va="center", fontsize=9, color=colour, weight="bold")
        words.text(0.99, place, row["grade"], va="center", ha="right", fontsize=9, color=colour)
        pair = [min(error, RUNAWAY) for error in (row["error_before"], row["error_after"])]
        errors.plot(pair, [place, place], color=colour, linewidth=2.5, alpha=0.5)
        errors.plot(pair[:1], [place], "o", color=GREY, label="before" if place == 0 else None)
        errors.plot(pair[1:], [place], "D", color=colour, label="after" if place == 0 else None)
        if pd.notna(row["error_after"]):
            errors.annotate(
                error_before_after(row), (max(pair), place), (8, 0), textcoords="offset points", va="center", fontsize=9
            )
    words.set_axis_off()
    words.set_xlim(0, 1)
    words.text(0.0, -0.75, "what moves, and what was withheld", fontsize=10, weight="bold")
    words.text(0.47, -0.75, "what was said", fontsize=10, weight="bold")
    errors.set_xscale("log")
    errors.set_xlim(right=12 * RUNAWAY)
    errors.set_xlabel("error of trials that no fit has seen [deg]")
    errors.set_ylim(count - 0.4, -0.9)
    errors.spines["left"].set_visible(False)
    errors.tick_params(left=False)
    errors.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return figure


def error_before_after(row: Mapping[str, Any]) -> str:
    """Both errors of a row [deg], one where they are the same."""
    return " → ".join(dict.fromkeys(_degrees(row[key]) for key in ("error_before", "error_after")))


def _degrees(error: float) -> str:
    return f"{error:.2g}" if error < RUNAWAY else "runs away"


def said(row: Mapping[str, Any]) -> str:
    """The answer of a row in few words, in lines short enough for the picture."""
    verdict, names, classes = row["verdict"], row["names"], row["class"]
    titles = {name: effect.title for name, effect in catalogue().items()}
    if not names:
        near = ", ".join(titles[name] for name in filter(None, row["nearest"].split(", ")))
        return PLAIN.get(verdict, verdict) + f"\n(nearest: {near})" * bool(near)

    def told(name: str) -> str:
        others = max((one.count(" or ") for one in classes.split("; ") if name in one.split(" or ")), default=0)
        title = titles.get(name, name.replace("_", " "))
        return f"{title}\n   (or {others} other{'s' * (others > 1)})" if others else title

    return ",\n".join(map(told, names.split(", "))) + ("\nand something else" if verdict == "partial" else "")
