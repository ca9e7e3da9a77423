"""What the pictures of a diagnosis share: how a model is drawn and called, and the legend."""

import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from myowave.diagnosis.misfit.where import sharing
from myowave.diagnosis.report.words import degrees
from myowave.plotting import BLUE, GREY, MEASURED, MODEL, ORANGE, PINK, SKY

PANEL_LETTERS = 30  # that a panel's title has room for in a line
WIDE = 20.0  # ratio of errors from which an axis is logarithmic
FIRST_STYLE = {"color": MODEL, "linestyle": "--"}
FOUND_STYLE = {"color": BLUE, "linestyle": "-"}


def unique(values: pd.Series) -> list[str]:
    """Values in the order in which they first stand."""
    return list(dict.fromkeys(values))


def style(order: int) -> dict[str, str]:
    """How the first model and the one that was found are drawn, the same in all pictures."""
    return FIRST_STYLE if order == 0 else FOUND_STYLE


def ramp(models: list[str], found: str) -> list[str]:
    """A colour for each model: for the first and for the one that was found as everywhere, others of their own."""
    others = [m for m in models[1:] if m != found]
    own = {m: (ORANGE, PINK, SKY)[i % 3] for i, m in enumerate(others)}
    return [MODEL if i == 0 else own.get(m, BLUE) for i, m in enumerate(models)]


def short(model: str) -> str:
    """A model's name with room for a line break."""
    return model.replace("+", " + ")


def label_lowest(axes: Iterable[Axes], shown: int, columns: int, text: str = "") -> None:
    """Ticks with their labels below the lowest panel of each column, also where the last row is not full.

    Args:
        axes: row by row; only the first of them are `shown`.
        text: below the ticks.
    """
    for axis in list(axes)[:shown][-columns:]:
        axis.tick_params(labelbottom=True)
        axis.set_xlabel(text)


def together(table: pd.DataFrame, name: str, shown: Sequence[str]) -> dict[str, str]:
    """The first of the names of a table under which the same is shown, each with the title of their panel.

    Args:
        name: column of the names.
        shown: columns that are drawn.
    """
    return {names[0]: _listed(names) for names in sharing(table, name, shown)}


def _listed(names: list[str]) -> str:
    """Names after what they begin with alike: `activation BIClong, BRA`; in lines that a panel has room for."""
    begin = names[0].split(" ")[0] + " "
    alike = len(names) > 1 and all(name.startswith(begin) for name in names)
    ends = [name.removeprefix(begin).removesuffix(" [-]") for name in names[1:]] if alike else names[1:]
    return textwrap.fill(", ".join([names[0].removesuffix(" [-]"), *ends]), PANEL_LETTERS, break_long_words=False)


def whiskers(
    axis: Axes, x: Any, values: Any, intervals: Sequence[tuple[float, float]], *, color: str, order: int, name: str
) -> None:
    """A point for each value with a line over its interval: open diamonds for the first model, else dots.

    Args:
        intervals: (low, high), NaN where there is none.
        order: place of the model; 0 is the one without effects.
    """
    low, high = np.array(intervals, dtype=float).reshape(-1, 2).T
    middle = np.asarray(values, dtype=float)
    span = np.nan_to_num(np.clip([middle - low, high - middle], 0.0, None))
    look: dict[str, Any] = {"marker": "D", "markerfacecolor": "white"} if order == 0 else {"marker": "o"}
    axis.errorbar(x, middle, span, color=color, linestyle="none", markersize=6, capsize=3, label=short(name), **look)


def draw_noise(axis: Axes, level: float, noise: str, with_emg: float | None = None) -> None:
    """The error that a model cannot go below: noise of the angle, and with what noise of the EMG makes of the motion.

    Args:
        level: noise of the angle [deg]; `noise` says it in words.
        with_emg: both together [deg]; none where the EMG has none.
    """
    axis.axhline(level, color=MEASURED, linestyle=":", linewidth=2, label=f"noise of the angle, {noise}")
    if with_emg is not None:
        told = f"noise of the angle and of the EMG, {degrees(with_emg)}"
        axis.axhline(with_emg, color=GREY, linestyle=":", linewidth=2, label=told)


def legend(figure: Figure, axis: Axes, *, columns: int) -> None:
    """One legend for all panels, below them."""
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, frameon=False)
