"""Where: error in parts of the data, missing torque over angle and velocity."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.report.figures.style import (
    draw_levels,
    legend,
    scale_errors,
    short,
    style,
    together,
    unique,
    whiskers,
)
from myowave.plotting import canvas

LETTERS = 30  # of the names below a panel, beside one another
COLUMNS = 4


def draw_misfit(misfit: pd.DataFrame, levels: Mapping[str, float]) -> Figure:
    """RMSE in parts of the training data: by trial, direction, speed, angle, activation and time.

    Args:
        misfit: columns model, factor, part, rmse_deg, rmse_low_deg, rmse_high_deg (95 % interval).
        levels: errors of noise [deg], see `draw_levels`.
    """
    models = unique(misfit["model"])
    factors = together(misfit, "factor", ("model", "part", "rmse_deg", "rmse_low_deg", "rmse_high_deg"))
    lines = -(-len(factors) // COLUMNS)
    figure, axes = canvas(lines, COLUMNS, width=12, height=2.9 * lines + 1.0, sharey=True)
    for axis, factor in zip(axes.flat, factors, strict=False):
        for order, model in enumerate(models):
            rows = misfit[(misfit["factor"] == factor) & (misfit["model"] == model)]
            x = np.arange(len(rows)) + (order - (len(models) - 1) / 2) * 0.25
            whiskers(axis, x, rows, color=style(order)["color"], order=order, name=model)
        names = [str(part).removeprefix("trial").replace(" to ", "\nto ") for part in rows["part"]]
        crowded = sum(map(len, names)) > LETTERS and "\n" not in names[0]
        turned = {"rotation": 35, "ha": "right", "rotation_mode": "anchor"} if crowded else {}
        axis.set_xticks(range(len(rows)), names, fontsize=9, **turned)
        draw_levels(axis, levels)
        axis.set_title(factors[factor])
        axis.margins(x=0.12)
        axis.grid(axis="x", visible=False)
    errors = misfit["rmse_deg"].where(misfit["rmse_deg"] > 0)
    scale_errors(axes[0, 0], errors, levels.values())  # the panels share their limits
    for axis in list(axes.flat)[len(factors) :]:
        axis.set_visible(False)
    for axis in axes[:, 0]:
        axis.set_ylabel("RMSE [deg]")
    legend(figure, [axes[0, 0]], columns=3)
    return figure


def draw_missing_torque(cells: pd.DataFrame) -> Figure:
    """Torque that each model would have to add, over angle and velocity; an empty picture where trials are too short.

    Args:
        cells: columns model, angle_rad, velocity_rad_s (centres), torque_Nm, windows.
    """
    models = unique(cells["model"]) or ["no cell of the map has enough windows"]
    figure, axes = canvas(1, len(models), width=4.2 * len(models) + 1.6, height=4.4, sharex=True, sharey=True)
    limit = max(float(cells["torque_Nm"].abs().max()), 1e-3) if len(cells) else 1.0
    for axis, model in zip(axes[0], models, strict=True):
        axis.set(xlabel="elbow angle [deg]", title=short(model), facecolor="#f2f2f2")
        axis.grid(visible=False)
        if len(cells):
            angles, velocities, torque = _grid(cells[cells["model"] == model])
            image = axis.pcolormesh(angles, velocities, torque, cmap="RdBu_r", vmin=-limit, vmax=limit)
    axes[0, 0].set_ylabel("angular velocity [deg/s]")
    if len(cells):
        figure.colorbar(image, ax=axes, label="missing torque [N m]\n(positive: towards flexion)", shrink=0.9)
    return figure


def _grid(cells: pd.DataFrame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges [deg], [deg/s] and values of a map whose empty cells are not listed."""
    edges, places = [], []
    for column in ("angle_rad", "velocity_rad_s"):
        centres = np.sort(cells[column].unique())
        step = np.diff(centres).min() if len(centres) > 1 else 0.1
        count = round((centres[-1] - centres[0]) / step) + 1
        edges.append(np.degrees(centres[0] + step * (np.arange(count + 1) - 0.5)))
        places.append(np.round((cells[column] - centres[0]) / step).astype(int))
    torque = np.full((len(edges[1]) - 1, len(edges[0]) - 1), np.nan)
    torque[places[1], places[0]] = cells["torque_Nm"]
    return edges[0], edges[1], torque
