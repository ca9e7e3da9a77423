"""Where many constants are free, pictures show those that matter, and say how many there are."""

from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from myowave.diagnosis.report.figures.compare import draw_correlations
from myowave.diagnosis.report.figures.watch import draw_ladder, draw_parameters
from myowave.diagnosis.report.figures.where import draw_misfit

NAMES = [*(f"constant{i}" for i in range(27)), "tilt.g", "damping.c"]
MISFIT = [("trial", "trial1", 1.0), ("trial", "trial2", 1.1), ("time [s]", "0 to 1", 1.0), ("time [s]", "1 to 2", 3.0)]


def test_correlations_are_those_of_the_parameters_most_alike():
    matrix = np.eye(len(NAMES)) + 0.01
    matrix[3, 28] = matrix[28, 3] = -0.9
    rows = [("base", a, b, matrix[i, j]) for i, a in enumerate(NAMES) for j, b in enumerate(NAMES)]
    figure = draw_correlations(pd.DataFrame(rows, columns=["model", "parameter", "other", "correlation"]))
    ticks = [label.get_text().replace("\n", "") for label in figure.axes[0].get_yticklabels()]
    assert len(ticks) == 10 and {"constant3", "damping.c"} <= set(ticks)
    assert figure.axes[0].get_title().endswith("10 of 29 parameters")


def test_parameters_are_those_asked_for_and_those_of_effects():
    asked = {"constant0", "constant1", "tilt.g", "damping.c"}
    rows = [
        (
            *("physics", model, name, "N", value + (model != "base") * (name == "constant1"), 0.1, np.nan, np.nan),
            *(np.nan, name not in asked, model == "base", 1.0, 100.0),
        )
        for model in ("base", "base+tilt+damping")
        for value, name in enumerate(NAMES, 1)
        if model != "base" or "." not in name
    ]
    columns = ["source", "model", "parameter", "unit", "value", "se", "true", "error_pct", "scatter", "assumed"]
    columns += ["if_right", "low", "high"]
    figure = draw_parameters(pd.DataFrame(rows, columns=columns))
    drawn = [axis.get_title().split(" [")[0] for axis in figure.axes if axis.get_visible()]
    assert drawn == ["constant0", "constant1", "tilt.g", "damping.c"]
    before, after = (container.lines[0] for container in figure.axes[1].containers[::-1])
    assert before.get_markerfacecolor() == "white" != after.get_markerfacecolor(), "open where the model leaves more"
    ends = [axis.containers[0].lines[1][0].get_ydata()[0] for axis in (figure.axes[0], figure.axes[1])]
    assert ends == [1.0, pytest.approx(3.0 - 0.196)], "no interval leaves the bounds"


def test_muscles_that_share_a_channel_share_a_panel():
    parts = [("low", 1.0), ("high", 2.0)]
    values = {"activation BIClong [-]": 0.0, "activation BRA [-]": 0.0, "activation TRI [-]": 0.5}
    rows = [("base", factor, part, rmse + more, rmse, 3.0) for factor, more in values.items() for part, rmse in parts]
    columns = ["model", "factor", "part", "rmse_deg", "rmse_low_deg", "rmse_high_deg"]
    figure = draw_misfit(pd.DataFrame(rows, columns=columns), {"noise": 0.05})
    titles = [axis.get_title() for axis in figure.axes if axis.get_visible()]
    assert titles == ["activation BIClong, BRA", "activation TRI"]


def test_long_names_of_trials_do_not_stand_in_one_another():
    names = [f"a_trial_with_a_long_name_{i}" for i in range(4)]
    rows = [("base", "trial", name, 1.0, 0.8, 1.2) for name in names]
    columns = ["model", "factor", "part", "rmse_deg", "rmse_low_deg", "rmse_high_deg"]
    figure = draw_misfit(pd.DataFrame(rows, columns=columns), {"noise": 0.05})
    FigureCanvasAgg(figure).draw()
    labels = [label for label in figure.axes[0].get_xticklabels() if label.get_text()]
    assert [label.get_text() for label in labels] == names
    feet = [label.get_window_extent().x1 for label in labels]
    heights = [abs(np.sin(np.radians(label.get_rotation()))) for label in labels]
    line = labels[0].get_fontsize() * figure.dpi / 72
    assert all((b - a) * h > line for (a, b), h in zip(pairwise(feet), heights, strict=False))


def test_no_error_is_cut_off_where_a_later_panel_has_larger_ones():
    rows = [("base", factor, part, rmse, 0.8 * rmse, 1.2 * rmse) for factor, part, rmse in MISFIT]
    columns = ["model", "factor", "part", "rmse_deg", "rmse_low_deg", "rmse_high_deg"]
    figure = draw_misfit(pd.DataFrame(rows, columns=columns), {"noise": 0.05})
    panels = [axis for axis in figure.axes if axis.get_visible()]
    assert len(panels) == 2
    for axis in panels:
        low, high = axis.get_ylim()
        assert low == 0 and high > 1.2 * 3.0


def test_a_ladder_says_over_what_its_errors_are_and_which_noise_makes_them():
    physics = ("physics", "base", False, 10.6, 8.4, 0.5, 1.3)
    network = ("network, recorded, 1-scale", "base", False, np.nan, 9.7, 0.5, np.nan)
    columns = ["source", "model", "named", "train_rmse_deg", "heldout_rmse_deg", "noise_deg", "missing_torque_Nm"]
    ladder = pd.DataFrame([physics, network], columns=columns)

    def labels(**more):
        return (
            draw_ladder(ladder, {"noise of the angle": 0.5, "and of the EMG": 1.14}, **more)
            .axes[0]
            .get_legend_handles_labels()[1]
        )

    assert {"physical model, held out", "network, recorded, 1-scale, held out"} < set(labels())
    told = labels(horizon_s=0.5)
    assert "physical model over 0.5 s, held out" in told
    assert "network, recorded, 1-scale, held out, whole trials" in told
    assert {"noise of the angle", "and of the EMG"} < set(told)
