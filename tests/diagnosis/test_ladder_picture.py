"""The picture of the ladder."""

import numpy as np
import pandas as pd

from myowave.diagnosis.report.figures import draw_ladder


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

    assert {"muscle model, held out", "network, recorded, 1-scale, held out"} < set(labels())
    told = labels(horizon_s=0.5)
    assert "muscle model over 0.5 s, held out" in told
    assert "network, recorded, 1-scale, held out, whole trials" in told
    assert {"noise of the angle", "and of the EMG"} < set(told)
