"""Pictures of a sweep: how the error fell, which settings matter, and where the good ones are.

Tables come in as `search.tabulate` makes them. Errors are free-running on held-out data, in degrees.
"""

from collections.abc import Mapping
from itertools import combinations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from myowave.learning.sweep.outcome import edge_of
from myowave.plotting import BLUE, GREY, ORANGE, RED, canvas, title
from myowave.settings import Dimension

ERROR = "held-out error [deg]"
_PAIRS = 6  # panels of a contour figure that can still be read
_WIDTH = 0.15  # of the kernel that smooths the map, in units of a range


def draw_history(table: pd.DataFrame, what: str) -> Figure:
    """Error of each trial in the order they were begun, and the best so far."""
    done, given_up = _complete(table), table[table["state"] == "pruned"]
    figure, axes = canvas(width=8.5, height=4.2)
    axis = axes[0, 0]
    axis.plot(given_up["trial"], _last_error(given_up), "x", color=GREY, label="given up")
    axis.plot(done["trial"], done["error"], "o", color=BLUE, label="tried to the end")
    axis.step(done["trial"], done["error"].cummin(), where="post", color=RED, label="best so far")
    _mark_default(axis, done, "trial")
    axis.set(xlabel="trial", ylabel=ERROR, yscale="log")
    axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.legend(loc="outside lower center", ncols=4, frameon=False)
    title(figure, f"{what}: {_finding(table)}")
    return figure


def draw_importance(importances: Mapping[str, float], what: str) -> Figure:
    """Share of the error's variance that each setting explains."""
    figure, axes = canvas(width=7.0, height=1.4 + 0.45 * max(2, len(importances)))
    axis = axes[0, 0]
    names = list(importances)[::-1]
    bars = axis.barh(names, [100 * importances[name] for name in names], color=BLUE, zorder=2)
    axis.bar_label(bars, fmt="%.0f %%", padding=3)
    axis.set(xlabel="share of the error's variance [%]", xlim=(0, 112))
    axis.grid(axis="y", visible=False)
    if importances:
        finding = f"{names[-1]} explains {100 * importances[names[-1]]:.0f} % of the differences in error"
    else:
        finding = "too few settings were tried to the end to tell which matter"
        axis.set_yticks([])
    title(figure, f"{what}: {finding}")
    return figure


def draw_slices(table: pd.DataFrame, dimensions: Mapping[str, Dimension], what: str) -> Figure:
    """Error against one setting at a time."""
    done, given_up = _complete(table), table[table["state"] == "pruned"]
    figure, axes = canvas(1, len(dimensions), width=max(7.0, 3.3 * len(dimensions)), height=4.0, sharey=True)
    for axis, (name, dimension) in zip(axes[0], dimensions.items(), strict=True):
        axis.plot(given_up[name], _last_error(given_up), "x", color=GREY, label="given up")
        axis.plot(done[name], done["error"], "o", color=BLUE, label="tried to the end")
        _mark_default(axis, done, name)
        best = done.loc[done["error"].idxmin()]
        axis.plot(best[name], best["error"], "*", color=RED, markersize=16, label="best", clip_on=False, zorder=5)
        axis.set(xlabel=name, yscale="log", xscale="log" if dimension.log else "linear", xlim=_limits(dimension))
    axes[0, 0].set_ylabel(ERROR)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    title(figure, f"{what}: best at {_best(done, dimensions)}")
    return figure


def draw_contours(
    table: pd.DataFrame, dimensions: Mapping[str, Dimension], importances: Mapping[str, float], what: str
) -> Figure:
    """Error over pairs of settings, smoothed between the trials; the most important pairs come first."""
    done = _complete(table)
    names = [*importances, *(name for name in dimensions if name not in importances)]
    pairs = sorted(combinations(names, 2), key=lambda pair: names.index(pair[0]) + names.index(pair[1]))[:_PAIRS]
    if not pairs:
        figure, _ = canvas(width=7.0, height=2.0)
        title(figure, f"{what}: one setting only; see its slice")
        return figure
    columns = min(3, len(pairs))
    rows = -(-len(pairs) // columns)
    figure, axes = canvas(rows, columns, width=max(7.0, 4.2 * columns), height=3.7 * rows + 0.4)
    low, high = np.log10([done["error"].min(), done["error"].quantile(0.9)])
    levels = np.linspace(low, high, 9)
    levels = levels if levels[-1] > levels[0] else levels[0] + np.linspace(0, 1e-3, 9)
    for axis, (x, y) in zip(axes.flat, pairs, strict=False):
        filled = _contour(axis, done, x, y, dimensions, levels)
    for axis in axes.flat[len(pairs) :]:
        axis.set_visible(False)
    bar = figure.colorbar(filled, ax=axes, shrink=0.9, label=ERROR)
    bar.set_ticks(levels[::2].tolist(), labels=[f"{10**level:.3g}" for level in levels[::2]])
    best = done.loc[done["error"].idxmin()]
    title(figure, f"{what}: least error {best['error']:.3g} deg at the star")
    return figure


def _contour(
    axis: Axes, done: pd.DataFrame, x: str, y: str, dimensions: Mapping[str, Dimension], levels: NDArray[np.float64]
) -> QuadContourSet:
    grid = np.linspace(0, 1, 60)
    smooth = _smooth(
        _unit(done[x], dimensions[x]), _unit(done[y], dimensions[y]), np.log10(done["error"].to_numpy()), grid
    )
    where = [_value(grid, dimensions[name]) for name in (x, y)]
    filled = axis.contourf(*where, smooth, levels=levels, cmap="viridis_r", extend="both")
    axis.plot(done[x], done[y], "o", color="white", markeredgecolor=GREY, markersize=5, clip_on=False, zorder=3)
    _mark_default(axis, done, x, y)
    best = done.loc[done["error"].idxmin()]
    axis.plot(best[x], best[y], "*", color=RED, markersize=16, markeredgecolor="white", clip_on=False, zorder=5)
    scales = {f"{a}scale": "log" if dimensions[name].log else "linear" for a, name in (("x", x), ("y", y))}
    axis.set(xlabel=x, ylabel=y, xlim=_limits(dimensions[x], 0.0), ylim=_limits(dimensions[y], 0.0), **scales)
    axis.grid(visible=False)
    return filled


def _smooth(u: np.ndarray, v: np.ndarray, values: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Kernel mean of scattered values on a square grid, (G, G); coordinates in [0, 1]."""
    distance = (grid[None, :, None] - u) ** 2 + (grid[:, None, None] - v) ** 2
    exponent = -distance / (2 * _WIDTH**2)
    weight = np.exp(exponent - exponent.max(axis=-1, keepdims=True))
    return (weight * values).sum(axis=-1) / weight.sum(axis=-1)


def _unit(values: pd.Series, dimension: Dimension) -> np.ndarray:
    """Values of a setting with its range as [0, 1]."""
    ends = np.array([dimension.low, dimension.high])
    numbers = values.to_numpy(dtype=float)
    if dimension.log:
        ends, numbers = np.log(ends), np.log(numbers)
    return (numbers - ends[0]) / (ends[1] - ends[0])


def _value(unit: np.ndarray, dimension: Dimension) -> np.ndarray:
    """Inverse of `_unit`."""
    if dimension.log:
        return dimension.low * (dimension.high / dimension.low) ** unit
    return dimension.low + (dimension.high - dimension.low) * unit


def _limits(dimension: Dimension, margin: float = 0.06) -> tuple[float, float]:
    low, high = _value(np.array([-margin, 1 + margin]), dimension)
    return float(low), float(high)


def _complete(table: pd.DataFrame) -> pd.DataFrame:
    return table[table["state"] == "complete"]


def _last_error(table: pd.DataFrame) -> pd.Series:
    """Mean error at the last judgement that each trial reached."""
    judged = sorted((c for c in table.columns if c.startswith("left_")), key=lambda c: -int(c.removeprefix("left_")))
    return table[judged].ffill(axis=1).iloc[:, -1] if len(judged) else table["error"]


def _mark_default(axis: Axes, done: pd.DataFrame, x: str, y: str = "error") -> None:
    default = done[done["is_default"]]
    axis.plot(default[x], default[y], "s", color=ORANGE, markersize=9, label="default", clip_on=False, zorder=4)


def _finding(table: pd.DataFrame) -> str:
    done = _complete(table)
    default = done.loc[done["is_default"], "error"]
    against = f", the default by {default.iloc[0]:.3g}" if len(default) else ""
    tried = table["state"].isin(["complete", "pruned"]).sum()
    return f"best of {tried} settings errs by {done['error'].min():.3g} deg on held-out data{against}"


def _best(done: pd.DataFrame, dimensions: Mapping[str, Dimension]) -> str:
    """The best settings in words, with a warning where one lies at an edge of its range."""
    best = done.loc[done["error"].idxmin()]
    edges = {name: edge_of(dimension, best[name]) for name, dimension in dimensions.items()}
    return ", ".join(
        f"{name} {_short(best[name])}" + (f" ({edge} edge)" if edge else "") for name, edge in edges.items()
    )


def _short(value: float) -> str:
    return f"{value:.2g}" if value != int(value) else str(int(value))
