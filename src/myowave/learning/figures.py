"""Pictures of training: loss and test metrics against scales, predictions, identified parameters.

As in Taneja et al. 2023, Figs. 8, 10 and 11. Tables come in as the rules write them; see `evaluation`.
"""

from collections.abc import Iterable
from io import StringIO
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from myowave.physics.constants import constant_of
from myowave.plotting import CYCLE, GREY, MEASURED, MODEL, canvas, shade, title
from myowave.scores import TITLES, median_over_seeds

ALIKE = 5.0  # %: seeds whose parameters scatter less are said to agree
LINES = ("-", "--", ":", "-.", (0, (1, 4)))  # of baselines
BAND = {"color": MODEL, "alpha": 0.22, "linewidth": 0, "label": "90 % band"}
ABREAST = 4  # parameters in a row of panels
LEAST_SPAN = 0.01  # of a value: to both sides of it an axis shows at least that, as less is no finding


def draw_metrics(summary: pd.DataFrame, histories: dict[int, pd.DataFrame], baselines: pd.DataFrame) -> Figure:
    """Training loss, test MSE and test R2 against the number of scales (Figs. 8 and 11), beside baselines.

    Args:
        summary: rows of summary.csv of one dataset, model and recipe.
        baselines: such rows of baselines on the same dataset; those that do worse than the mean angle are not drawn.
        histories: {number of scales: columns epoch, seed, loss}, epochs counted through all scales.
    """
    figure, axes = canvas(1, 3, width=12, height=4.0)
    loss, mse, r2 = axes[0]
    for color, (scales, history) in zip(CYCLE, sorted(histories.items()), strict=False):
        by_epoch = np.log10(history.groupby("epoch")["loss"].agg(lambda x: max(x.mean(), 1e-12)))
        spread = history.groupby("epoch")["loss"].agg(lambda x: np.std(np.log10(np.maximum(x, 1e-12))))
        smooth = by_epoch.rolling(max(1, len(by_epoch) // 150), min_periods=1).median()
        shade(loss, smooth.index, smooth - spread, smooth, smooth + spread, color=color, label=f"{scales}-scale")
    loss.set(xlabel="epoch", ylabel="log10 of training loss [rad$^2$]", title="training loss")
    loss.legend()
    shown, rivals = _medians(summary, "scales"), _medians(baselines, "recipe")
    for axis, column, label in ((mse, "test_mse", "test MSE [rad$^2$]"), (r2, "test_r2", "test R$^2$ [-]")):
        _each_seed(axis, summary, column, shown[column], marker="o")
        for (name, median), style in zip(rivals.loc[rivals["test_r2"] > 0, column].items(), LINES, strict=False):
            axis.axhline(median, color=GREY, linestyle=style, label=TITLES.get(name, name))
        axis.set(ylabel=label, title=f"{label.split(' [')[0]}: median and each seed")
    if r2.get_legend_handles_labels()[1]:
        r2.legend(title="baselines")
    r2s, numbers = " / ".join(f"{v:.4f}" for v in shown["test_r2"]), " / ".join(map(str, shown.index))
    scores = f"{r2s} (median of seeds) with {numbers} scales"
    beaten = _beaten(shown["test_r2"].max(), rivals["test_r2"])
    title(figure, f"{_what(summary)}: test R$^2$ is {scores}{beaten}")
    return figure


def _medians(table: pd.DataFrame, by: str) -> pd.DataFrame:
    """Scores that are shown of the rows of each value in a column."""
    of = {value: median_over_seeds(rows) for value, rows in table.groupby(by)}
    return pd.DataFrame(of, index=["test_mse", "test_r2"]).T


def _each_seed(axis: Axes, summary: pd.DataFrame, column: str, middle: pd.Series, **style: Any) -> None:
    """A column against the number of scales: every seed, and the middle of all."""
    axis.errorbar(middle.index, middle, color=CYCLE[0], **style)
    axis.plot(summary["scales"], summary[column], ".", color=GREY, markersize=5, zorder=3)
    axis.set_xlabel("number of scales")
    axis.set_xticks(list(middle.index))


def _beaten(best: float, rivals: pd.Series) -> str:
    """What the best baseline does beside the best network, by R2."""
    if rivals.empty:
        return ""
    name, r2 = rivals.idxmax(), rivals.max()
    return f"; the best baseline, {TITLES.get(name, name)}, has {r2:.4f}" + (", which is better" if r2 > best else "")


def draw_predictions(predictions: dict[int, pd.DataFrame], summary: pd.DataFrame) -> Figure:
    """Free-running prediction of the test trials against the measurement, one panel per number of scales (Fig. 10).

    Args:
        predictions: {number of scales: columns trial, seed, time_s, angle_rad, predicted_rad, role}.
        summary: rows of summary.csv of the same runs.
    """
    tested = {scales: predictions[scales].query("role == 'test'") for scales in sorted(predictions)}
    trials = sorted(next(iter(tested.values()))["trial"].unique())
    width, height = max(6.5, 4.0 * len(tested)), 2.7 * len(trials) + 1.2
    figure, axes = canvas(len(trials), len(tested), width=width, height=height, sharex=True, sharey=True)
    for column, (scales, table) in enumerate(tested.items()):
        for axis, trial in zip(axes[:, column], trials, strict=True):
            angles = ["angle_rad", "predicted_rad", "low_rad", "high_rad"]  # the prediction is the mean of seeds
            shown = np.rad2deg(table[table["trial"] == trial].groupby("time_s")[angles].mean())
            axis.plot(shown["angle_rad"], color=MEASURED, label="measured", linewidth=2.0)
            axis.plot(shown["predicted_rad"], color=MODEL, label="predicted, mean of seeds", linestyle="--")
            axis.fill_between(shown.index, shown["low_rad"], shown["high_rad"], **BAND)
            if column == 0:
                axis.set_ylabel(f"trial {str(trial).removeprefix('trial')}\nangle [deg]")
        axes[-1, column].set_xlabel("time [s]")
        scores = median_over_seeds(summary[summary["scales"] == scales])
        coverage = scores["band_coverage"]
        axes[0, column].set_title(
            f"{scales}-scale: R$^2$ {scores['test_r2']:.4f}, {scores['test_rmse_deg']:.3g} deg\n"
            + ("no band" if np.isnan(coverage) else f"the band holds {100 * coverage:.0f} %")
        )
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=2)
    missed = min(median_over_seeds(rows)["test_rmse_deg"] for _, rows in summary.groupby("scales"))
    unseen = "unseen trials are" if len(trials) > 1 else "the unseen trial is"
    title(figure, f"{_what(summary)}: running free, {unseen} missed by {missed:.3g} deg (median over seeds)")
    return figure


def draw_prediction(lines: Iterable[str], given: Iterable[str], what: str, step: float) -> Figure:
    """A prediction with its band, beside the measured angle where the samples have one.

    Args:
        lines: of `streaming.command.predict_lines`; `given`: those that it was made of.
        what: is predicted.
        step: between those lines [s], where they have no times.
    """
    predicted, samples = _in_degrees(lines), _in_degrees(given)
    figure, axes = canvas(1, 1, width=9.0, height=3.6)
    axis, time = axes[0, 0], predicted["time_s"]
    if "angle" in samples:
        at = samples.get("time_s", step * samples.index)
        axis.plot(at, samples["angle"], color=MEASURED, label="measured", linewidth=2.0)
    axis.plot(time, predicted["angle"], color=MODEL, linestyle="--", label="predicted")
    if "low" in predicted:
        axis.fill_between(time, predicted["low"], predicted["high"], **BAND)
    axis.set(xlabel="time [s]", ylabel="elbow angle [deg]")
    figure.legend(loc="outside lower center", ncols=3)
    title(figure, what)
    return figure


def _in_degrees(lines: Iterable[str]) -> pd.DataFrame:
    """Lines of CSV as a table, with angles in degrees beside the columns that are named after their unit; where there
    are both, those in radians count, as in `streaming.reading`."""
    table = pd.read_csv(StringIO("\n".join(line.rstrip("\n") for line in lines))).rename(columns=str.strip)
    angles: dict[str, pd.Series] = {}
    for unit, turn in (("_deg", 1.0), ("_rad", np.degrees(1.0))):
        named = [name for name in table if name.endswith(unit)]
        angles |= {name.removesuffix(unit): turn * pd.to_numeric(table[name], errors="coerce") for name in named}
    return table.assign(**angles)


def draw_parameters(summary: pd.DataFrame, names: list[str]) -> Figure:
    """Identified parameters, seed by seed: the error where the truth is known, else the value."""
    rows, columns = max(1, -(-len(names) // ABREAST)), max(1, min(ABREAST, len(names)))
    figure, axes = canvas(rows, columns, width=max(7.0, 2.9 * columns), height=3.2 * rows + 0.4)
    if not names:
        title(figure, f"{_what(summary)}: nothing is identified")
        return figure
    known = all(summary[f"{name}_error_pct"].notna().all() for name in names)
    shown = [f"{name}_error_pct" if known else name for name in names]
    groups = summary.groupby("scales")[shown]
    middle, spread = groups.mean(), groups.std(ddof=0)
    for axis in axes.flat[len(names) :]:
        axis.set_axis_off()
    for axis, name, column in zip(axes.flat, names, shown, strict=False):
        _each_seed(axis, summary, column, middle[column], yerr=spread[column], fmt="o", capsize=4)
        if known:
            axis.axhline(0.0, color=MEASURED, linewidth=0.8)
            axis.set_ylabel("error [%]")
        else:
            # A dot is in names of effects' parameters.
            axis.set_ylabel(f"value [{'SI units' if '.' in name else constant_of(name).unit}]")
            centre, half = float(np.mean(axis.get_ylim())), float(np.ptp(axis.get_ylim())) / 2
            axis.set_ylim(centre + np.array([-1, 1]) * max(half, LEAST_SPAN * abs(centre)))
        axis.set_title(name)
        axis.set_xlim(summary["scales"].min() - 0.5, summary["scales"].max() + 0.5)
    if known:
        worst = float(middle.abs().max().max())
        finding = f"largest mean error of an identified parameter is {worst:.2g} %"
    else:
        differ = max(100 * float((spread / middle.abs()).max().max()), 0.001)
        agree = "agree on the parameters within" if differ < ALIKE else "differ in a parameter by up to"
        finding = f"seeds {agree} {differ:.2g} % (1 SD); the truth is not known"
    title(figure, f"{_what(summary)}: {finding}")
    return figure


def _what(summary: pd.DataFrame) -> str:
    first = summary.iloc[0]
    return f"{first['dataset']}, {first['model']}, recipe {first['recipe']}"
