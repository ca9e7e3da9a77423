"""At a glance: a held-out trial, measured and predicted."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from myowave.diagnosis.report.figures.style import legend, style
from myowave.plotting import GREEN, MEASURED, canvas


def draw_glance(predictions: pd.DataFrame, physics: list[str]) -> Figure:
    """Measured and predicted angle of the first held-out trial, or of the first where none is held out.

    Args:
        predictions: of `motion.beside`.
        physics: models without a network, the one without effects first.
    """
    held_out = predictions[predictions["role"] == "test"]
    rows = held_out if len(held_out) else predictions
    rows = rows[rows["trial"] == rows["trial"].iloc[0]]
    figure, axes = canvas(1, 1, width=4.2, height=2.1)
    axis = axes[0, 0]
    measured = rows[rows["model"] == rows["model"].iloc[0]]
    axis.plot(measured["time_s"], np.degrees(measured["angle_rad"]), color=MEASURED, linewidth=2.4, label="measured")
    for model in rows["model"].unique():
        one = rows[rows["model"] == model]
        look = style(physics.index(model)) if model in physics else {"color": GREEN, "linestyle": "-."}
        label = "network" if model not in physics else "with what was found" if model != physics[0] else "muscle model"
        axis.plot(one["time_s"], np.degrees(one["predicted_rad"]), linewidth=1.3, label=label, **look)
    low, high = np.degrees(measured["angle_rad"].min()), np.degrees(measured["angle_rad"].max())
    axis.set_ylim(low - 0.3 * (high - low), high + 0.3 * (high - low))  # a model that runs away hides nothing
    axis.set(xlabel="time [s]", ylabel="angle [deg]")
    legend(figure, [axis], columns=2)
    return figure
