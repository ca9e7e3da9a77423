"""What the pictures of a diagnosis share: how a model is drawn and called, axes, levels of noise and the legend."""

from collections.abc import Iterable, Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from myowave.plotting import BLUE, GREY, MEASURED, MODEL

FIRST_STYLE = {"color": MODEL, "linestyle": "--"}
FOUND_STYLE = {"color": BLUE, "linestyle": "-"}


def style(order: int) -> dict[str, str]:
    """How the first model and the one that was found are drawn, the same in all pictures."""
    return FIRST_STYLE if order == 0 else FOUND_STYLE


def short(model: str) -> str:
    """A model's name with room for a line break."""
    return model.replace("+", " + ")


def draw_levels(axis: Axes, levels: Mapping[str, float]) -> None:
    """Errors [deg] that a model cannot go below, by what they are of: noise of the angle, and with that of the EMG."""
    for (label, level), color in zip(levels.items(), (MEASURED, GREY), strict=False):
        axis.axhline(level, color=color, linestyle=":", linewidth=2, label=label)


def legend(figure: Figure, axes: Iterable[Axes], *, columns: int) -> None:
    """One legend for all panels, below them."""
    handles = {label: handle for axis in axes for handle, label in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=columns, frameon=False)
