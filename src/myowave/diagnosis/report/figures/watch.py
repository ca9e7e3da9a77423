"""Watch: errors and parameters from model to model, of the physics and of the networks trained with it."""

from itertools import chain, cycle

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.report.cells import Z95
from myowave.diagnosis.report.figures.style import WIDE, draw_noise, label_lowest, legend, unique
from myowave.diagnosis.report.ladder import PHYSICS
from myowave.diagnosis.report.words import degrees
from myowave.plotting import BLUE, GREEN, MEASURED, MODEL, ORANGE, PINK, canvas, title

LONG = 16  # letters of a panel's title; more go in two lines
NETWORKS = ((GREEN, "^"), (ORANGE, "v"), (PINK, "D"), (MODEL, "P"))  # colour and marker of each kind of network


def draw_ladder(
    ladder: pd.DataFrame, found: str, noise: str, with_emg: float | None = None, horizon_s: float | None = None
) -> Figure:
    """Error and missing torque against the effects added.

    Args:
        ladder: columns source, model, named, train_rmse_deg, heldout_rmse_deg, noise_deg, missing_torque_Nm.
        found: the model that was found.
        noise: of the angle, in words.
        with_emg: what this and noise of the recorded EMG make together [deg]; none where the EMG has none.
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
    level = ladder["noise_deg"].iloc[0]
    draw_noise(error, level, noise, with_emg)
    values = ladder[["train_rmse_deg", "heldout_rmse_deg"]].stack()
    if values.max() > WIDE / 2 * values.min():
        error.set_yscale("log")
        error.yaxis.set_major_formatter("{x:g}")
    else:
        error.set_ylim(0, 1.08 * max(values.max(), level))  # room for a whole marker
    error.set_ylabel("RMSE [deg]")
    for torque in axes[0, 1:]:
        torque.plot(physics["model"].map(models.index), missing, color=BLUE, marker="o", linestyle="none", markersize=8)
        torque.set_ylim(-0.04 * missing.max(), 1.08 * missing.max())
        torque.set_ylabel("missing torque, RMS [N m]")
    for axis in axes[0]:
        axis.set_xticks(range(len(models)), [m.replace("+", "\n+") for m in models], fontsize=9)
        axis.set_xlim(-0.5, len(models) - 0.5)
        axis.grid(axis="x", visible=False)
    legend(figure, error, columns=2)
    first, last = physics.iloc[0], physics[physics["model"] == found].iloc[0]
    if found == first["model"]:
        finding = f"Nothing added: {degrees(first['heldout_rmse_deg'])} on held-out trials, noise is {noise}"
    else:
        finding = (
            f"With what was found the held-out error falls from {degrees(first['heldout_rmse_deg'])} to "
            f"{degrees(last['heldout_rmse_deg'])}, missing torque from {first['missing_torque_Nm']:.2g} to "
            f"{last['missing_torque_Nm']:.2g} N m"
        )
    title(figure, finding)
    return figure


def draw_parameters(parameters: pd.DataFrame, found: str) -> Figure:
    """Each parameter that a dataset wants identified, or that an effect has, along the ladder with 95 % intervals
    within its bounds, and its true value where that is known. Intervals that hold only if the model were right are open
    and dotted.

    Args:
        parameters: as `ladder.join_parameters` gives them.
        found: the model that was found.
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
    label_lowest(axes.flat, len(names), columns)
    for axis in axes.flat:
        axis.set_xlim(-0.4, len(models) - 0.4)
        axis.set_xticks(range(len(models)), [str(i) if i else models[0] for i in range(len(models))])
    names_of_models = "    ".join(f"{i}: {m}" for i, m in enumerate(models) if i)
    figure.supxlabel(names_of_models, x=0.01, ha="left", fontsize=10)
    handles = {
        label: handle for axis in axes.flat for handle, label in zip(*axis.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles.keys(), loc="outside right upper", frameon=False)
    physics = parameters[parameters["source"] == PHYSICS]
    ends = [physics[physics["model"] == m] for m in (models[0], found)]
    if physics["error_pct"].notna().any():
        errors = [rows["error_pct"].abs().max() for rows in ends]
        finding = f"Worst parameter error {errors[0]:.2g} %" + (
            f" without, {errors[1]:.2g} % with what was found" if found != models[0] else "; 95 % intervals"
        )
    elif found == models[0]:
        finding = "Parameters with 95 % intervals"
    else:
        shared = ends[0].merge(ends[1], on="parameter", suffixes=("_0", "_1"))
        moved = 100 * (shared["value_1"] / shared["value_0"] - 1)
        worst = ((shared["value_1"] - shared["value_0"]) / shared["se_0"]).abs().fillna(0.0).idxmax()
        finding = f"Adding what was missing moves {shared['parameter'][worst]} by {moved[worst]:+.0f} %"
    title(figure, finding)
    return figure
