"""Pictures of a diagnosis by its steps: glance, comparisons, where, which, watch. Drawn only from its tables.

Where there are several models, the first (without any effect added) and the one that was found are shown.
"""

import textwrap
from collections.abc import Callable, Mapping
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from myowave.diagnosis.causes import SURE
from myowave.diagnosis.comparison.baselines import (
    EMG_ONLY,
    HOLD,
    MOTOR_ONLY,
    NOISE,
    POSTURE,
    POSTURE_LOAD,
    SAME_SPEED,
)
from myowave.diagnosis.report.ladder import PHYSICS, PLAIN, of_networks
from myowave.diagnosis.report.numbers import degrees, two_digits
from myowave.diagnosis.report.tell import base_of, best_rival, noise, noise_with_emg
from myowave.diagnosis.report.templates import called, described
from myowave.plotting import BLACK, BLUE, GREEN, GREY, MEASURED, MODEL, ORANGE, PINK, SKY, canvas, title

# Of the first model and of the one that was found, the same in all pictures.
LOOKS = ({"color": MODEL, "linestyle": "--"}, {"color": BLUE, "linestyle": "-"})
LOWEST_R2 = -0.5  # what explains less stands at the edge
BASELINES = {
    HOLD: {"color": GREY, "linestyle": ":", "marker": "v", "markersize": 4.5},
    SAME_SPEED: {"color": PINK, "linestyle": ":", "marker": "^", "markersize": 4.5},
    POSTURE: {"color": ORANGE, "linestyle": "-.", "marker": "D", "markersize": 4.5},
    **dict.fromkeys((EMG_ONLY, MOTOR_ONLY), {"color": GREEN, "linestyle": "-.", "marker": "s", "markersize": 4.5}),
}
RIVALS = (POSTURE, POSTURE_LOAD, EMG_ONLY, MOTOR_ONLY)  # predictors to beat, in torque
PARTS = {"training trials": (BLUE, "o", -0.13), "held-out trials": (MODEL, "s", 0.13)}  # colour, marker, place
WINDOWS_A_CELL, MOST_CELLS = 5, 12  # the map is as fine as so many windows in a cell, on average, allow
FEWEST = 3  # windows in a cell of the map
SHOWN = 8  # candidates a panel
ODDS = (-1000, -100, -10, -3, 0, 3, 10, 100, 1000, 10_000)  # marked on their axis
wrapped = partial(textwrap.fill, width=28)  # what models and predictors are called
STATUS = {
    "supported": (BLUE, "the data support it"),
    "behind": (PINK, "promises less than those fitted"),
    "not needed": (SKY, "no evidence"),
    "failed": (MEASURED, "cannot be fitted"),
}
STILL_DEG = 1.0  # shown at least above and below an angle, which may never move
WIDE = 10.0  # ratio of errors from which the axis is logarithmic
NETWORKS = ((GREEN, "^"), (ORANGE, "v"), (PINK, "D"), (MODEL, "P"))  # colour and marker of each kind of network


def draw_diagnosis(
    tables: Mapping[str, pd.DataFrame], predictions: pd.DataFrame, verdict: Mapping[str, Any]
) -> dict[str, Figure]:
    """All pictures of a dataset, by name.

    Args:
        tables: those of `tables.TABLES`, with `ladder` as `ladder` joins it, and those of `comparison.compare`.
        predictions: measured and predicted angle, from `motion.beside`.
    """
    (model, errors), found, ladder = base_of(verdict), verdict["model"], tables["ladder"]
    angle = {f"noise of the angle, {noise(verdict)}": errors["noise"]}
    of_emg = {"noise of the angle and of the EMG": noise_with_emg(verdict)} if verdict["emg_noise"] else {}
    ends = list(dict.fromkeys((model, found)))
    others = set(verdict["rmse_deg"]) - set(ends)
    missing, titles = tables["missing_torque"], verdict["titles"]
    fitted = ladder[~ladder["source"].str.startswith(PLAIN)]
    words = {model: described(model, titles) for model in {*verdict["rmse_deg"], *ladder["model"]}}
    explained, ahead = findings(verdict)
    return {
        "glance": draw_glance(
            predictions[~predictions["model"].isin(others)], ends, verdict["horizon_s"], words[model]
        ),
        "torque": draw_torque(tables["torque"].replace(words), explained),
        "horizons": draw_horizons(tables["horizons"].replace(words), angle, of_networks(ladder), words[found], ahead),
        "missing_torque": draw_missing_torque(
            missing[missing["model"].isin(ends)].replace(words),
            {words[name]: rms for name, rms in verdict["missing_torque_Nm"].items() if rms is not None},
        ),
        "ranking": draw_ranking(tables["ranking"], titles),
        "ladder": draw_ladder(fitted.replace(words), angle | of_emg, verdict["horizon_s"], words[model]),
    }


def draw_glance(
    predictions: pd.DataFrame, physics: list[str], horizon_s: float | None, base: str = "muscle model"
) -> Figure:
    """Measured and predicted angle of the first held-out trial, or of the first where none is held out; `physics` are
    the models without a network, the one without effects, called `base`, first, which start again every `horizon_s`."""
    held_out = predictions[predictions["role"] == "test"]
    rows = held_out if len(held_out) else predictions
    rows = rows[rows["trial"] == rows["trial"].iloc[0]]
    figure, ((axis,),) = canvas(1, 1, width=3.6, height=2.1)
    measured = rows[rows["model"] == rows["model"].iloc[0]]
    axis.plot(measured["time_s"], np.degrees(measured["angle_rad"]), color=MEASURED, linewidth=2.4, label="measured")
    again = "" if horizon_s is None else f",\nanew every {horizon_s:g} s"
    labels = (f"{base}{again}", "with what was found")
    shown = dict(zip(physics, zip(labels, LOOKS, strict=True), strict=False))
    for model, one in rows.groupby("model", sort=False):
        label, look = shown.get(str(model), ("network", {"color": GREEN, "linestyle": "-."}))
        axis.plot(one["time_s"], np.degrees(one["predicted_rad"]), linewidth=1.3, label=label, **look)
    low, high = np.degrees(measured["angle_rad"].min()), np.degrees(measured["angle_rad"].max())
    beyond = max(0.3 * (high - low), STILL_DEG)  # no farther: a model that runs away hides nothing
    axis.set_ylim(low - beyond, high + beyond)
    axis.set(xlabel="time [s]", ylabel="angle [deg]")
    legend(figure, axis, columns=2)
    return figure


def findings(verdict: Mapping[str, Any]) -> tuple[str, str]:
    """What the pictures of torque and of horizons show: the model without effects, the one that was found, and the best
    predictor to beat, but for what overflows; empty where there is nothing to say."""
    r2, ahead = verdict["torque"]["r2"], verdict["horizons"]
    best = max((name for name in RIVALS if r2.get(name) is not None), key=lambda name: r2[name], default="")

    def beside(values: Mapping[str, float | None], rival: str, say: Callable[[float], str]) -> str:
        ends = dict.fromkeys((base_of(verdict)[0], verdict["model"]))
        whose = {**dict(zip(ends, ("by the model", "with what was found"), strict=False)), rival: f"by {rival}"}
        known = [(values.get(name), by) for name, by in whose.items()]
        return ", ".join(f"{say(value)} {by}" for value, by in known if value is not None and value > LOWEST_R2)

    explained, errors = beside(r2, best, two_digits), beside(ahead["rmse_deg"], best_rival(verdict), degrees)
    return (
        f"Torque explained: {explained}" if explained else "",
        f"Error {ahead['horizon_s']:g} s after a measured state: {errors}" if errors else "",
    )


def draw_torque(torque: pd.DataFrame, finding: str = "") -> Figure:
    """Share of the needed torque that each predictor explains, one dot per trial, under what is found."""
    models = [n for n in torque["model"].unique() if n not in (*RIVALS, NOISE)]
    names = [*(n for n in RIVALS if n in set(torque["model"])), *models]
    figure, ((share,),) = canvas(1, 1, width=9.0, height=1.2 + 0.62 * (len(names) + 2))
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
    share.set_yticks(range(len(names)), [wrapped(n) for n in names])
    share.set_ylim(len(names) - 0.5, -0.5)
    share.set_xlim(min(-0.05, torque["r2"].clip(lower=LOWEST_R2).min() - 0.04), 1.03)
    share.set_xlabel("$R^2$ of the torque that the motion needs [-]")
    legend(figure, share, columns=3)
    title(figure, finding)
    return figure


def draw_horizons(
    horizons: pd.DataFrame, levels: Mapping[str, float], networks: pd.DataFrame, found: str, finding: str = ""
) -> Figure:
    """Error against the horizon, of the first model, of the one that was found, of the predictors to beat, and over
    whole trials of the networks; with levels of noise [deg], see `draw_levels`; under what is found."""
    times = sorted(h for h in horizons["horizon_s"].unique() if np.isfinite(h))
    place = {h: i for i, h in enumerate(times)} | {np.inf: len(times) + 0.4}
    models = dict.fromkeys((horizons["predictor"].iloc[0], found))
    own = {m: {"marker": "o", "linewidth": 2.4, **look} for m, look in zip(models, LOOKS, strict=False)}
    parts = [p for p in (False, True) if (horizons["held_out"] == p).any()]
    figure, axes = canvas(1, len(parts), width=6.0 * len(parts), height=4.9, sharey=True)
    for axis, held_out in zip(axes[0], parts, strict=True):
        rows = horizons[horizons["held_out"] == held_out]
        for name, look in (BASELINES | own).items():
            if (line := rows[rows["predictor"] == name]).empty:
                continue
            overflows = " (overflows where there is no line)" * bool(np.isinf(line["rmse_deg"]).any())
            line = line[np.isfinite(line["rmse_deg"])]
            whole = np.isinf(line["horizon_s"])  # apart from the horizons
            near, far = line[~whole], line[whole]
            axis.plot(near["horizon_s"].map(place), near["rmse_deg"], label=wrapped(name) + overflows, **look)
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
    legend(figure, axes[0, -1], columns=4)
    title(figure, finding)
    return figure


def draw_missing_torque(windows: pd.DataFrame, rms: Mapping[str, float] | None = None) -> Figure:
    """Torque that each model would have to add, over angle and velocity, and its `rms` by model [N m], 0 where noise
    shows as much; an empty picture of short trials."""
    rms = rms or {}
    misses = {name: f": {two_digits(size)} N m missing" if size else ": none above noise" for name, size in rms.items()}
    models = list(windows["model"].unique()) or ["no trial is long enough for a window"]
    figure, axes = canvas(1, len(models), width=4.2 * len(models) + 1.6, height=4.4, sharex=True, sharey=True)
    maps = []
    for axis, model in zip(axes[0], models, strict=True):
        axis.set(xlabel="angle [deg]", title=wrapped(model + misses.get(model, "")), facecolor="#e2e2e2")
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
        figure.colorbar(maps[0], ax=axes, label="missing torque [N m]\n(positive: turns the angle up)", shrink=0.9)
    return figure


def draw_ranking(ranking: pd.DataFrame, titles: Mapping[str, str]) -> Figure:
    """The catalogue weighed at each model, the most evident effects of each by their titles, a panel a model."""
    models = list(ranking["model"].unique()) or ["the model"]
    figure, axes = canvas(len(models), 1, width=9.0, height=3.3 * len(models) + 1.1)
    for axis, model in zip(axes[:, 0], models, strict=True):
        rows = ranking[ranking["model"] == model]
        rows = rows[rows["status"] != "absorbed"].head(SHOWN).iloc[::-1]
        y = np.arange(len(rows))
        axis.scatter(rows["log_odds"], y, color=[STATUS[s][0] for s in rows["status"]], s=60, zorder=3)
        axis.set_xscale("symlog", linthresh=3, linscale=0.7)
        axis.set_xticks(ODDS, [f"{odds:g}" for odds in ODDS])
        axis.axvline(SURE, color=MEASURED, linestyle=":", linewidth=2)
        axis.axvline(0, color=GREY, linewidth=0.8)
        axis.set_yticks(y, [called(e, titles) for e in rows["effect"]], fontsize=9)
        axis.set_xlim(min(-3.0, rows["log_odds"].min() * 1.2), max(10.0, rows["log_odds"].max() * 1.5))
        best = rows.iloc[-1] if len(rows) and rows["log_odds"].iloc[-1] > SURE else None
        finding = "no effect has evidence" if best is None else f"most evidence for {called(best['effect'], titles)}"
        shown = f"best {len(rows)} of {(ranking['model'] == model).sum()}".replace(" ", "\N{NO-BREAK SPACE}")
        axis.set_title(wrapped(f"{described(model, titles)}: {finding}; {shown}", width=70))
        axis.grid(axis="y", linestyle=":")
    axes[-1, 0].set_xlabel("log odds of the model with the effect [nats]; dotted: 19 to 1, 95 %")
    seen = [look for status, look in STATUS.items() if (ranking["status"] == status).any()]
    look: dict[str, Any] = {"marker": "o", "linestyle": "none", "markersize": 7}
    handles = [Line2D([], [], color=color, label=meaning, **look) for color, meaning in seen]
    figure.legend(handles=handles, loc="outside lower left", ncols=3, frameon=False, fontsize=9)
    return figure


def draw_ladder(
    ladder: pd.DataFrame, levels: Mapping[str, float], horizon_s: float | None = None, base: str = "muscle model"
) -> Figure:
    """Error against the effects added, with levels of noise [deg], see `draw_levels`; the model, called `base`, is
    judged over `horizon_s`, or over whole trials, as networks are."""
    over = "" if horizon_s is None else f" over {horizon_s:g} s"
    whole = "" if horizon_s is None else ", whole trials"
    models = list(ladder["model"].unique())
    physics = ladder[ladder["source"] == PHYSICS]
    figure, ((error,),) = canvas(1, 1, width=max(8.0, 2.6 * len(models) + 2), height=4.5)
    for name, column, color, marker, dashes in (
        ("training trials", "train_rmse_deg", BLUE, "o", "-"),
        ("held out", "heldout_rmse_deg", MODEL, "s", "--"),
    ):
        for named, rows in physics.groupby("named"):
            look = {"linestyle": "none", "markerfacecolor": "white"} if named else {"linestyle": dashes}
            label = f"{base}{over}{' (tried beside)' if named else ''}, {name}"
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
    steps = [degrees(one) for one in physics[~physics["named"].astype(bool)]["heldout_rmse_deg"]]
    found = f", {steps[-1]} with what was found" * (len(steps) > 1)
    title(figure, f"Held-out error of the model{over}: {steps[0]}{found}")
    error.set_ylabel("RMSE [deg]")
    error.set_xticks(range(len(models)), [wrapped(m) for m in models], fontsize=9)
    error.set_xlim(-0.5, len(models) - 0.5)
    error.grid(axis="x", visible=False)
    legend(figure, error, columns=2)
    return figure


def draw_levels(axis: Axes, levels: Mapping[str, float]) -> None:
    """Errors [deg] that a model cannot go below, by what they are of: noise of the angle, and with that of the EMG."""
    for (label, level), color in zip(levels.items(), (MEASURED, GREY), strict=False):
        axis.axhline(level, color=color, linestyle=":", linewidth=2, label=label)


def legend(figure: Figure, axis: Axes, *, columns: int) -> None:
    """One legend for all panels, below them."""
    figure.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=columns, frameon=False)
