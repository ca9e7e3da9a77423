"""What the pictures of a diagnosis share: how a model is drawn and called, axes, levels of noise and the legend."""

from collections.abc import Iterable, Mapping
from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from myowave.plotting import BLUE, GREY, MEASURED, MODEL

Place = Literal["outside lower center", "outside right upper"]
WIDE = 20.0  # ratio of errors from which an axis is logarithmic
FIRST_STYLE = {"color": MODEL, "linestyle": "--"}
FOUND_STYLE = {"color": BLUE, "linestyle": "-"}


def unique(values: pd.Series) -> list[str]:
    """Values in the order in which they first stand."""
    return list(dict.fromkeys(values))


def style(order: int) -> dict[str, str]:
    """How the first model and the one that was found are drawn, the same in all pictures."""
    return FIRST_STYLE if order == 0 else FOUND_STYLE


def short(model: str) -> str:
    """A model's name with room for a line break."""
    return model.replace("+", " + ")


def scale_errors(axis: Axes, errors: Any, levels: Iterable[float] = (), wide: float = WIDE) -> None:
    """An axis of errors [deg]: from 0, or logarithmic where they differ by more than so many times.

    Args:
        levels: that have to be seen too.
    """
    lowest, highest = np.nanmin(errors), np.nanmax(errors)
    if highest > wide * lowest:
        axis.set_yscale("log")
        axis.yaxis.set_major_formatter("{x:g}")
    else:
        axis.set_ylim(0, max(axis.get_ylim()[1], 1.08 * max(highest, *levels)))  # room for a whole marker


def draw_levels(axis: Axes, levels: Mapping[str, float]) -> None:
    """Errors [deg] that a model cannot go below, by what they are of: noise of the angle, and with that of the EMG."""
    for (label, level), color in zip(levels.items(), (MEASURED, GREY), strict=False):
        axis.axhline(level, color=color, linestyle=":", linewidth=2, label=label)


def legend(figure: Figure, axes: Iterable[Axes], *, columns: int, place: Place = "outside lower center") -> None:
    """One legend for all panels, below them or elsewhere."""
    handles = {label: handle for axis in axes for handle, label in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles.keys(), loc=place, ncols=columns, frameon=False)
