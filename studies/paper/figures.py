"""Figures of the paper's own recipe beside the printed values (Figs. 8 and 11, Table 3)."""

import itertools
from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from myowave.learning.tables import judge_scales
from myowave.plotting import CYCLE, GREY, MEASURED, canvas, shade, title
from studies.paper.tables import PARAMETERS, PRINTED_TEST


def draw_scales(cases: pd.DataFrame, subject: pd.DataFrame) -> Figure:
    """Test R2 against the number of scales: the cases of Sec. 4, and Sec. 5's protocol with the printed values."""
    figure, axes = canvas(1, 2, width=11, height=4.4)
    for axis, summary, what in zip(axes[0], (cases, subject), ("Sec. 4", "Sec. 5, three trials"), strict=True):
        lines = [line for line in summary.groupby(["dataset", "recipe"]) if line[1]["scales"].nunique() > 1]
        colors = dict(zip(summary["dataset"].unique(), itertools.cycle(CYCLE), strict=False))
        markers = dict(zip(summary["recipe"].unique(), itertools.cycle("osD^v"), strict=False))
        for (dataset, recipe), group in lines:
            scores = group.groupby("scales")["test_r2"]
            mean, spread = scores.mean(), scores.std(ddof=0)
            look = {"color": colors[dataset], "marker": markers[recipe], "label": f"{dataset}, {recipe}"}
            shade(axis, mean.index, mean - spread, mean, mean + spread, **look)
        axis.set(xlabel="number of scales", ylabel="test R$^2$ [-]", title=f"{what}: mean and 1 SD over seeds")
        axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    printed = pd.Series({scales: r2 for scales, (_, r2) in PRINTED_TEST.items()})
    axes[0, 1].plot(printed.index, printed, linestyle="--", marker="x", color=GREY, label="paper's subject, Table 4")
    for axis in axes[0]:
        axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
    findings = pd.concat([judge_scales(cases), judge_scales(subject)])
    helped = findings["finding"].str.startswith("helps").sum()
    title(
        figure,
        f"More scales help beyond the scatter of seeds in {helped} of {len(findings)} pairs of dataset and recipe",
    )
    return figure


def draw_errors(errors: pd.DataFrame) -> Figure:
    """Error of each identified parameter by dataset, mean and SD over seeds, beside Table 3; a row for each recipe.

    Args:
        errors: from `tables.parameter_errors`.
    """
    errors = errors.sort_values("dataset")
    recipes = sorted(errors["recipe"].unique())
    figure, axes = canvas(len(recipes), len(PARAMETERS), width=13, height=1.0 + 3.2 * len(recipes))
    for row, recipe in zip(axes, recipes, strict=True):
        for axis, name in zip(row, PARAMETERS, strict=True):
            here = errors[(errors["recipe"] == recipe) & (errors["parameter"] == name)]
            place = np.arange(len(here))
            look = {"fmt": "o", "color": CYCLE[0], "capsize": 4, "label": "here"}
            axis.errorbar(place - 0.1, here["error_pct"], yerr=here["sd_pct"], **look)
            look = {"fmt": "x", "color": GREY, "capsize": 4, "label": "paper, Table 3"}
            axis.errorbar(place + 0.1, here["paper_error_pct"], yerr=here["paper_sd_pct"], **look)
            axis.axhline(0.0, color=MEASURED, linewidth=0.8)
            axis.set_xticks(place, here["dataset"], rotation=30, ha="right")
            axis.set(title=name, ylabel=f"{recipe}\nerror [%]" if name == PARAMETERS[0] else "")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    worst = errors["error_pct"].abs().groupby(errors["recipe"]).max()
    found = "; ".join(f"{error:.2g} % with {recipe}" for recipe, error in worst.items())
    title(figure, f"Parameters are off by up to {found}; the paper prints up to 0.5 %")
    return figure


def draw_convergence(histories: Mapping[str, Mapping[int, pd.DataFrame]], batches: int) -> Figure:
    """Error as training goes on: one step ahead on what trains, running free on what validates (as Fig. 8).

    Args:
        histories: {dataset: {number of scales: its history}}.
        batches: steps of Adam in an epoch.
    """
    figure, axes = canvas(2, len(histories), width=4.2 * len(histories) + 1, height=6.6, sharex=True, sharey="row")
    ends = []
    for column, (dataset, by_scales) in enumerate(histories.items()):
        for color, (scales, history) in zip(CYCLE, sorted(by_scales.items()), strict=False):
            for row, name in ((0, "data_loss"), (1, "val_mse")):
                error = np.log10(np.degrees(np.sqrt(history.set_index("epoch")[name]))).groupby("epoch")
                steps = error.mean().index.to_numpy() * batches
                mean, spread = error.mean().to_numpy(), error.std(ddof=0).to_numpy()
                band = 10 ** (mean - spread), 10**mean, 10 ** (mean + spread)
                shade(axes[row, column], steps, *band, color=color, label=f"{scales}-scale")
            ends.append(10 ** mean[-1])
        axes[0, column].set_title(f"{dataset}: one step ahead, training")
        axes[1, column].set(title=f"{dataset}: running free, validation", xlabel="steps of Adam")
    for row in axes:
        row[0].set(ylabel="rms error [deg]", yscale="log")
    axes[0, 0].legend()
    title(figure, f"Running free, the error at the end is {min(ends):.1f} to {max(ends):.1f} deg")
    return figure
