"""A picture of many subjects."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from myowave.physics.constants import constant_unit
from myowave.plotting import BLUE, GREY, RED, canvas, title

_PARAMETERS = 6  # panels that can still be read
_NAMES = 12  # subjects whose names have room below an axis; more are numbered as in the table, from 1


def draw_subjects(table: pd.DataFrame) -> Figure:
    """Verdicts of all subjects, their errors before and after, and their parameters with standard errors.

    Args:
        table: from `table.tabulate_subjects`.
    """
    first, last = table.groupby("subject", sort=False).head(1), table[table["found"]]
    first, last = first.reset_index(drop=True), last.reset_index(drop=True)
    names = [column.removesuffix("_se") for column in table.columns if column.endswith("_se")]
    names = [name for name in names if first[name].notna().all()][:_PARAMETERS]
    columns = 2 + len(names)
    rows = -(-columns // 3)
    figure, axes = canvas(rows, 3, width=12, height=3.2 * rows + 0.5)
    kinds = last["verdict"].where(last["effects"] == "", last["effects"]).value_counts()[::-1]
    bars = axes.flat[0].barh(kinds.index, kinds, color=BLUE, zorder=2)
    axes.flat[0].bar_label(bars, padding=3)
    axes.flat[0].set(xlabel="subjects", title="verdict", xlim=(0, 1.15 * kinds.max()))
    axes.flat[0].xaxis.set_major_locator(MaxNLocator(integer=True))
    x = np.arange(1, len(last) + 1)
    error = axes.flat[1]
    error.plot(x, first["heldout_rmse_deg"], "x", color=GREY, label="base model")
    error.plot(x, last["heldout_rmse_deg"], "o", color=RED, markersize=4, label="with what was found")
    error.set(ylabel="held-out error [deg]", title="error", yscale="log")
    within_a_decade = table["heldout_rmse_deg"].max() < 10 * table["heldout_rmse_deg"].min()
    error.yaxis.set_major_locator(LogLocator(subs=(1, 2, 3, 5, 7) if within_a_decade else (1,)))
    error.yaxis.set_major_formatter("{x:g}")
    error.yaxis.set_minor_formatter(NullFormatter())
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    for axis, name in zip(axes.flat[2:], names, strict=False):
        axis.errorbar(x, last[name], yerr=last[f"{name}_se"].fillna(0), fmt="o", color=BLUE, markersize=4, capsize=2)
        axis.set(title=name, ylabel=f"{name} [{constant_unit(name)}]")
    for axis in axes.flat[1:columns]:
        if len(last) <= _NAMES:
            axis.set_xticks(x, last["subject"], rotation=30 if len(last) > 6 else 0)
        else:
            axis.set_xlabel("subject")
            axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    for axis in axes.flat[columns:]:
        axis.set_visible(False)
    fell = (last["heldout_rmse_deg"] < first["heldout_rmse_deg"]).sum()
    title(figure, f"{len(last)} subjects: with what the diagnosis added the error is smaller in {fell}")
    return figure
