"""Optuna's own pictures of a search."""

import warnings

import matplotlib
import numpy as np
import optuna
from matplotlib import pyplot
from matplotlib.figure import Figure
from optuna.exceptions import ExperimentalWarning
from optuna.visualization.matplotlib import plot_contour, plot_optimization_history, plot_param_importances, plot_slice

from myowave.plotting import STYLE

PLOTS = {
    "history": plot_optimization_history,
    "importance": plot_param_importances,
    "slices": plot_slice,
    "contours": plot_contour,
}


def draw_search(search: optuna.Study) -> dict[str, Figure]:
    """How the error fell, which settings it depends on, and where the good ones are: {picture: figure}."""
    figures = {}
    for name, plot in PLOTS.items():
        with matplotlib.rc_context(STYLE), warnings.catch_warnings():
            warnings.simplefilter("ignore", ExperimentalWarning)  # that these functions may change: the lock pins them
            axes = plot(search, target_name="held-out error [deg]")
        figures[name] = pyplot.gcf()
        figures[name].set_size_inches(9.0, 4.0 + 4.0 * (np.ndim(axes) == 2))
        pyplot.close()
    return figures
