"""Pictures of training: loss and test metrics against scales, predictions, identified parameters.

As in Taneja et al. 2023, Figs. 8, 10 and 11. Tables come in as the rules write them; see `evaluation`.
"""

import re
from collections.abc import Sequence
from io import StringIO

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from myowave.physics.constants import constant_unit
from myowave.plotting import CYCLE, GREY, MEASURED, MODEL, canvas, shade, title
from myowave.scores import median_over_seeds

ALIKE = 5.0  # %: seeds whose parameters scatter less are said to agree
LINES = ("-", "--", ":", "-.", (0, (1, 4)))  # of baselines
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
        epochs = by_epoch.index.to_numpy()
        shade(loss, epochs, smooth.to_numpy(), spread.to_numpy(), color=color, label=f"{scales}-scale")
    loss.set(xlabel="epoch", ylabel="log10 of training loss [rad$^2$]", title="training loss")
    loss.legend()
    groups = summary.groupby("scales")
    for axis, column, label in ((mse, "test_mse", "test MSE [rad$^2$]"), (r2, "test_r2", "test R$^2$ [-]")):
        median = groups[column].median()
        axis.plot(median.index, median, color=CYCLE[0], marker="o")
        axis.plot(summary["scales"], summary[column], ".", color=GREY, markersize=5, zorder=3)
        for (name, rivals), style in zip(rivals_of(baselines).groupby("recipe"), LINES, strict=False):
            axis.axhline(rivals[column].median(), color=GREY, linestyle=style, label=name)
        axis.set(xlabel="number of scales", ylabel=label, title=f"{label.split(' [')[0]}: median and each seed")
        axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    if r2.get_legend_handles_labels()[1]:
        r2.legend(title="baselines")
    median = pd.Series({scales: median_over_seeds(rows)["test_r2"] for scales, rows in groups})
    scores = f"{_range(median)} (median of seeds) with {_words(median.index)} scales"
    title(figure, f"{_what(summary)}: test R$^2$ is {scores}{_beaten(median.max(), baselines)}")
    return figure


def rivals_of(baselines: pd.DataFrame) -> pd.DataFrame:
    """Rows of baselines whose median test R2 is above 0."""
    return baselines.groupby("recipe").filter(lambda rows: rows["test_r2"].median() > 0)


def _beaten(best: float, baselines: pd.DataFrame) -> str:
    """What the best baseline does beside the best network."""
    if baselines.empty:
        return ""
    rivals = baselines.groupby("recipe")["test_r2"].median()
    name, r2 = rivals.idxmax(), rivals.max()
    return f"; the best baseline, {name}, has {r2:.4f}" + (", which is better" if r2 > best else "")


def draw_predictions(predictions: dict[int, pd.DataFrame], summary: pd.DataFrame) -> Figure:
    """Free-running prediction of the test trials against the measurement, one panel per number of scales (Fig. 10).

    Args:
        predictions: {number of scales: columns trial, seed, time_s, angle_rad, predicted_rad, role}.
        summary: rows of summary.csv of the same runs.
    """
    panels = sorted(predictions)
    trials = sorted(predictions[panels[0]].query("role == 'test'")["trial"].unique())
    figure, axes = canvas(
        len(trials),
        len(panels),
        width=max(6.5, 4.0 * len(panels)),
        height=2.7 * len(trials) + 1.2,
        sharex=True,
        sharey=True,
    )
    for column, scales in enumerate(panels):
        table = predictions[scales].query("role == 'test'")
        for row, trial in enumerate(trials):
            axis = axes[row, column]
            rows = table[table["trial"] == trial]
            wide = np.rad2deg(rows.pivot(index="time_s", columns="seed", values="predicted_rad"))
            measured = np.rad2deg(rows.groupby("time_s")["angle_rad"].first())
            axis.plot(measured.index, measured, color=MEASURED, label="measured", linewidth=2.0)
            axis.plot(wide.index, wide.mean(axis=1), color=MODEL, label="predicted, mean of seeds", linestyle="--")
            ends = np.rad2deg(rows.groupby("time_s")[["low_rad", "high_rad"]].first())
            axis.fill_between(
                ends.index, ends["low_rad"], ends["high_rad"], color=MODEL, alpha=0.22, linewidth=0, label="90 % band"
            )
            axis.set_xlabel("time [s]" if row == len(trials) - 1 else "")
            axis.set_ylabel(f"trial {str(trial).removeprefix('trial')}\nangle [deg]" if column == 0 else "")
        shown = median_over_seeds(summary[summary["scales"] == scales])
        coverage = shown["band_coverage"]
        axes[0, column].set_title(
            f"{scales}-scale: R$^2$ {shown['test_r2']:.4f}, {shown['test_rmse_deg']:.3g} deg\n"
            + ("no band" if np.isnan(coverage) else f"the band holds {coverage:.0%}")
        )
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=2)
    title(figure, f"{_what(summary)}: free-running prediction of the unseen trial, scores are medians over seeds")
    return figure


def draw_prediction(told: Sequence[str], given: Sequence[str], what: str) -> Figure:
    """A prediction with its band, beside the measured angle where the samples have one.

    Args:
        told: lines of `streaming.command.predict_lines`; `given`: those that it was made of.
        what: is predicted.
    """
    predicted, samples = (
        pd.read_csv(StringIO("\n".join(line.rstrip("\n") for line in lines))) for lines in (told, given)
    )
    predicted, samples = (_in_degrees(table) for table in (predicted, samples))
    figure, axes = canvas(1, 1, width=9.0, height=3.6)
    axis, time = axes[0, 0], predicted["time_s"]
    if "angle" in samples:
        begin = time.iloc[0] if "time_s" not in samples else 0.0
        at = samples.get("time_s", begin + samples.index * np.median(np.diff(time)))
        axis.plot(at, pd.to_numeric(samples["angle"], errors="coerce"), color=MEASURED, label="measured", linewidth=2.0)
    axis.plot(time, predicted["angle"], color=MODEL, linestyle="--", label="predicted")
    if "low" in predicted:
        band = {"color": MODEL, "alpha": 0.22, "linewidth": 0, "label": "90 % band"}
        axis.fill_between(time, predicted["low"], predicted["high"], **band)
    axis.set(xlabel="time [s]", ylabel="elbow angle [deg]")
    figure.legend(loc="outside lower center", ncols=3)
    title(figure, what)
    return figure


def _in_degrees(table: pd.DataFrame) -> pd.DataFrame:
    """A table whose angles, in columns named after their unit, are in degrees, and named without it."""
    turned = {name: np.degrees(pd.to_numeric(table[name], errors="coerce")) for name in table if name.endswith("_rad")}
    return table.assign(**turned).rename(columns=lambda name: re.sub("_(rad|deg)$", "", name))


def draw_parameters(summary: pd.DataFrame, names: list[str]) -> Figure:
    """Identified parameters, seed by seed: the error where the truth is known, else the value."""
    figure, axes = canvas(1, max(1, len(names)), width=max(7.0, 2.9 * len(names)), height=3.6)
    if not names:
        title(figure, f"{_what(summary)}: nothing is identified")
        return figure
    known = all(summary[f"{name}_error_pct"].notna().all() for name in names)
    for axis, name in zip(axes[0], names, strict=True):
        column = f"{name}_error_pct" if known else name
        groups = summary.groupby("scales")[column]
        axis.errorbar(
            groups.mean().index, groups.mean(), yerr=groups.std(ddof=0), fmt="o", color=CYCLE[0], capsize=4, zorder=3
        )
        axis.plot(summary["scales"], summary[column], ".", color=GREY, markersize=5)
        if known:
            axis.axhline(0.0, color=MEASURED, linewidth=0.8)
        else:
            middle, half = float(np.mean(axis.get_ylim())), float(np.ptp(axis.get_ylim())) / 2
            axis.set_ylim(middle + np.array([-1, 1]) * max(half, LEAST_SPAN * abs(middle)))
        axis.set(xlabel="number of scales", title=name, ylabel="error [%]" if known else f"value [{_unit(name)}]")
        axis.xaxis.set_major_locator(MaxNLocator(integer=True))
        axis.set_xlim(summary["scales"].min() - 0.5, summary["scales"].max() + 0.5)
    if known:
        worst = max(abs(summary.groupby("scales")[f"{n}_error_pct"].mean()).max() for n in names)
        finding = f"largest mean error of an identified parameter is {worst:.2g} %"
    else:
        groups = summary.groupby("scales")[names]
        worst = float((groups.std(ddof=0) / groups.mean().abs()).max().max())
        differ = max(100 * worst, 0.001)
        agree = "agree on the parameters within" if differ < ALIKE else "differ in a parameter by up to"
        finding = f"seeds {agree} {differ:.2g} % (1 SD); the truth is not known"
    title(figure, f"{_what(summary)}: {finding}")
    return figure


def _what(summary: pd.DataFrame) -> str:
    first = summary.iloc[0]
    return f"{first['dataset']}, {first['model']}, recipe {first['recipe']}"


def _range(values: pd.Series) -> str:
    return " / ".join(f"{v:.4f}" for v in values)


def _words(values: pd.Index) -> str:
    return " / ".join(str(v) for v in values)


def _unit(name: str) -> str:
    return "SI units" if "." in name else constant_unit(name)  # a dot is in names of effects' parameters
