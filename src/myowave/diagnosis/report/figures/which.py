"""Which: the catalogue weighed."""

import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from myowave.diagnosis.causes import SURE
from myowave.diagnosis.report.figures.style import short
from myowave.plotting import BLUE, GREY, MEASURED, PINK, SKY, canvas

SHOWN = 8  # candidates a panel
REMARK_WIDTH = 48  # letters beside a point; the page has a table with all there is
STATUS = {
    "supported": (BLUE, "the data support it"),
    "behind": (PINK, "promises less than those fitted"),
    "not needed": (SKY, "no evidence"),
    "failed": (MEASURED, "cannot be fitted"),
}


def draw_ranking(ranking: pd.DataFrame, titles: Mapping[str, str]) -> Figure:
    """The catalogue weighed at each model, the most evident effects of each, a panel a model.

    Args:
        titles: what each effect is, in words.
    """
    models = list(ranking["model"].unique())
    figure, axes = canvas(len(models), 1, width=12.0, height=3.3 * len(models) + 1.1)
    figure.set_layout_engine("constrained", rect=(0.01, 0, 0.98, 1))  # the texts beside the panels need the width
    for axis, model in zip(axes[:, 0], models, strict=True):
        rows = ranking[ranking["model"] == model]
        rows = rows[rows["status"] != "absorbed"].head(SHOWN).iloc[::-1]
        y = np.arange(len(rows))
        axis.scatter(rows["log_odds"], y, color=[STATUS[s][0] for s in rows["status"]], s=60, zorder=3)
        axis.set_xscale("symlog", linthresh=3, linscale=0.7)
        axis.xaxis.set_major_formatter("{x:g}")
        axis.axvline(SURE, color=MEASURED, linestyle=":", linewidth=2)
        axis.axvline(0, color=GREY, linewidth=0.8)
        axis.set_yticks(y, [f"{titles[e]} ({e})" if titles.get(e) else e for e in rows["effect"]], fontsize=9)
        axis.set_xlim(min(-3.0, rows["log_odds"].min() * 1.2), max(10.0, rows["log_odds"].max() * 1.5))
        beside = axis.get_yaxis_transform()
        for place, row in zip(y, rows.itertuples(), strict=True):
            remark = _remark(row, added=f"{model}+{row.effect}" in models)
            axis.text(1.01, place, remark, va="center", fontsize=8.5, color="#333333", transform=beside)
        axis.set_title(f"what to add to {short(model)}? best {len(rows)} of {(ranking['model'] == model).sum()}")
        axis.grid(axis="y", linestyle=":")
    axes[-1, 0].set_xlabel("log odds of the model with the effect [nats]; dotted: 19 to 1")
    seen = [look for status, look in STATUS.items() if (ranking["status"] == status).any()]
    handles = [Line2D([], [], color=color, marker="o", linestyle="none", markersize=7) for color, _ in seen]
    figure.legend(
        handles, [meaning for _, meaning in seen], loc="outside lower left", ncols=3, frameon=False, fontsize=9
    )
    return figure


def _remark(row: Any, *, added: bool) -> str:
    """What is known of a candidate, in a few words; whether it was added comes first."""
    if row.log_odds <= 0:
        return ""
    found = "added; " * added + row.estimate + "; not fitted" * bool(pd.isna(row.rmse_deg))
    alike = f"{found}; like {row.confused_with.split(' ')[0]}" if row.confused_with else found
    return alike if len(alike) <= REMARK_WIDTH else textwrap.shorten(found, REMARK_WIDTH, placeholder=" ...")
