"""Where many constants are free, pictures show those that matter, and say how many there are."""

from itertools import pairwise

import numpy as np
import pandas as pd
from matplotlib.backends.backend_agg import FigureCanvasAgg

from myowave.diagnosis.report.figures.watch import draw_ladder
from myowave.diagnosis.report.figures.where import draw_misfit

MISFIT = [("trial", "trial1", 1.0), ("trial", "trial2", 1.1), ("time [s]", "0 to 1", 1.0), ("time [s]", "1 to 2", 3.0)]


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
