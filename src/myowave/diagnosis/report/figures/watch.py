"""Watch: errors from model to model, of the physics and of the networks trained with it."""

from collections.abc import Mapping
from itertools import cycle

import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.report.figures.style import draw_levels, legend
from myowave.diagnosis.report.ladder import PHYSICS
from myowave.plotting import BLUE, GREEN, MODEL, ORANGE, PINK, canvas

WIDE = 10.0  # ratio of errors from which the axis is logarithmic
NETWORKS = ((GREEN, "^"), (ORANGE, "v"), (PINK, "D"), (MODEL, "P"))  # colour and marker of each kind of network


def draw_ladder(ladder: pd.DataFrame, levels: Mapping[str, float], horizon_s: float | None = None) -> Figure:
    """Error against the effects added.

    Args:
        ladder: columns source, model, named, train_rmse_deg, heldout_rmse_deg.
        levels: errors of noise [deg], see `draw_levels`.
        horizon_s: that the muscle model is judged over [s]; none where that is whole trials, as for networks.
    """
    over = "" if horizon_s is None else f" over {horizon_s:g} s"
    whole = "" if horizon_s is None else ", whole trials"
    models = list(ladder["model"].unique())
    physics = ladder[ladder["source"] == PHYSICS]
    figure, axes = canvas(1, 1, width=max(8.0, 2.6 * len(models) + 2), height=4.5)
    error = axes[0, 0]
    for name, column, color, marker, dashes in (
        ("training trials", "train_rmse_deg", BLUE, "o", "-"),
        ("held out", "heldout_rmse_deg", MODEL, "s", "--"),
    ):
        for named, rows in physics.groupby("named"):
            look = {"linestyle": "none", "markerfacecolor": "white"} if named else {"linestyle": dashes}
            label = f"muscle model{over}{' (named in targets.models)' if named else ''}, {name}"
            error.plot(rows["model"].map(models.index), rows[column], color=color, marker=marker, label=label, **look)
    networks = ladder[ladder["source"] != PHYSICS].groupby("source", sort=False)
    for (color, marker), (source, rows) in zip(cycle(NETWORKS), networks, strict=False):
        x = rows["model"].map(models.index)
        error.plot(
            x, rows["heldout_rmse_deg"], color=color, marker=marker, linestyle="-.", label=f"{source}, held out{whole}"
        )
    draw_levels(error, levels)
    errors = ladder[["train_rmse_deg", "heldout_rmse_deg"]]
    low, high = errors.min().min(), errors.max().max()
    if high > WIDE * low:
        error.set_yscale("log")
        error.yaxis.set_major_formatter("{x:g}")
    else:
        error.set_ylim(0, max(error.get_ylim()[1], 1.08 * max(high, *levels.values())))
    error.set_ylabel("RMSE [deg]")
    error.set_xticks(range(len(models)), [m.replace("+", "\n+") for m in models], fontsize=9)
    error.set_xlim(-0.5, len(models) - 0.5)
    error.grid(axis="x", visible=False)
    legend(figure, [error], columns=2)
    return figure
