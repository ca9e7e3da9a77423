"""Figures of the paper's own recipe beside the printed values (Figs. 8 and 11, Table 3)."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from myowave.learning.paper.tables import PARAMETERS, PRINTED_ERROR_PCT, PRINTED_TEST, judge_scales
from myowave.plotting import CYCLE, GREY, MEASURED, canvas, shade, title


def draw_scales(cases: pd.DataFrame, subject: pd.DataFrame) -> Figure:
    """Test R2 against the number of scales: the cases of Sec. 4, and Sec. 5's protocol with the printed values."""
    figure, axes = canvas(1, 2, width=11, height=4.4)
    for axis, summary, what in zip(axes[0], (cases, subject), ("Sec. 4", "Sec. 5, three trials"), strict=True):
        for (name, group), color, marker in zip(summary.groupby("dataset"), CYCLE, "osD^", strict=False):
            scores = group.groupby("scales")["test_r2"]
            mean, spread = scores.mean(), scores.std(ddof=0).to_numpy()
            shade(axis, mean.index.to_numpy(), mean.to_numpy(), spread, color=color, label=name, marker=marker)
        axis.set(xlabel="number of scales", ylabel="test R$^2$ [-]", title=f"{what}: mean and 1 SD over seeds")
        axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    printed = pd.Series({scales: r2 for scales, (_, r2) in PRINTED_TEST.items()})
    axes[0, 1].plot(printed.index, printed, linestyle="--", marker="x", color=GREY, label="paper's subject, Table 4")
    for axis in axes[0]:
        axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3)
    findings = pd.concat([judge_scales(cases), judge_scales(subject)])
    helped = (findings["finding"] == "helps").sum()
    title(figure, f"More scales help beyond the scatter of seeds in {helped} of {len(findings)} datasets")
    return figure


def draw_errors(summary: pd.DataFrame) -> Figure:
    """Error of each identified parameter by case, mean and SD over seeds, beside Table 3."""
    cases = sorted(summary["dataset"].unique())
    most = summary[summary["scales"] == summary["scales"].max()]
    figure, axes = canvas(1, len(PARAMETERS), width=12, height=3.8)
    for axis, name in zip(axes[0], PARAMETERS, strict=True):
        errors = most.groupby("dataset")[f"{name}_error_pct"]
        printed = np.array([PRINTED_ERROR_PCT[case][name] for case in cases])
        place = np.arange(len(cases))
        axis.errorbar(
            place - 0.1,
            errors.mean()[cases],
            yerr=errors.std(ddof=0)[cases],
            fmt="o",
            color=CYCLE[0],
            capsize=4,
            label="here",
        )
        axis.errorbar(
            place + 0.1, printed[:, 0], yerr=printed[:, 1], fmt="x", color=GREY, capsize=4, label="paper, Table 3"
        )
        axis.axhline(0.0, color=MEASURED, linewidth=0.8)
        axis.set_xticks(place, cases)
        axis.set(title=name, ylabel="error [%]" if name == PARAMETERS[0] else "")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    worst = max(most.groupby("dataset")[f"{name}_error_pct"].mean().abs().max() for name in PARAMETERS)
    title(figure, f"The paper's recipe: parameters are off by up to {worst:.2g} % here; the paper prints up to 0.5 %")
    return figure


def draw_derivatives(
    histories: Mapping[str, pd.DataFrame], truth: Mapping[str, float], recipes: Mapping[str, Mapping[str, Any]]
) -> Figure:
    """What each choice of the recipe identifies: error of each parameter as training goes on.

    Args:
        histories: {recipe: its history}.
        truth: true values of `PARAMETERS`.
        recipes: {recipe: its settings}, the one as printed first.
    """
    figure, axes = canvas(1, len(PARAMETERS), width=13, height=5.0)
    errors = {recipe: _errors_by_epoch(histories[recipe], truth) for recipe in recipes}
    for (recipe, settings), color in zip(recipes.items(), CYCLE, strict=False):
        by_time = settings["derivative"] == "time"
        cell, weight, noise = settings["cell"].upper(), f"{settings['beta']:.0e}", f"{settings['history_noise']:g}"
        label = f"{cell}, {'t$_n$' if by_time else 'sequence'}, beta {weight}, noise {noise} rad"
        for axis, name in zip(axes[0], PARAMETERS, strict=True):
            axis.plot(errors[recipe][name], color=color, label=label, linestyle="--" if by_time else "-")
    for axis, name in zip(axes[0], PARAMETERS, strict=True):
        axis.set(title=name, xlabel="epoch", ylim=(0, None))
    axes[0, 0].set_ylabel("error [%], root mean square over seeds")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    last = {recipe: table.iloc[-1].max() for recipe, table in errors.items()}
    names = {"time": "t$_n$", "sequence": "the sequence"}
    kinds = {
        kind: min(last[recipe] for recipe, settings in recipes.items() if settings["derivative"] == kind)
        for kind in dict.fromkeys(settings["derivative"] for settings in recipes.values())
    }
    best = "; ".join(f"by {names[kind]} {error:.2g} %" for kind, error in kinds.items())
    title(figure, f"Largest error of a parameter at the end, the best recipe of each derivative: {best}")
    return figure


def _errors_by_epoch(history: pd.DataFrame, truth: Mapping[str, float]) -> pd.DataFrame:
    """Error of each parameter [%] by epoch, root mean square over seeds."""
    values = history.set_index("epoch")[list(PARAMETERS)]
    return np.sqrt((100 * (values / pd.Series(truth) - 1)).pow(2).groupby("epoch").mean())
