"""How figures look: one style, one palette, one way to save. Drawing itself stands in the layers' `figures` modules.

Colours are Okabe & Ito's (2008), told apart with any common colour blindness; lines that must be told apart also
differ in style or are named at their end.
"""

from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backend_bases import FigureCanvasBase
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler
from numpy.typing import ArrayLike, NDArray
from PIL import Image

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, RED, PINK, GREY = "#0072B2", "#D55E00", "#CC79A7", "#6b6b6b"
CYCLE = (BLUE, RED, GREEN, PINK, ORANGE, SKY, BLACK)
MEASURED, MODEL = BLACK, RED

STYLE: dict[Any, Any] = {
    "figure.dpi": 110,
    "savefig.dpi": 160,
    "font.size": 11,
    "axes.titlesize": 12,
    "axes.labelsize": 11,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.7,
    "axes.prop_cycle": cycler(color=CYCLE),
    "figure.constrained_layout.use": True,
}


def canvas(
    rows: int = 1, columns: int = 1, *, width: float = 9.0, height: float = 4.0, **kwargs: Any
) -> tuple[Figure, NDArray[Any]]:
    """A figure in the project's style and its axes, a (rows, columns) array; size in inches."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        axes = figure.subplots(rows, columns, squeeze=False, **kwargs)
    return figure, axes


def title(figure: Figure, finding: str) -> None:
    """What the figure shows, in a sentence, over all of it."""
    figure.suptitle(finding, x=0.01, ha="left", fontsize=13, fontweight="bold", wrap=True)


def shade(axes: Axes, x: ArrayLike, low: Any, middle: Any, high: Any, *, color: str, **kwargs: Any) -> None:
    """A line with a band from low to high."""
    axes.plot(x, middle, color=color, **kwargs)
    axes.fill_between(x, low, high, color=color, alpha=0.22, linewidth=0)


def require_format(path: Path) -> None:
    """Raise a ValueError where the ending names no format that a figure can be written in."""
    if path.suffix[1:].lower() not in (formats := FigureCanvasBase.get_supported_filetypes()):
        raise ValueError(f"{path}: the ending is {path.suffix!r}; expected .png, or one of {', '.join(formats)}.")


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure, in the format its ending names; a PNG with 256 colours, a third as large as with all."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context(STYLE):
        if path.suffix != ".png":
            figure.savefig(path)
            return
        drawn = BytesIO()
        figure.savefig(drawn, format="png")
    with Image.open(drawn) as image:
        few = image.convert("RGB").quantize(256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    few.save(path, dpi=(STYLE["savefig.dpi"],) * 2)
