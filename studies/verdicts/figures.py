"""How often the diagnosis is right, world by world."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from myowave.plotting import canvas, title
from studies.verdicts.summary import NAMES

RIGHT, WRONG = "#0072b2", "#d55e00"


def draw_rates(summary: pd.DataFrame) -> Figure:
    """Rates of right answers and of wrong names in each world, with their 95 % intervals.

    Args:
        summary: from `summary.summarize`.
    """
    parts = [(text, summary[summary["hidden"] == hidden]) for hidden, text in PANELS.items()]
    figure, axes = canvas(1, 2, width=13.0, height=2.2 + 0.36 * max(len(rows) for _, rows in parts))
    with_effect, without = (rows for _, rows in parts)
    title(
        figure,
        f"Right in {with_effect['right_pct'].min():.0f} to {with_effect['right_pct'].max():.0f} % of sets with an "
        f"effect, depending on the world; a wrong name in at most {summary['wrong_name_pct'].max():.0f} %",
    )
    for axis, (text, rows) in zip(axes[0], parts, strict=True):
        _rates(axis, rows.reset_index(drop=True), text)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


PANELS = {"effect": "an effect is hidden (right: of those that can be seen)", "nothing": "nothing is hidden"}


def _rates(axis: Axes, rows: pd.DataFrame, text: str) -> None:
    place = -np.arange(len(rows), dtype=float)
    for shift, name, colour, marker, label in (
        (0.12, "right", RIGHT, "o", "right"),
        (-0.12, "wrong_name", WRONG, "s", "a wrong name"),
    ):
        middle = rows[f"{name}_pct"].to_numpy(float)
        ends = np.stack([middle - rows[f"{name}_low_pct"], rows[f"{name}_high_pct"] - middle])
        axis.errorbar(middle, place + shift, xerr=ends.clip(0), fmt=marker, color=colour, capsize=3, label=label)
    labels = [
        NAMES[r.world] + (f", {r.noise_deg:g} deg" if np.isfinite(r.noise_deg) else "") + f" ({r.seen} of {r.sets})"
        for r in rows.itertuples()
    ]
    axis.set_yticks(place, labels)
    axis.set(xlim=(-3, 103), xlabel="share of sets, with 95 % interval [%]", title=text)
