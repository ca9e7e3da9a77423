"""Where: missing torque over angle and velocity."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.report.figures.style import short
from myowave.plotting import canvas

WINDOWS_A_CELL, MOST_CELLS = 5, 12  # the map is as fine as so many windows in a cell, on average, allow
FEWEST = 3  # windows in a cell of the map


def draw_missing_torque(windows: pd.DataFrame) -> Figure:
    """Torque that each model would have to add, over angle and velocity; an empty picture where trials are too short.

    Args:
        windows: columns model, angle_rad, velocity_rad_s, torque_Nm.
    """
    models = list(windows["model"].unique()) or ["no trial is long enough for a window"]
    figure, axes = canvas(1, len(models), width=4.2 * len(models) + 1.6, height=4.4, sharex=True, sharey=True)
    maps = []
    for axis, model in zip(axes[0], models, strict=True):
        axis.set(xlabel="elbow angle [deg]", title=short(model), facecolor="#e2e2e2")
        axis.grid(visible=False)
        rows = windows[windows["model"] == model]
        if len(rows):
            cells = int(np.clip(np.sqrt(len(rows) / WINDOWS_A_CELL), 2, MOST_CELLS))
            place = np.degrees(rows["angle_rad"]), np.degrees(rows["velocity_rad_s"])
            maps.append(
                axis.hexbin(*place, rows["torque_Nm"], gridsize=cells, mincnt=FEWEST, cmap="RdBu_r", linewidths=0.2)
            )
    axes[0, 0].set_ylabel("angular velocity [deg/s]")
    if maps:
        limit = max(1e-3, *(np.abs(np.ma.getdata(m.get_array())).max(initial=0.0) for m in maps))
        for m in maps:
            m.set_clim(-limit, limit)
        figure.colorbar(maps[0], ax=axes, label="missing torque [N m]\n(positive: towards flexion)", shrink=0.9)
    return figure
