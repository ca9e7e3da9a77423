"""Which: the catalogue weighed."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from myowave.diagnosis.figures.style import short, unique
from myowave.plotting import BLUE, GREY, MEASURED, ORANGE, PINK, SKY, canvas, title

THRESHOLD = 10.0  # delta BIC that counts as very strong evidence
SHOWN = 10  # candidates a panel
STATUS = {"supported": BLUE, "refused": ORANGE, "behind": PINK, "absorbed": GREY, "not needed": SKY}
MEANING = {
    "supported": "the data support it",
    "refused": "better fit, but at a bound or not in held-out folds",
    "behind": "promises less than those fitted",
    "absorbed": "parameters absorb it",
    "not needed": "no evidence",
}


def draw_ranking(ranking: pd.DataFrame) -> Figure:
    """The catalogue weighed at each model, the most evident effects of each, a panel a model."""
    models = unique(ranking["model"])
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
        axis.set_title(f"what to add to {short(model)}? best {len(rows)} of {(ranking['model'] == model).sum()}")
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
        texts.append(f"{short(model)}: {verb}")
    title(figure, "Evidence asks for " + "; ".join(texts))
    return figure


def _remark(row: Any) -> str:
    """What is known of a candidate, in a few words."""
    if row.status == "absorbed":
        return f"absorbed by {row.absorbed_by.replace(' ', ', ')}"
    like = f"; like {row.confused_with.split(' ')[0]}" if row.confused_with else ""
    return f"{row.estimate.replace('+-', '±')}; won {row.folds_won} of {row.folds}{like}" if row.delta_bic > 0 else ""
