"""The picture: R2 of every method by question, with each test trial."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.plotting import CYCLE, GREY, canvas, title
from studies.held_out.answers import PLAIN, SEEN, WEIGHED, answer, columns_of

LEAST = 0.4  # R2 at which axes end; what is worse is drawn there


def draw_answers(scores: pd.DataFrame, recipe: str) -> Figure:
    """One panel per question (loads and numbers of trials apart), a row per method, EMG as it is and over weight."""
    made = columns_of(scores)
    kinds = scores[["method", "scales"]].drop_duplicates().query("method != 'hold'")
    kinds = sorted(kinds.itertuples(index=False), key=lambda k: (k.method == recipe, k.method, k.scales))
    columns = min(len(made), 4)
    rows = -(-len(made) // columns)
    figure, axes = canvas(rows, columns, width=3.3 * columns + 1.5, height=0.32 * len(kinds) * rows + 2.2, sharey=True)
    for axis, (name, _, table) in zip(axes.flat, made, strict=False):
        for color, inputs, shift in ((CYCLE[0], PLAIN, 0.15), (CYCLE[1], WEIGHED, -0.15)):
            by_kind = table[table["inputs"] == inputs].groupby(["method", "scales"])["test_r2"]
            for place, kind in enumerate(kinds):
                r2 = by_kind.get_group((kind.method, kind.scales))
                axis.plot(r2.clip(lower=LEAST), np.full(len(r2), place + shift), ".", color=GREY, markersize=4)
                axis.plot(
                    max(r2.mean(), LEAST),
                    place + shift,
                    "o",
                    color=color,
                    markersize=5,
                    label=SEEN[inputs] if not place else None,
                )
        axis.set(title=name, xlabel="test R$^2$", xlim=(LEAST - 0.02, 1.0))
    for axis in axes.flat[len(made) :]:
        axis.set_visible(False)
    names = [k.method if k.method != recipe else f"{k.method}, {k.scales} scale{'s' * (k.scales > 1)}" for k in kinds]
    axes[0, 0].set_yticks(range(len(kinds)), names)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    title(figure, answer(scores))
    return figure
