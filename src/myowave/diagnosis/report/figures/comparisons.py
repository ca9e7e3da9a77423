"""Torque along the measured motion, error against the horizon, and whole trials at its end."""

from itertools import cycle
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from myowave.diagnosis.comparison.names import EMG_ONLY, HOLD, NOISE, POSTURE, POSTURE_LOAD, SAME_SPEED
from myowave.diagnosis.comparison.telling import best_rival, explained, missed, named_horizon, r2_text
from myowave.diagnosis.report.figures.style import draw_noise, legend, short, style, unique
from myowave.plotting import BLACK, BLUE, GREEN, GREY, MEASURED, MODEL, ORANGE, PINK, canvas, title

LOWEST_R2 = -0.5  # what explains less stands at the edge
BASELINES = {
    HOLD: {"color": GREY, "linestyle": ":", "marker": "v"},
    SAME_SPEED: {"color": PINK, "linestyle": ":", "marker": "^"},
    POSTURE: {"color": ORANGE, "linestyle": "-.", "marker": "D"},
    EMG_ONLY: {"color": GREEN, "linestyle": "-.", "marker": "s"},
}
OFFSET = 0.13  # between training and held-out trials


def draw_torque(torque: pd.DataFrame, found: str) -> Figure:
    """Share of the needed torque that each predictor explains, and what is missing, one dot per trial.

    Args:
        torque: columns model, trial, held_out, rmse_Nm, r2.
        found: the model that was found.
    """
    names = [*(n for n in (POSTURE, POSTURE_LOAD, EMG_ONLY) if n in set(torque["model"])), *_models(torque["model"])]
    figure, axes = canvas(1, 2, width=12.0, height=1.2 + 0.62 * (len(names) + 2), sharey=True)
    share, missing = axes[0]
    for axis, column, lowest in ((share, "r2", LOWEST_R2), (missing, "rmse_Nm", 0.0)):
        for held_out, color, marker, label in (
            (False, BLUE, "o", "training trials"),
            (True, MODEL, "s", "held-out trials"),
        ):
            rows = torque[(torque["held_out"] == held_out) & torque["model"].isin(names)].dropna(subset=column)
            y = rows["model"].map(names.index) + (OFFSET if held_out else -OFFSET)
            look = {
                "color": color,
                "marker": marker,
                "markersize": 6.5,
                "linestyle": "none",
                "alpha": 0.85,
                "clip_on": False,
            }
            kept = rows[column].replace([np.inf, -np.inf], np.nan).clip(lower=lowest)
            axis.plot(kept, y, label=label, **look)
        noise = torque[torque["model"] == NOISE][column]
        if len(noise):
            axis.axvspan(
                noise.min(), noise.max(), color=MEASURED, alpha=0.3, lw=1.5, zorder=0, label="noise of the angle"
            )
        axis.grid(axis="y", visible=False)
        axis.tick_params(axis="y", length=0)
    share.set_yticks(range(len(names)), [short(n) for n in names])
    share.set_ylim(len(names) - 0.5, -0.5)
    share.set_xlim(min(-0.05, torque["r2"].clip(lower=LOWEST_R2).min() - 0.04), 1.03)
    share.set_xlabel("$R^2$ of the torque that the motion needs [-]")
    missing.set_xlim(left=0)
    missing.set_xlabel("torque that is missing, RMS [N m]")
    for (name, held_out), r2 in torque[torque["r2"] < LOWEST_R2].groupby(["model", "held_out"])["r2"]:
        if name in names:
            place = names.index(name) + (OFFSET if held_out else -OFFSET)
            ends = dict.fromkeys(f"{value:.2g}" for value in (r2.min(), r2.max()))
            text = "torque overflows" if np.isinf(r2).any() else " to ".join(ends)
            share.annotate(text, (LOWEST_R2, place), (8, -3), textcoords="offset points", fontsize=9)
    legend(figure, share, columns=3)
    where, r2 = explained(torque)
    first = torque["model"].iloc[0]
    told = f"the muscles of {first} explain R² {r2_text(r2[first])} of the torque, "
    told += f"posture and speed {r2_text(r2[POSTURE])}"
    added = f"; with what was found {r2_text(r2[found])}" if found != first else ""
    title(figure, f"{where} {told}{added}")
    return figure


def draw_horizons(horizons: pd.DataFrame, noise_deg: float, noise: str, networks: pd.DataFrame, found: str) -> Figure:
    """Error against the horizon, of the first model, of the one that was found, and of the predictors to beat.

    Args:
        horizons: columns predictor, horizon_s, held_out, rmse_deg; whole trials have horizon inf.
        noise: of the angle, in words.
        networks: columns source, heldout_rmse_deg of the networks trained with these models, for whole trials.
        found: the model that was found.
    """
    times = sorted(h for h in horizons["horizon_s"].unique() if np.isfinite(h))
    place = {h: i for i, h in enumerate(times)} | {np.inf: len(times) + 0.4}
    first = horizons["predictor"].iloc[0]
    parts = [p for p in (False, True) if (horizons["held_out"] == p).any()]
    figure, axes = canvas(1, len(parts), width=6.0 * len(parts), height=4.9, sharey=True)
    for axis, held_out in zip(axes[0], parts, strict=True):
        rows = horizons[horizons["held_out"] == held_out]
        for name, look in BASELINES.items():
            _draw_line(axis, rows[rows["predictor"] == name], place, {**look, "label": name, "markersize": 4.5})
        for order, name in enumerate(dict.fromkeys([first, found])):
            own = rows[rows["predictor"] == name]
            overflows = " (overflows where there is no line)" * bool(np.isinf(own["rmse_deg"]).any())
            look = {"marker": "o", "linewidth": 2.4, "label": short(name) + overflows, **style(order)}
            _draw_line(axis, own, place, look)
        if held_out:
            for (source, errors), marker in zip(networks.groupby("source", sort=False), cycle("x+1*"), strict=False):
                x = np.full(len(errors), place[np.inf])
                axis.plot(x, errors["heldout_rmse_deg"], linestyle="none", marker=marker, color=BLACK, label=source)
        draw_noise(axis, noise_deg, noise)
        axis.axvline(len(times) - 0.3, color=GREY, linewidth=0.8)
        axis.set_yscale("log")
        axis.yaxis.set_major_formatter("{x:g}")
        axis.set_xticks(list(place.values()), [*(f"{h:g}" for h in times), "whole\ntrial"])
        axis.set_xlabel("horizon after a measured state [s]")
        axis.set_title("held-out trials" if held_out else "training trials")
    axes[0, 0].set_ylabel("RMSE [deg]")
    legend(figure, axes[0, -1], columns=4)
    title(figure, _finding(horizons, first, found))
    return figure


def _draw_line(axis: Axes, rows: pd.DataFrame, place: dict[float, float], look: dict[str, Any]) -> None:
    """A predictor's errors, whole trials apart from the horizons; what is infinite is not drawn."""
    rows = rows[np.isfinite(rows["rmse_deg"])]
    near, far = rows[np.isfinite(rows["horizon_s"])], rows[~np.isfinite(rows["horizon_s"])]
    axis.plot(near["horizon_s"].map(place), near["rmse_deg"], **look)
    axis.plot(far["horizon_s"].map(place), far["rmse_deg"], **{**look, "label": None})


def _finding(horizons: pd.DataFrame, first: str, found: str) -> str:
    """What half a second does to the first model, to what was found, and to the best predictor without a model."""
    where, rmse = missed(horizons)
    horizon = named_horizon(rmse)
    if horizon is None:
        return "The trials are too short to predict over short horizons"
    texts = [f"{short(model)} misses by {rmse.loc[model, horizon]:.2g} deg" for model in dict.fromkeys([first, found])]
    texts.append(f"the best without a model of the arm by {rmse.loc[best_rival(rmse, horizon), horizon]:.2g}")
    return f"{where}, {horizon:g} s after a measured state {', '.join(texts)}"


def _models(names: pd.Series) -> list[str]:
    return [n for n in unique(names) if n not in (*BASELINES, POSTURE_LOAD, NOISE)]
