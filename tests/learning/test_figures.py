"""Pictures of training."""

import numpy as np
import pandas as pd

from myowave.learning.figures import draw_parameters


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
