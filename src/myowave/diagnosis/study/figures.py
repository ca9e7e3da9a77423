"""How often the diagnosis is right, over all hidden effects of the study."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from myowave.plotting import canvas, title

NOTHING = "nothing"


def draw_study(cases: pd.DataFrame, summary: Mapping[str, Any]) -> Figure:
    """What was answered for each hidden effect, and how often that was right with each noise.

    Args:
        cases: as `study.study_effect` gives them, of all effects.
        summary: from `study.summarize`.
    """
    cases = cases[(cases["signal"] >= 1) | (cases["hidden"] == "none")]
    answered, right = answers(cases), hit_rates(cases)
    figure, axes = canvas(
        1, 2, width=15.0, height=2.6 + 0.27 * len(answered), width_ratios=[answered.shape[1], 0.42 * len(answered)]
    )
    rates = ", ".join(f"{rate['hit_pct']:.0f} %" for rate in summary["by_noise"].values())
    noises = ", ".join(f"{float(noise):g}" for noise in summary["by_noise"])
    title(
        figure,
        f"Detectable effects are found in {rates} of cases at {noises} deg of noise; "
        f"{summary['false_alarms']} false alarms in {summary['clean']} sets without an effect",
    )
    _heat(axes[0, 0], answered, "share of cases in which the answer holds the effect, alone or in a class [%]")
    _heat(axes[0, 1], right, "right: named, or one of two [%]", smallest=0.0)
    axes[0, 0].set_ylabel("hidden effect")
    axes[0, 0].set_xlabel("in the answer")
    axes[0, 1].set_xlabel("noise of the angle [deg]")
    axes[0, 1].set_yticks([])
    return figure


def answers(cases: pd.DataFrame) -> pd.DataFrame:
    """Percentage of the cases with a hidden effect (rows) whose answer holds each effect (columns)."""
    effects = list(dict.fromkeys(name for hidden in cases["hidden"] if hidden != "none" for name in hidden.split("+")))
    held = pd.DataFrame(
        {
            **{e: [e in found.replace("/", " ").split() for found in cases["found"]] for e in effects},
            NOTHING: (cases["found"] == "").to_numpy(),
        },
        index=cases["hidden"],
    )
    order = list(dict.fromkeys(cases["hidden"]))
    return 100 * held.groupby(level=0).mean().loc[order]


def hit_rates(cases: pd.DataFrame) -> pd.DataFrame:
    """Percentage of right answers for each hidden effect (rows) and noise (columns); nan where none is detectable."""
    right = cases.assign(right=np.where(cases["hidden"] == "none", cases["verdict"] == "adequate", cases["hit"]))
    rates = 100 * right.pivot_table(index="hidden", columns="noise_deg", values="right", aggfunc="mean")
    return rates.loc[list(dict.fromkeys(cases["hidden"]))]


def _heat(axis: Axes, table: pd.DataFrame, label: str, *, smallest: float = 0.5) -> None:
    """A table of percentages in colours; numbers below `smallest` are not written."""
    values = table.to_numpy(float)
    axis.imshow(values, cmap="Blues", vmin=0, vmax=100, aspect="auto")
    for (i, j), value in np.ndenumerate(values):
        if value >= smallest:
            axis.text(j, i, f"{value:.0f}", ha="center", va="center", fontsize=8, color="w" if value > 60 else "k")
        elif not np.isfinite(value):
            axis.text(j, i, "-", ha="center", va="center", fontsize=8, color="#888888")
    names = [f"{c:g}" if isinstance(c, float) else c for c in table.columns]
    turned = len(names) > 5
    axis.set_xticks(range(len(names)), names, rotation=60 if turned else 0, ha="right" if turned else "center")
    axis.set_yticks(
        range(len(table)), [name.replace("+", " + ") for name in table.index.where(table.index != "none", "no effect")]
    )
    axis.set_title(label)
    axis.grid(visible=False)
