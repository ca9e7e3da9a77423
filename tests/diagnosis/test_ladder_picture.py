"""Pictures of a verdict: the ladder, and what titles say."""

import numpy as np
import pandas as pd

from myowave.diagnosis.report.figures import draw_glance, draw_ladder, draw_missing_torque, draw_ranking

NOISE = {"noise of the angle": 0.5}
PHYSICS = ("physics", "base", False, 10.6, 8.4, 0.5, 1.3)
COLUMNS = ["source", "model", "named", "train_rmse_deg", "heldout_rmse_deg", "noise_deg", "missing_torque_Nm"]


def test_a_ladder_says_over_what_its_errors_are_and_which_noise_makes_them():
    network = ("network, recorded, 1-scale", "base", False, np.nan, 9.7, 0.5, np.nan)
    ladder = pd.DataFrame([PHYSICS, network], columns=COLUMNS)

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


def test_an_angle_that_never_moves_can_be_drawn():
    time = np.arange(100) / 100
    about = {"trial": "a", "role": "test", "model": "base", "time_s": time, "angle_rad": 0.5}
    (axis,) = draw_glance(pd.DataFrame({**about, "predicted_rad": np.sin(time)}), ["base"], None).axes
    low, high = axis.get_ylim()
    assert low < np.degrees(0.5) - 0.5 and high > np.degrees(0.5) + 0.5


def test_titles_of_pictures_say_what_was_found():
    found = ("physics", "base+joint_damping", False, 0.5, 0.6, 0.5, 0.0)
    ladder = pd.DataFrame([PHYSICS, found], columns=COLUMNS)
    told = "Held-out error of the model: 8.4 deg, 0.60 deg with what was found"
    assert draw_ladder(ladder, NOISE).get_suptitle() == told
    assert draw_ladder(ladder[:1], NOISE, 0.5).get_suptitle() == "Held-out error of the model over 0.5 s: 8.4 deg"
    point = {"angle_rad": 1.0, "velocity_rad_s": 0.0, "torque_Nm": 0.3}
    windows = pd.DataFrame([{"model": model, **point} for model in ("a", "b")])
    torques = draw_missing_torque(windows, {"a": 0.26, "b": 0.0}).axes[:2]
    assert [axis.get_title() for axis in torques] == ["a: 0.26 N m missing", "b: none above noise"]
    ranking = pd.DataFrame(
        [("base", "joint_damping", 127.0, "supported"), ("base+joint_damping", "fatigue", 2.0, "not needed")],
        columns=["model", "effect", "log_odds", "status"],
    )
    panels = draw_ranking(ranking, {"joint_damping": "damping of the joint"}).axes
    assert (
        panels[0].get_title().replace("\N{NO-BREAK SPACE}", " ")
        == "muscle model: most evidence for damping of the joint; best 1 of 1"
    )
    assert "damping of the joint: no effect has evidence" in panels[1].get_title().replace("\n", " ")
