"""Compare: measured and simulated motion, errors by trial, what the residual depends on, correlated estimates."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.report.figures.style import (
    WIDE,
    draw_noise,
    legend,
    ramp,
    short,
    style,
    unique,
    whiskers,
)
from myowave.diagnosis.report.words import degrees
from myowave.plotting import GREY, MEASURED, canvas, title

_READABLE = 10  # parameters whose correlations can be read side by side


def draw_overlay(predictions: pd.DataFrame, errors: pd.DataFrame, noise: str) -> Figure:
    """Measured and simulated angle of every trial, and what is left, one column per trial.

    Args:
        predictions: columns model, trial, role, time_s, angle_rad, predicted_rad.
        errors: columns model, trial, role, rmse_deg, rmse_low_deg, rmse_high_deg (95 % interval), r2, noise_deg.
        noise: of the angle, in words.
    """
    models = unique(predictions["model"])
    trials = unique(predictions["trial"])
    figure, axes = canvas(
        2,
        len(trials),
        width=max(8.0, 2.9 * len(trials)),
        height=4.9,
        sharex="col",
        sharey="row",
        gridspec_kw={"height_ratios": [3, 2]},
    )
    for column, trial in enumerate(trials):
        rows = predictions[predictions["trial"] == trial]
        top, bottom = axes[:, column]
        for order, model in enumerate(models):
            one, look = rows[rows["model"] == model], style(order)
            if order == 0:
                top.plot(one["time_s"], np.degrees(one["angle_rad"]), color=MEASURED, linewidth=2.2, label="measured")
            top.plot(one["time_s"], np.degrees(one["predicted_rad"]), linewidth=1.2, label=short(model), **look)
            left = np.degrees(one["angle_rad"] - one["predicted_rad"])
            bottom.plot(one["time_s"], left, color=look["color"], linewidth=0.8)
        bottom.axhline(0, color=GREY, linewidth=0.8)
        role = "training" if rows["role"].iloc[0] == "train" else "held out"
        top.set_title(f"trial {_trial(trial)}, {role}")
        bottom.set_xlabel("time [s]")
    axes[0, 0].set_ylabel("elbow angle [deg]")
    axes[1, 0].set_ylabel("measured -\nsimulated [deg]")
    legend(figure, axes[0, 0], columns=3)
    by_model = errors.groupby("model", sort=False)["rmse_deg"]
    ranges = [f"{short(m)} misses by {by_model.min()[m]:.2g} to {degrees(by_model.max()[m])}" for m in models]
    title(figure, f"By trial, {'; '.join(ranges)}; noise is {noise}")
    return figure


def draw_errors(
    errors: pd.DataFrame, heldout_deg: Mapping[str, float], found: str, noise: str, with_emg: float | None = None
) -> Figure:
    """RMSE of every model on every trial, with 95 % intervals, against the noise of the measurement.

    Args:
        errors: as in `draw_overlay`, of every model.
        heldout_deg: RMSE of each model over all held-out trials.
        found: the model that was found.
        noise: of the angle, in words.
        with_emg: what this and noise of the recorded EMG make together [deg]; none where the EMG has none.
    """
    models, trials = unique(errors["model"]), unique(errors["trial"])
    level = errors["noise_deg"].iloc[0]
    widest = max(1.6, 0.1 * max(len(f"trial {_trial(t)}") for t in trials))
    figure, axes = canvas(1, 1, width=max(7.0, widest * len(trials) + 2), height=4.0)
    axis, width = axes[0, 0], 0.8 / len(models)
    for i, (model, color) in enumerate(zip(models, ramp(models, found), strict=True)):
        rows = errors[errors["model"] == model].set_index("trial").loc[trials]
        x = np.arange(len(trials)) + (i + 0.5) * width - 0.4
        intervals = list(zip(rows["rmse_low_deg"], rows["rmse_high_deg"], strict=True))
        whiskers(axis, x, rows["rmse_deg"], intervals, color=color, order=i, name=model)
    draw_noise(axis, level, noise, with_emg)
    if errors["rmse_deg"].max() > WIDE * errors["rmse_deg"].min():
        axis.set_yscale("log")
        axis.yaxis.set_major_formatter("{x:g}")
    else:
        axis.set_ylim(bottom=0)
    axis.grid(axis="x", visible=False)
    roles = errors.drop_duplicates("trial").set_index("trial")["role"]
    names = [f"trial {_trial(t)}\n{'held out' if roles[t] == 'test' else 'training'}" for t in trials]
    axis.set_xticks(range(len(trials)), names)
    axis.set_ylabel("RMSE [deg], 95 % interval")
    legend(figure, axis, columns=2)
    texts = [f"{short(m)} misses by {degrees(heldout_deg[m])}" for m in dict.fromkeys((models[0], found))]
    title(figure, f"On held-out trials {', '.join(texts)}; noise is {noise}")
    return figure


def draw_correlations(correlations: pd.DataFrame) -> Figure:
    """Correlation of the estimates of the parameters, of the first and of the last model; of many those most alike."""
    models = unique(correlations["model"])
    figure, axes = canvas(1, len(models), width=4.6 * len(models) + 1.0, height=4.6)
    worst = []
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
            axis.text(
                j,
                i,
                f"{round(value, 1) + 0.0:.1f}",
                ha="center",
                va="center",
                fontsize=8,
                color="w" if abs(value) > 0.6 else "k",
            )
        axis.set_title(short(model) + (f": {len(names)} of {len(every)} parameters" if len(names) < len(every) else ""))
        off = np.triu(np.abs(matrix), 1)
        i, j = np.unravel_index(off.argmax(), off.shape)
        worst.append(f"{names[i]} and {names[j]} ({matrix[i, j]:+.2f}) in {short(model)}")
    figure.colorbar(image, ax=axes, label="correlation [-]", shrink=0.8)
    title(figure, f"Estimates most alike: {'; '.join(worst)}")
    return figure


def _most_alike(square: pd.DataFrame) -> list[str]:
    """The parameters with the strongest correlations, in their order; more than a picture has room for are left out."""
    strength = (square.abs() - np.eye(len(square))).max()
    kept = strength.sort_values(ascending=False, kind="stable").index[:_READABLE]
    return [name for name in square.index if name in set(kept)]


def _trial(name: object) -> str:
    return str(name).removeprefix("trial")
