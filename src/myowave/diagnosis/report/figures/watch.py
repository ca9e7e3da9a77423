"""Watch: errors and parameters from model to model, of the physics and of the networks trained with it."""

from collections.abc import Mapping
from itertools import chain, cycle

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.report.figures.style import WIDE, draw_levels, legend, scale_errors, unique
from myowave.diagnosis.report.ladder import PHYSICS
from myowave.diagnosis.report.numbers import Z95
from myowave.plotting import BLUE, GREEN, MEASURED, MODEL, ORANGE, PINK, canvas

LONG = 16  # letters of a panel's title; more go in two lines
NETWORKS = ((GREEN, "^"), (ORANGE, "v"), (PINK, "D"), (MODEL, "P"))  # colour and marker of each kind of network


def draw_ladder(ladder: pd.DataFrame, levels: Mapping[str, float], horizon_s: float | None = None) -> Figure:
    """Error and missing torque against the effects added.

    Args:
        ladder: columns source, model, named, train_rmse_deg, heldout_rmse_deg, noise_deg, missing_torque_Nm.
        levels: errors of noise [deg], see `draw_levels`.
        horizon_s: that the physical model is judged over [s]; none where that is whole trials, as for networks.
    """
    over = "" if horizon_s is None else f" over {horizon_s:g} s"
    whole = "" if horizon_s is None else ", whole trials"
    models = unique(ladder["model"])
    physics = ladder[ladder["source"] == PHYSICS]
    missing = physics["missing_torque_Nm"]
    widths = [4, 3] if (missing > 0).any() else [4]
    wide = max(9.5, 2.6 * len(models) + 4)
    figure, axes = canvas(1, len(widths), width=wide, height=4.5, gridspec_kw={"width_ratios": widths})
    error = axes[0, 0]
    for name, column, color, marker, dashes in (
        ("training trials", "train_rmse_deg", BLUE, "o", "-"),
        ("held out", "heldout_rmse_deg", MODEL, "s", "--"),
    ):
        for named, rows in physics.groupby("named"):
            look = {"linestyle": "none", "markerfacecolor": "white"} if named else {"linestyle": dashes}
            label = f"physical model{over}{' (named in targets.models)' if named else ''}, {name}"
            error.plot(rows["model"].map(models.index), rows[column], color=color, marker=marker, label=label, **look)
    networks = ladder[ladder["source"] != PHYSICS].groupby("source", sort=False)
    for (color, marker), (source, rows) in zip(cycle(NETWORKS), networks, strict=False):
        x = rows["model"].map(models.index)
        error.plot(
            x, rows["heldout_rmse_deg"], color=color, marker=marker, linestyle="-.", label=f"{source}, held out{whole}"
        )
    draw_levels(error, levels)
    scale_errors(error, ladder[["train_rmse_deg", "heldout_rmse_deg"]], levels.values(), WIDE / 2)
    error.set_ylabel("RMSE [deg]")
    for torque in axes[0, 1:]:
        torque.plot(physics["model"].map(models.index), missing, color=BLUE, marker="o", linestyle="none", markersize=8)
        torque.set_ylim(-0.04 * missing.max(), 1.08 * missing.max())
        torque.set_ylabel("missing torque, RMS [N m]")
    for axis in axes[0]:
        axis.set_xticks(range(len(models)), [m.replace("+", "\n+") for m in models], fontsize=9)
        axis.set_xlim(-0.5, len(models) - 0.5)
        axis.grid(axis="x", visible=False)
    legend(figure, [error], columns=2)
    return figure


def draw_parameters(parameters: pd.DataFrame) -> Figure:
    """Each parameter that a dataset wants identified, or that an effect has, along the ladder with 95 % intervals
    within its bounds, and its true value where that is known. Intervals that hold only if the model were right are open
    and dotted.

    Args:
        parameters: as `ladder.join_parameters` gives them.
    """
    parameters = parameters[~parameters["assumed"].astype(bool)]
    models, names = (unique(parameters[c]) for c in ("model", "parameter"))
    columns = min(4, len(names))
    rows = -(-len(names) // columns)
    figure, axes = canvas(rows, columns, width=max(6.0, 3.0 * columns), height=2.9 * rows + 1.2, sharex=True)
    sources = unique(parameters["source"])
    looks = dict(zip(sources, chain([(BLUE, "o")], cycle(NETWORKS)), strict=False))
    for axis, name in zip(axes.flat, names, strict=False):
        table = parameters[parameters["parameter"] == name]
        for source, group in table.groupby("source", sort=False):
            color, marker = looks[source]
            x = group["model"].map(models.index) + 0.12 * sources.index(source)
            open_ones = group["if_right"].astype(bool)
            reach, bounds = Z95 * group["se"].fillna(0), (group["low"], group["high"])
            ends = [(group["value"] + sign * reach).clip(*bounds) for sign in (-1, 1)]
            spans = np.abs(np.array([ends[0] - group["value"], ends[1] - group["value"]]))
            what = "physical model" if source == PHYSICS else source
            for rows, label in ((~open_ones, what), (open_ones, f"{what}, were it right")):
                if rows.any():
                    points, _, (bars,) = axis.errorbar(
                        x[rows],
                        group["value"][rows],
                        spans[:, rows.to_numpy()],
                        fmt=marker,
                        color=color,
                        capsize=4,
                        label=label,
                    )
                    if rows is open_ones:
                        points.set_markerfacecolor("white")
                        bars.set_linestyle(":")
        for true in table["true"].dropna().unique():
            axis.axhline(true, color=MEASURED, linestyle=":", linewidth=1.8, label="true value")
        label = f"{name} [{unit.iloc[0]}]" if len(unit := table["unit"].dropna()) else name
        short = len(label) <= LONG
        axis.set_title(label if short else label.replace(" [", "\n["), fontsize=None if short else 10)
        axis.margins(y=0.15)
        axis.grid(axis="x", visible=False)
        axis.ticklabel_format(axis="y", useOffset=False)
    for axis in list(axes.flat)[len(names) :]:
        axis.set_visible(False)
    for axis in list(axes.flat)[: len(names)][-columns:]:  # also where the last row is not full
        axis.tick_params(labelbottom=True)
    for axis in axes.flat:
        axis.set_xlim(-0.4, len(models) - 0.4)
        axis.set_xticks(range(len(models)), [str(i) if i else models[0] for i in range(len(models))])
    names_of_models = "    ".join(f"{i}: {m}" for i, m in enumerate(models) if i)
    figure.supxlabel(names_of_models, x=0.01, ha="left", fontsize=10)
    legend(figure, axes.flat, columns=1, place="outside right upper")
    return figure
