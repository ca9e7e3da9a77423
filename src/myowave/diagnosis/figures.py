"""Pictures of a diagnosis: compare, where, which, watch. Drawn from the tables of `tables` and `ladder`, nothing else.

Where there are several models, the first (without any effect added) and the last (with all that were found) are shown.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import ScalarFormatter

from myowave.plotting import BLUE, GREEN, GREY, MEASURED, MODEL, ORANGE, PINK, SKY, canvas, title

THRESHOLD = 10.0  # delta BIC that counts as very strong evidence
SHOWN = 10  # candidates a panel
WIDE = 20.0  # ratio of errors from which an axis is logarithmic
STATUS = {"supported": BLUE, "refused": ORANGE, "behind": PINK, "absorbed": GREY, "not needed": SKY}
MEANING = {
    "supported": "the data support it",
    "refused": "better fit, but at a bound or not in held-out folds",
    "behind": "promises less than those fitted",
    "absorbed": "parameters absorb it",
    "not needed": "no evidence",
}
FIRST_STYLE = {"color": MODEL, "linestyle": "--"}
LAST_STYLE = {"color": BLUE, "linestyle": "-"}


def draw_diagnosis(tables: Mapping[str, pd.DataFrame], predictions: pd.DataFrame, where: str) -> dict[str, Figure]:
    """All pictures of a dataset, by name.

    Args:
        tables: those of `tables.TABLES`, with `ladder` and `parameters` as `ladder` joins them.
        where: the misfit in a sentence.
    """
    errors, noise_deg = tables["errors"], tables["errors"]["noise_deg"].iloc[0]
    return {
        "overlay": draw_overlay(predictions, errors),
        "errors": draw_errors(errors),
        "independence": draw_independence(tables["independence"]),
        "correlations": draw_correlations(tables["correlations"]),
        "misfit": draw_misfit(tables["misfit"], noise_deg, where),
        "missing_torque": draw_missing_torque(tables["missing_torque"]),
        "ranking": draw_ranking(tables["ranking"].fillna({"absorbed_by": "", "confused_with": ""})),
        "ladder": draw_ladder(tables["ladder"]),
        "parameters": draw_parameters(tables["parameters"]),
    }


def draw_overlay(predictions: pd.DataFrame, errors: pd.DataFrame) -> Figure:
    """Measured and simulated angle of every trial, and what is left, a column a trial.

    Args:
        predictions: columns model, trial, role, time_s, angle_rad, predicted_rad.
        errors: columns model, trial, role, rmse_deg, r2, noise_deg.
    """
    models = _ends(predictions)
    trials = list(dict.fromkeys(predictions["trial"]))
    figure, axes = canvas(
        2, len(trials), width=max(8.0, 2.9 * len(trials)), height=4.9, sharex="col", sharey="row",
        gridspec_kw={"height_ratios": [3, 2]},
    )  # fmt: skip
    for column, trial in enumerate(trials):
        rows = predictions[predictions["trial"] == trial]
        top, bottom = axes[:, column]
        for order, model in enumerate(models):
            one, style = rows[rows["model"] == model], _style(order, models)
            if order == 0:
                top.plot(one["time_s"], np.degrees(one["angle_rad"]), color=MEASURED, linewidth=2.2, label="measured")
            top.plot(one["time_s"], np.degrees(one["predicted_rad"]), linewidth=1.2, label=_short(model), **style)
            left = np.degrees(one["angle_rad"] - one["predicted_rad"])
            bottom.plot(one["time_s"], left, color=style["color"], linewidth=0.8)
        bottom.axhline(0, color=GREY, linewidth=0.8)
        role = "training" if rows["role"].iloc[0] == "train" else "held out"
        top.set_title(f"trial {_trial(trial)}, {role}")
        bottom.set_xlabel("time [s]")
    axes[0, 0].set_ylabel("elbow angle [deg]")
    axes[1, 0].set_ylabel("measured -\nsimulated [deg]")
    _legend(figure, axes[0, 0], columns=3)
    by_model = errors.groupby("model", sort=False)["rmse_deg"]
    ranges = [f"{_short(m)} misses by {by_model.min()[m]:.2g} to {by_model.max()[m]:.2g} deg" for m in models]
    title(figure, f"{'; '.join(ranges)}; noise is {errors['noise_deg'].iloc[0]:.2g} deg")
    return figure


def draw_errors(errors: pd.DataFrame) -> Figure:
    """RMSE of every model on every trial against the noise of the measurement."""
    models, trials = list(dict.fromkeys(errors["model"])), list(dict.fromkeys(errors["trial"]))
    noise = errors["noise_deg"].iloc[0]
    figure, axes = canvas(1, 1, width=max(7.0, 1.6 * len(trials) + 2), height=4.0)
    axis, width = axes[0, 0], 0.8 / len(models)
    floor = min(errors["rmse_deg"].min(), noise) / 3
    for i, model in enumerate(models):
        rows = errors[errors["model"] == model].set_index("trial").loc[trials]
        x = np.arange(len(trials)) + (i + 0.5) * width - 0.4
        color = _ramp(i, len(models))
        axis.bar(x, rows["rmse_deg"], width * 0.92, color=color, label=_short(model), hatch="//" * (i == 0), ec="white")
    axis.axhline(noise, color=MEASURED, linestyle=":", linewidth=2, label=f"noise, {noise:.2g} deg")
    if errors["rmse_deg"].max() > WIDE * errors["rmse_deg"].min():
        axis.set_yscale("log")
        axis.set_ylim(bottom=floor)
    axis.grid(axis="x", visible=False)
    roles = errors.drop_duplicates("trial").set_index("trial")["role"]
    names = [f"trial {_trial(t)}\n{'held out' if roles[t] == 'test' else 'training'}" for t in trials]
    axis.set_xticks(range(len(trials)), names)
    axis.set_ylabel("RMSE [deg]")
    _legend(figure, axis, columns=2)
    ratio = [_rms(errors[errors["model"] == m]["rmse_deg"]) / noise for m in (models[0], models[-1])]
    finding = f"{_short(models[0])} leaves {ratio[0]:.3g} times the noise"
    title(figure, finding + (f", {_short(models[-1])} {ratio[1]:.2g} times" if len(models) > 1 else ""))
    return figure


def draw_independence(independence: pd.DataFrame) -> Figure:
    """Correlation of the residual with what drives the arm, in units of the bound for independent signals."""
    models, inputs = _ends(independence), list(dict.fromkeys(independence["input"]))
    columns = 3
    figure, axes = canvas(
        -(-len(inputs) // columns), columns, width=9.5, height=2.3 * -(-len(inputs) // columns) + 1.2,
        sharex=True, sharey=True,
    )  # fmt: skip
    ratio = independence["correlation"] / independence["bound"]
    for axis, name in zip(axes.flat, inputs, strict=False):
        axis.axhspan(-1, 1, color="#e9e9e9", zorder=0, label="as independent signals do")
        for order, model in enumerate(models):
            chosen = (independence["model"] == model) & (independence["input"] == name)
            style = _style(order, models)
            axis.plot(
                independence["lag_s"][chosen], ratio[chosen], marker="o", markersize=3, label=_short(model), **style
            )
        axis.set_title(name)
    for axis in list(axes.flat)[len(inputs) :]:
        axis.set_visible(False)
    for axis in axes[-1]:
        axis.set_xlabel("input ahead by [s]")
    for axis in axes[:, 0]:
        axis.set_ylabel("correlation / bound [-]")
    _legend(figure, axes[0, 0], columns=3)
    worst = ratio.abs().groupby([independence["model"], independence["input"]]).max()
    texts = []
    for model in models:
        name, value = worst[model].idxmax(), worst[model].max()
        state = f"depends on {name}, {value:.2g} times the bound" if value > 1 else "is independent of every input"
        texts.append(f"what {_short(model)} leaves {state}")
    title(figure, _sentence("; ".join(texts)))
    return figure


def draw_misfit(misfit: pd.DataFrame, noise_deg: float, where: str) -> Figure:
    """RMSE in parts of the training data: by trial, direction, speed, angle, activation and time.

    Args:
        misfit: columns model, factor, part, rmse_deg.
        where: the finding in a sentence.
    """
    models, factors = _ends(misfit), list(dict.fromkeys(misfit["factor"]))
    columns = 4
    figure, axes = canvas(
        -(-len(factors) // columns), columns, width=12, height=2.9 * -(-len(factors) // columns) + 1.0, sharey=True
    )
    wide = misfit["rmse_deg"].max() > WIDE * misfit["rmse_deg"][misfit["rmse_deg"] > 0].min()
    for axis, factor in zip(axes.flat, factors, strict=False):
        for order, model in enumerate(models):
            rows = misfit[(misfit["factor"] == factor) & (misfit["model"] == model)]
            x = np.arange(len(rows)) + (order - (len(models) - 1) / 2) * 0.4
            style = {"color": _style(order, models)["color"], "hatch": "//" * (order == 0), "ec": "white"}
            axis.bar(x, rows["rmse_deg"], 0.38, label=_short(model), **style)
            if order == 0:
                names = [str(part).removeprefix("trial").replace(" to ", "\nto ") for part in rows["part"]]
                axis.set_xticks(range(len(rows)), names, fontsize=9)
        axis.axhline(noise_deg, color=MEASURED, linestyle=":", linewidth=1.8, label="noise")
        axis.set_title(factor.replace(" [-]", ""))
        axis.grid(axis="x", visible=False)
        if wide:
            axis.set_yscale("log")
            axis.yaxis.set_major_formatter(ScalarFormatter())
    for axis in list(axes.flat)[len(factors) :]:
        axis.set_visible(False)
    for axis in axes[:, 0]:
        axis.set_ylabel("RMSE [deg]")
    _legend(figure, axes[0, 0], columns=3)
    title(figure, where.split(";")[0].rstrip(".") + f"; noise is {noise_deg:.2g} deg")
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
    models = _ends(cells)
    figure, axes = canvas(1, len(models), width=4.2 * len(models) + 1.6, height=4.4, sharex=True, sharey=True)
    limit = max(float(cells[cells["model"].isin(models)]["torque_Nm"].abs().max()), 1e-3)
    for axis, model in zip(axes[0], models, strict=True):
        angles, velocities, torque = _grid(cells[cells["model"] == model])
        image = axis.pcolormesh(angles, velocities, torque, cmap="RdBu_r", vmin=-limit, vmax=limit)
        axis.set(xlabel="elbow angle [deg]", title=_short(model), facecolor="#f2f2f2")
        axis.grid(visible=False)
    axes[0, 0].set_ylabel("angular velocity [deg/s]")
    figure.colorbar(image, ax=axes, label="missing torque [N m]\n(positive: towards flexion)", shrink=0.9)
    rms = [_rms(cells[cells["model"] == m]["torque_Nm"]) for m in models]
    worst = cells.loc[cells[cells["model"] == models[0]]["torque_Nm"].abs().idxmax()]
    finding = (
        f"{_short(models[0])} lacks {worst['torque_Nm']:+.2g} N m at {np.degrees(worst['angle_rad']):.0f} deg and "
        f"{np.degrees(worst['velocity_rad_s']):.0f} deg/s; {rms[0]:.2g} N m over the map"
    )
    title(figure, finding + (f", {_short(models[-1])} {rms[-1]:.2g}" if len(models) > 1 else ""))
    return figure


def draw_ranking(ranking: pd.DataFrame) -> Figure:
    """The catalogue weighed at each model, the most evident effects of each, a panel a model."""
    models = list(dict.fromkeys(ranking["model"]))
    figure, axes = canvas(len(models), 1, width=12.0, height=3.3 * len(models) + 1.1)
    for axis, model in zip(axes[:, 0], models, strict=True):
        rows = ranking[ranking["model"] == model]
        rows = pd.concat([rows.head(SHOWN), rows.iloc[SHOWN:].query("status == 'absorbed'")]).iloc[::-1]
        y = np.arange(len(rows))
        axis.barh(y, rows["delta_bic"], color=[STATUS[s] for s in rows["status"]], height=0.7)
        axis.set_xscale("symlog", linthresh=10, linscale=0.7)
        axis.axvline(THRESHOLD, color=MEASURED, linestyle=":", linewidth=2)
        axis.axvline(0, color=GREY, linewidth=0.8)
        axis.set_yticks(y, rows["effect"])
        axis.set_xlim(min(-10.0, rows["delta_bic"].min() * 1.2), max(40.0, rows["delta_bic"].max() * 1.5))
        beside = axis.get_yaxis_transform()
        for place, row in zip(y, rows.itertuples(), strict=True):
            axis.text(1.01, place, _remark(row), va="center", fontsize=9, color="#333333", transform=beside)
        axis.set_title(f"what to add to {_short(model)}? best {len(rows)} of {(ranking['model'] == model).sum()}")
        axis.grid(axis="y", visible=False)
    axes[-1, 0].set_xlabel(f"evidence for adding the effect, $\\Delta$BIC [-]; dotted: {THRESHOLD:.0f}, very strong")
    seen = [s for s in STATUS if (ranking["status"] == s).any()]
    handles = [Patch(color=STATUS[s]) for s in seen]
    figure.legend(handles, [MEANING[s] for s in seen], loc="outside lower left", ncols=3, frameon=False, fontsize=9)
    texts = []
    for model in models:
        best = ranking[ranking["model"] == model].iloc[0]
        supported = ranking[(ranking["model"] == model) & (ranking["status"] == "supported")]
        best = supported.iloc[0] if len(supported) else best
        verb = f"{best['effect']} ($\\Delta$BIC {best['delta_bic']:.0f})" if len(supported) else "nothing more"
        texts.append(f"{_short(model)}: {verb}")
    title(figure, "Evidence asks for " + "; ".join(texts))
    return figure


def draw_correlations(correlations: pd.DataFrame) -> Figure:
    """Correlation of the estimates of the parameters, of the first and of the last model."""
    models = _ends(correlations)
    figure, axes = canvas(1, len(models), width=4.6 * len(models) + 1.0, height=4.6)
    worst = []
    for axis, model in zip(axes[0], models, strict=True):
        table = correlations[correlations["model"] == model]
        names = list(dict.fromkeys(table["parameter"]))
        matrix = table.pivot(index="parameter", columns="other", values="correlation").loc[names, names].to_numpy()
        image = axis.imshow(matrix, cmap="RdBu_r", vmin=-1, vmax=1)
        short = [name.replace(".", ".\n") for name in names]
        axis.set_xticks(range(len(names)), short, rotation=60, ha="right", fontsize=9)
        axis.set_yticks(range(len(names)), short, fontsize=9)
        axis.grid(visible=False)
        for (i, j), value in np.ndenumerate(matrix):
            axis.text(
                j, i, f"{value:.2f}", ha="center", va="center", fontsize=8, color="w" if abs(value) > 0.6 else "k"
            )
        axis.set_title(_short(model))
        off = np.triu(np.abs(matrix), 1)
        i, j = np.unravel_index(off.argmax(), off.shape)
        worst.append(f"{names[i]} and {names[j]} ({matrix[i, j]:+.2f}) in {_short(model)}")
    figure.colorbar(image, ax=axes, label="correlation [-]", shrink=0.8)
    title(figure, f"Estimates most alike: {'; '.join(worst)}")
    return figure


def draw_ladder(ladder: pd.DataFrame) -> Figure:
    """Error and missing torque against the effects added.

    Args:
        ladder: columns source, model, train_rmse_deg, heldout_rmse_deg, noise_deg, missing_torque_Nm.
    """
    models = list(dict.fromkeys(ladder["model"]))
    figure, axes = canvas(1, 2, width=max(9.5, 2.0 * len(models) + 5), height=4.5, gridspec_kw={"width_ratios": [3, 2]})
    error, torque = axes[0]
    physics = ladder[ladder["source"] == "physics"]
    x = physics["model"].map(models.index)
    error.plot(x, physics["train_rmse_deg"], color=BLUE, marker="o", label="physical model, training trials")
    error.plot(
        x, physics["heldout_rmse_deg"], color=MODEL, marker="s", linestyle="--", label="physical model, held out"
    )
    networks = ladder[ladder["source"] != "physics"]
    for marker, (source, rows) in zip("^vD", networks.groupby("source", sort=False), strict=False):
        places = rows["model"].map(models.index)
        error.plot(
            places, rows["heldout_rmse_deg"], color=GREEN, marker=marker, linestyle="-.", label=f"{source}, held out"
        )
    noise = ladder["noise_deg"].iloc[0]
    error.axhline(noise, color=MEASURED, linestyle=":", linewidth=2, label=f"noise, {noise:.2g} deg")
    values = ladder[["train_rmse_deg", "heldout_rmse_deg"]].stack()
    if values.max() > WIDE / 2 * values.min():
        error.set_yscale("log")
    else:
        error.set_ylim(bottom=0)
    error.set_ylabel("RMSE [deg]")
    torque.bar(x, physics["missing_torque_Nm"], 0.55, color=SKY)
    torque.set_ylabel("missing torque, RMS [N m]")
    for axis in (error, torque):
        axis.set_xticks(range(len(models)), [m.replace("+", "\n+") for m in models])
        axis.set_xlim(-0.5, len(models) - 0.5)
        axis.grid(axis="x", visible=False)
    _legend(figure, error, columns=2)
    first, last = physics.iloc[0], physics.iloc[-1]
    if len(physics) == 1:
        finding = f"Nothing to add: {first['heldout_rmse_deg']:.2g} deg on held-out trials, noise is {noise:.2g} deg"
    else:
        finding = (
            f"With what was found the held-out error falls from {first['heldout_rmse_deg']:.2g} to "
            f"{last['heldout_rmse_deg']:.2g} deg, missing torque from {first['missing_torque_Nm']:.2g} to "
            f"{last['missing_torque_Nm']:.2g} N m"
        )
    title(figure, finding)
    return figure


def draw_parameters(parameters: pd.DataFrame) -> Figure:
    """Each identified parameter along the ladder with 95 % intervals, and its true value where that is known.

    Args:
        parameters: columns source, model, parameter, unit, value, se, error_pct.
    """
    models, names = (list(dict.fromkeys(parameters[c])) for c in ("model", "parameter"))
    columns = min(4, len(names))
    rows = -(-len(names) // columns)
    figure, axes = canvas(rows, columns, width=max(6.0, 3.0 * columns), height=2.9 * rows + 1.2, sharex=True)
    for axis, name in zip(axes.flat, names, strict=False):
        table = parameters[parameters["parameter"] == name]
        for i, (source, group) in enumerate(table.groupby("source", sort=False)):
            color, marker = ((BLUE, "o"), (GREEN, "^"), (ORANGE, "v"), (MODEL, "D"))[i % 4]
            place = group["model"].map(models.index) + 0.12 * i
            axis.errorbar(
                place,
                group["value"],
                yerr=1.96 * group["se"].fillna(0),
                fmt=marker,
                color=color,
                capsize=4,
                label=source,
            )
        if (truth := _truth(table)) is not None:
            axis.axhline(truth, color=MEASURED, linestyle=":", linewidth=1.8, label="true value")
        unit = table["unit"].dropna()
        axis.set_title(f"{name} [{unit.iloc[0]}]" if len(unit) else name)
        axis.margins(y=0.15)
        axis.grid(axis="x", visible=False)
        axis.ticklabel_format(axis="y", useOffset=False)
    for axis in list(axes.flat)[len(names) :]:
        axis.set_visible(False)
    for axis in axes.flat:
        axis.set_xlim(-0.4, len(models) - 0.4)
        axis.set_xticks(range(len(models)), [f"+{i}" if i else "base" for i in range(len(models))])
    axes[-1, 0].set_xlabel("  ".join(f"+{i}: {m.split('+')[-1]}" for i, m in enumerate(models) if i), loc="left")
    _legend(figure, axes[0, 0], columns=4)
    physics = parameters[parameters["source"] == "physics"]
    ends = [physics[physics["model"] == m] for m in (models[0], physics["model"].iloc[-1])]
    if physics["error_pct"].notna().any():
        errors = [rows["error_pct"].abs().max() for rows in ends]
        finding = f"Worst parameter error {errors[0]:.2g} % without, {errors[1]:.2g} % with what was found"
    else:
        shared = ends[0].merge(ends[1], on="parameter", suffixes=("_0", "_1"))
        moved = 100 * (shared["value_1"] / shared["value_0"] - 1)
        worst = moved.abs().idxmax()
        finding = f"Adding what was missing moves {shared['parameter'][worst]} by {moved[worst]:+.0f} %"
        finding = finding if len(models) > 1 else "Parameters with 95 % intervals"
    title(figure, finding)
    return figure


def _ends(table: pd.DataFrame) -> list[str]:
    """The first and the last model of a table; one where there is only one."""
    models = list(dict.fromkeys(table["model"]))
    return models if len(models) == 1 else [models[0], models[-1]]


def _style(order: int, models: list[str]) -> dict[str, str]:
    """How the first and the last model are drawn, the same in all pictures."""
    return FIRST_STYLE if order == 0 or len(models) == 1 else LAST_STYLE


def _ramp(order: int, count: int) -> str:
    """Colour of a model on the ladder: the first and the last as everywhere, others between."""
    if order == 0:
        return MODEL
    return BLUE if order == count - 1 else (ORANGE, PINK, SKY)[(order - 1) % 3]


def _short(model: str) -> str:
    return model.replace("+", " + ")


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:]


def _trial(name: object) -> str:
    return str(name).removeprefix("trial")


def _rms(values: pd.Series) -> float:
    return float(np.sqrt((values**2).mean()))


def _legend(figure: Figure, axis: Axes, *, columns: int) -> None:
    """One legend for all panels, below them."""
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, frameon=False)


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


def _remark(row: Any) -> str:
    """What is known of a candidate, in a few words."""
    if row.status == "absorbed":
        return f"absorbed by {row.absorbed_by.replace(' ', ', ')}"
    like = f"; like {row.confused_with.split(' ')[0]}" if row.confused_with else ""
    return f"{row.estimate.replace('+-', '±')}; won {row.folds_won} of {row.folds}{like}" if row.delta_bic > 0 else ""


def _truth(rows: pd.DataFrame) -> float | None:
    """The true value of a parameter, told from an estimate and its error."""
    known = rows[rows["error_pct"].notna()]
    return None if known.empty else float(known["value"].iloc[0] / (1 + known["error_pct"].iloc[0] / 100))
