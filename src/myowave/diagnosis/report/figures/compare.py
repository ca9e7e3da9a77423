"""Compare: measured and simulated motion, errors by trial, correlated estimates."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.report.figures.style import (
    draw_levels,
    legend,
    ramp,
    scale_errors,
    short,
    style,
    unique,
    whiskers,
)
from myowave.plotting import GREY, MEASURED, canvas

_READABLE = 10  # parameters whose correlations can be read side by side
ROLES = {"train": "training", "test": "held out"}


def draw_overlay(predictions: pd.DataFrame) -> Figure:
    """Measured and simulated angle of every trial, and what is left, one column per trial.

    Args:
        predictions: columns model, trial, role, time_s, angle_rad, predicted_rad.
    """
    trials = unique(predictions["trial"])
    heights = {"height_ratios": [3, 2]}
    width = max(8.0, 2.9 * len(trials))
    figure, axes = canvas(2, len(trials), width=width, height=4.9, sharex="col", sharey="row", gridspec_kw=heights)
    for (top, bottom), (trial, rows) in zip(axes.T, predictions.groupby("trial", sort=False), strict=True):
        for order, (model, one) in enumerate(rows.groupby("model", sort=False)):
            measured, predicted = np.degrees(one["angle_rad"]), np.degrees(one["predicted_rad"])
            if order == 0:
                top.plot(one["time_s"], measured, color=MEASURED, linewidth=2.2, label="measured")
            top.plot(one["time_s"], predicted, linewidth=1.2, label=short(str(model)), **style(order))
            bottom.plot(one["time_s"], measured - predicted, color=style(order)["color"], linewidth=0.8)
        bottom.axhline(0, color=GREY, linewidth=0.8)
        top.set_title(f"trial {_trial(trial)}, {ROLES[rows['role'].iloc[0]]}")
        bottom.set_xlabel("time [s]")
    axes[0, 0].set_ylabel("elbow angle [deg]")
    axes[1, 0].set_ylabel("measured -\nsimulated [deg]")
    legend(figure, axes[:1, 0], columns=3)
    return figure


def draw_errors(errors: pd.DataFrame, found: str, levels: Mapping[str, float]) -> Figure:
    """RMSE of every model on every trial, with 95 % intervals, against the noise of the measurement.

    Args:
        errors: columns model, trial, role, rmse_deg, rmse_low_deg, rmse_high_deg (95 % interval).
        found: the model that was found.
        levels: errors of noise [deg], see `draw_levels`.
    """
    models, trials = unique(errors["model"]), unique(errors["trial"])
    widest = max(1.6, 0.1 * max(len(f"trial {_trial(t)}") for t in trials))
    figure, axes = canvas(1, 1, width=max(7.0, widest * len(trials) + 2), height=4.0)
    axis, width = axes[0, 0], 0.8 / len(models)
    for i, (model, color) in enumerate(zip(models, ramp(models, found), strict=True)):
        rows = errors[errors["model"] == model].set_index("trial").loc[trials]
        x = np.arange(len(trials)) + (i + 0.5) * width - 0.4
        whiskers(axis, x, rows, color=color, order=i, name=model)
    draw_levels(axis, levels)
    scale_errors(axis, errors["rmse_deg"], levels.values())
    axis.grid(axis="x", visible=False)
    roles = errors.drop_duplicates("trial").set_index("trial")["role"]
    axis.set_xticks(range(len(trials)), [f"trial {_trial(t)}\n{ROLES[roles[t]]}" for t in trials])
    axis.set_ylabel("RMSE [deg], 95 % interval")
    legend(figure, [axis], columns=2)
    return figure


def draw_correlations(correlations: pd.DataFrame) -> Figure:
    """Correlation of the estimates of the parameters, of the first and of the last model; of many those most alike."""
    models = unique(correlations["model"])
    figure, axes = canvas(1, len(models), width=4.6 * len(models) + 1.0, height=4.6)
    for axis, model in zip(axes[0], models, strict=True):
        table = correlations[correlations["model"] == model]
        every = unique(table["parameter"])
        square = table.pivot(index="parameter", columns="other", values="correlation").loc[every, every]
        names = _most_alike(square)
        matrix = square.loc[names, names].to_numpy()
        image = axis.imshow(matrix, cmap="RdBu_r", vmin=-1, vmax=1)
        ticks = [name.replace(".", ".\n") for name in names]
        axis.set_xticks(range(len(names)), ticks, rotation=60, ha="right", fontsize=9)
        axis.set_yticks(range(len(names)), ticks, fontsize=9)
        axis.grid(visible=False)
        for (i, j), value in np.ndenumerate(matrix):
            color = "w" if abs(value) > 0.6 else "k"
            axis.text(j, i, f"{round(value, 1) + 0.0:.1f}", ha="center", va="center", fontsize=8, color=color)
        axis.set_title(short(model) + (f": {len(names)} of {len(every)} parameters" if len(names) < len(every) else ""))
    figure.colorbar(image, ax=axes, label="correlation [-]", shrink=0.8)
    return figure


def _most_alike(square: pd.DataFrame) -> list[str]:
    """The parameters with the strongest correlations, in their order; more than a picture has room for are left out."""
    strength = (square.abs() - np.eye(len(square))).max()
    kept = strength.sort_values(ascending=False, kind="stable").index[:_READABLE]
    return [name for name in square.index if name in set(kept)]


def _trial(name: object) -> str:
    return str(name).removeprefix("trial")
