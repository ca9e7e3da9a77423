"""Where: missing torque over angle and velocity."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.report.figures.style import short, unique
from myowave.plotting import canvas


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
