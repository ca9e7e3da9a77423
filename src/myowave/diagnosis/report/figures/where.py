"""Where: error in parts of the data, missing torque over angle and velocity."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.report.figures.style import WIDE, legend, short, style, together, unique, whiskers
from myowave.plotting import MEASURED, canvas, title

LETTERS = 30  # of the names below a panel, beside one another


def draw_misfit(misfit: pd.DataFrame, noise_deg: float, where: str) -> Figure:
    """RMSE in parts of the training data: by trial, direction, speed, angle, activation and time.

    Args:
        misfit: columns model, factor, part, rmse_deg, rmse_low_deg, rmse_high_deg (95 % interval).
        where: the findings, the strongest first.
    """
    models = unique(misfit["model"])
    factors = together(misfit, "factor", ("model", "part", "rmse_deg", "rmse_low_deg", "rmse_high_deg"))
    columns = 4
    figure, axes = canvas(
        -(-len(factors) // columns), columns, width=12, height=2.9 * -(-len(factors) // columns) + 1.0, sharey=True
    )
    wide = misfit["rmse_deg"].max() > WIDE * misfit["rmse_deg"][misfit["rmse_deg"] > 0].min()
    for axis, factor in zip(axes.flat, factors, strict=False):
        for order, model in enumerate(models):
            rows = misfit[(misfit["factor"] == factor) & (misfit["model"] == model)]
            x = np.arange(len(rows)) + (order - (len(models) - 1) / 2) * 0.25
            intervals = list(zip(rows["rmse_low_deg"], rows["rmse_high_deg"], strict=True))
            whiskers(axis, x, rows["rmse_deg"], intervals, color=style(order)["color"], order=order, name=model)
            if order == 0:
                names = [str(part).removeprefix("trial").replace(" to ", "\nto ") for part in rows["part"]]
                crowded = sum(map(len, names)) > LETTERS and "\n" not in names[0]
                turned = {"rotation": 35, "ha": "right", "rotation_mode": "anchor"} if crowded else {}
                axis.set_xticks(range(len(rows)), names, fontsize=9, **turned)
        axis.axhline(noise_deg, color=MEASURED, linestyle=":", linewidth=1.8, label="noise")
        axis.set_title(factors[factor])
        axis.margins(x=0.12)
        axis.grid(axis="x", visible=False)
        if wide:
            axis.set_yscale("log")
            axis.yaxis.set_major_formatter("{x:g}")
    if not wide:  # once all is drawn: the panels share their limits
        axes[0, 0].set_ylim(bottom=0)
    for axis in list(axes.flat)[len(factors) :]:
        axis.set_visible(False)
    for axis in axes[:, 0]:
        axis.set_ylabel("RMSE [deg]")
    legend(figure, axes[0, 0], columns=3)
    title(figure, where.split(". ")[0].rstrip("."))
    return figure


def draw_missing_torque(cells: pd.DataFrame) -> Figure:
    """Torque that each model would have to add, over angle and velocity.

    Args:
        cells: columns model, angle_rad, velocity_rad_s (centres), torque_Nm, windows.
    """
    if cells.empty:
        figure, axes = canvas(1, 1, width=5.8, height=4.4)
        axes[0, 0].set(xlabel="elbow angle [deg]", ylabel="angular velocity [deg/s]")
        title(figure, "The trials are too short for a map of missing torque")
        return figure
    models = unique(cells["model"])
    figure, axes = canvas(1, len(models), width=4.2 * len(models) + 1.6, height=4.4, sharex=True, sharey=True)
    limit = max(float(cells[cells["model"].isin(models)]["torque_Nm"].abs().max()), 1e-3)
    for axis, model in zip(axes[0], models, strict=True):
        angles, velocities, torque = _grid(cells[cells["model"] == model])
        image = axis.pcolormesh(angles, velocities, torque, cmap="RdBu_r", vmin=-limit, vmax=limit)
        axis.set(xlabel="elbow angle [deg]", title=short(model), facecolor="#f2f2f2")
        axis.grid(visible=False)
    axes[0, 0].set_ylabel("angular velocity [deg/s]")
    figure.colorbar(image, ax=axes, label="missing torque [N m]\n(positive: towards flexion)", shrink=0.9)
    worst = cells.loc[cells[cells["model"] == models[0]]["torque_Nm"].abs().idxmax()]
    place = f"{np.degrees(worst['angle_rad']):.0f} deg and {np.degrees(worst['velocity_rad_s']):.0f} deg/s"
    title(figure, f"{short(models[0])} lacks most, {worst['torque_Nm']:+.2g} N m, at {place}")
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
