"""Comparisons with trials: torque along the measured motion, error against the horizon, and whole trials at its end."""

from collections.abc import Mapping
from itertools import cycle

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.comparison.baselines import EMG_ONLY, HOLD, NOISE, POSTURE, POSTURE_LOAD, SAME_SPEED
from myowave.diagnosis.report.figures.style import draw_levels, legend, short, style
from myowave.plotting import BLACK, BLUE, GREEN, GREY, MEASURED, MODEL, ORANGE, PINK, canvas

LOWEST_R2 = -0.5  # what explains less stands at the edge
BASELINES = {
    HOLD: {"color": GREY, "linestyle": ":", "marker": "v", "markersize": 4.5},
    SAME_SPEED: {"color": PINK, "linestyle": ":", "marker": "^", "markersize": 4.5},
    POSTURE: {"color": ORANGE, "linestyle": "-.", "marker": "D", "markersize": 4.5},
    EMG_ONLY: {"color": GREEN, "linestyle": "-.", "marker": "s", "markersize": 4.5},
}
PARTS = {"training trials": (BLUE, "o", -0.13), "held-out trials": (MODEL, "s", 0.13)}  # colour, marker, place


def draw_torque(torque: pd.DataFrame) -> Figure:
    """Share of the needed torque that each predictor explains, one dot per trial.

    Args:
        torque: columns model, trial, held_out, r2.
    """
    rivals = (POSTURE, POSTURE_LOAD, EMG_ONLY)
    models = [n for n in torque["model"].unique() if n not in (*rivals, NOISE)]
    names = [*(n for n in rivals if n in set(torque["model"])), *models]
    figure, axes = canvas(1, 1, width=9.0, height=1.2 + 0.62 * (len(names) + 2))
    share = axes[0, 0]
    shown = torque[torque["model"].isin(names)]
    for held_out, (label, (color, marker, offset)) in enumerate(PARTS.items()):
        rows = shown[shown["held_out"] == bool(held_out)].replace([np.inf, -np.inf], np.nan)
        y = rows["model"].map(names.index) + offset
        look = {"color": color, "marker": marker, "markersize": 6.5, "linestyle": "none", "alpha": 0.85}
        share.plot(rows["r2"].clip(lower=LOWEST_R2), y, label=label, clip_on=False, **look)
        for name, r2 in shown[(shown["held_out"] == bool(held_out)) & (shown["r2"] < LOWEST_R2)].groupby("model")["r2"]:
            ends = dict.fromkeys(f"{value:.2g}" for value in (r2.min(), r2.max()))
            text = "torque overflows" if np.isinf(r2).any() else " to ".join(ends)
            place = (LOWEST_R2, names.index(str(name)) + offset)
            share.annotate(text, place, (8, -3), textcoords="offset points", fontsize=9)
    noise = torque[torque["model"] == NOISE]["r2"]
    if len(noise):
        share.axvspan(noise.min(), noise.max(), color=MEASURED, alpha=0.3, lw=1.5, zorder=0, label=NOISE)
    share.grid(axis="y", visible=False)
    share.tick_params(axis="y", length=0)
    share.set_yticks(range(len(names)), [short(n) for n in names])
    share.set_ylim(len(names) - 0.5, -0.5)
    share.set_xlim(min(-0.05, torque["r2"].clip(lower=LOWEST_R2).min() - 0.04), 1.03)
    share.set_xlabel("$R^2$ of the torque that the motion needs [-]")
    legend(figure, [share], columns=3)
    return figure


def draw_horizons(horizons: pd.DataFrame, levels: Mapping[str, float], networks: pd.DataFrame, found: str) -> Figure:
    """Error against the horizon, of the first model, of the one that was found, and of the predictors to beat.

    Args:
        horizons: columns predictor, horizon_s, held_out, rmse_deg; whole trials have horizon inf.
        levels: errors of noise [deg], see `draw_levels`.
        networks: columns source, heldout_rmse_deg of the networks trained with these models, for whole trials.
    """
    times = sorted(h for h in horizons["horizon_s"].unique() if np.isfinite(h))
    place = {h: i for i, h in enumerate(times)} | {np.inf: len(times) + 0.4}
    models = dict.fromkeys((horizons["predictor"].iloc[0], found))
    own = {m: {"marker": "o", "linewidth": 2.4, **style(order)} for order, m in enumerate(models)}
    parts = [p for p in (False, True) if (horizons["held_out"] == p).any()]
    figure, axes = canvas(1, len(parts), width=6.0 * len(parts), height=4.9, sharey=True)
    for axis, held_out in zip(axes[0], parts, strict=True):
        rows = horizons[horizons["held_out"] == held_out]
        for name, look in (BASELINES | own).items():
            line = rows[rows["predictor"] == name]
            overflows = " (overflows where there is no line)" * bool(np.isinf(line["rmse_deg"]).any())
            line = line[np.isfinite(line["rmse_deg"])]
            whole = np.isinf(line["horizon_s"])  # apart from the horizons
            near, far = line[~whole], line[whole]
            axis.plot(near["horizon_s"].map(place), near["rmse_deg"], label=short(name) + overflows, **look)
            axis.plot(far["horizon_s"].map(place), far["rmse_deg"], **look)
        if held_out:
            for (source, errors), marker in zip(networks.groupby("source", sort=False), cycle("x+1*"), strict=False):
                x = np.full(len(errors), place[np.inf])
                axis.plot(x, errors["heldout_rmse_deg"], linestyle="none", marker=marker, color=BLACK, label=source)
        draw_levels(axis, levels)
        axis.axvline(len(times) - 0.3, color=GREY, linewidth=0.8)
        axis.set_yscale("log")
        axis.yaxis.set_major_formatter("{x:g}")
        axis.set_xticks(list(place.values()), [*(f"{h:g}" for h in times), "whole\ntrial"])
        axis.set_xlabel("horizon after a measured state [s]")
        axis.set_title("held-out trials" if held_out else "training trials")
    axes[0, 0].set_ylabel("RMSE [deg]")
    legend(figure, [axes[0, -1]], columns=4)
    return figure
