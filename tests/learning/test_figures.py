"""Pictures of training."""

import numpy as np
import pandas as pd
import pytest

from myowave.learning.figures import draw_parameters, draw_prediction


def test_seeds_that_agree_are_drawn_as_agreeing_and_not_with_their_rounding_across_the_axis():
    rows = [
        {
            "dataset": "d",
            "model": "base",
            "recipe": "r",
            "scales": scales,
            "f0_Bi": 220.0 + 1e-5 * seed,
            "l0_Bi": length,
        }
        for scales in (1, 3)
        for seed, length in ((0, 0.4), (1, 0.5))
    ]
    summary = pd.DataFrame(rows).assign(f0_Bi_error_pct=np.nan, l0_Bi_error_pct=np.nan)
    agree, differ = draw_parameters(summary, ["f0_Bi", "l0_Bi"]).axes
    low, high = agree.get_ylim()
    assert low < 218 and high > 222 and high - low < 10
    low, high = differ.get_ylim()
    assert 0.3 < low < 0.4 and 0.5 < high < 0.6, "what differs fills its axis"
    agreed = draw_parameters(summary, ["f0_Bi"]).get_suptitle()
    assert "within 0.001 %" in agreed


def test_many_parameters_are_drawn_in_rows_that_a_page_has_room_for():
    names = [f"f0_{muscle}" for muscle in "ABCDE"]
    labels = {"dataset": "d", "model": "base", "recipe": "r", "scales": [1, 3]}
    figure = draw_parameters(
        pd.DataFrame(labels).assign(**{n: 1.0 for n in names} | {f"{n}_error_pct": 2.0 for n in names}), names
    )
    assert [axis.get_title() for axis in figure.axes if axis.axison] == names
    assert figure.get_figwidth() < 12


def test_where_nothing_is_identified_the_picture_says_so():
    summary = pd.DataFrame(
        {"dataset": ["a"], "model": ["base"], "recipe": ["rollout"], "scales": [1], "test_r2": [0.9]}
    )
    assert "nothing is identified" in draw_parameters(summary, []).get_suptitle()


@pytest.mark.parametrize("time_s", [True, False])
def test_the_measured_angle_keeps_the_step_of_its_own_lines(time_s):
    """Raw EMG has more lines than a prediction."""
    predicted = ["time_s,angle_rad", *(f"{0.1 * i},0.5" for i in range(11))]
    given = ["time_s,angle_deg", *(f"{0.002 * i},{i}" for i in range(501))]
    lines = given if time_s else [line.split(",")[1] for line in given]
    (axis,) = draw_prediction(predicted, lines, "raw", 0.002).axes
    measured, prediction = axis.lines[:2]
    np.testing.assert_allclose(measured.get_xdata(), 0.002 * np.arange(501))
    assert prediction.get_xdata()[-1] == pytest.approx(measured.get_xdata()[-1])


@pytest.mark.parametrize(
    "head", ["time_s,angle_rad,angle_deg", "time_s,angle_deg,angle_rad", "time_s, angle_rad,other"]
)
def test_the_measured_angle_is_the_one_that_a_prediction_starts_from(head):
    values = {"angle_rad": "1", "angle_deg": "30", "other": "5", "time_s": "0"}
    line = ",".join(values[name.strip()] for name in head.split(","))
    (axis,) = draw_prediction(["time_s,angle_rad", "0,1"], [head, line], "a trial", 0.1).axes
    assert [line.get_label() for line in axis.lines] == ["measured", "predicted"]
    assert axis.lines[0].get_ydata() == pytest.approx(np.degrees([1.0]))
