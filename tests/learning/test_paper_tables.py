"""The paper's numbers beside ours: transcribed rightly, averaged over seeds; scales judged by the scatter of seeds."""

import numpy as np
import pandas as pd
import pytest

from myowave.learning.paper import tables

SAMPLES = 500


def runs(gain: float, scatter: float, seeds: int = 5) -> pd.DataFrame:
    """Evaluations of 1- and 3-scale training whose R2 differs by `gain`, give or take `scatter`."""
    sway = np.linspace(-scatter, scatter, seeds)
    return pd.concat(
        pd.DataFrame({
            "dataset": "case1", "recipe": "paper", "scales": scales, "seed": range(seeds), "test_r2": r2,
            "test_nmse": (1 - r2) / SAMPLES, "f0_Bi_error_pct": 1.0 + sway, "f0_Tri_error_pct": 0.0,
            "l0_Bi_error_pct": 0.0, "l0_Tri_error_pct": 0.0,
        })
        for scales, r2 in ((1, np.full(seeds, 0.6)), (3, 0.6 + gain + sway))
    )  # fmt: skip


def test_the_printed_errors_are_of_500_samples():
    for nmse, r2 in tables.PRINTED_TEST.values():
        assert nmse == pytest.approx((1 - r2) / SAMPLES, rel=0.01)


@pytest.mark.parametrize(
    ("gain", "scatter", "finding"),
    [(0.2, 0.05, "helps"), (-0.2, 0.05, "harms"), (0.01, 0.3, "not more than the scatter of seeds")],
)
def test_scales_are_judged_by_the_scatter_of_seeds(gain, scatter, finding):
    judged = tables.judge_scales(runs(gain, scatter))
    assert judged["finding"].item() == finding
    assert judged["gain_r2"].item() == pytest.approx(gain)


def test_a_single_seed_decides_nothing():
    assert "scatter" in tables.judge_scales(runs(0.2, 0.0, seeds=1))["finding"].item()


def test_changes_are_against_one_scale():
    scores = tables.scores_by_scales(runs(0.2, 0.05)).set_index("scales")
    assert scores["nmse_decrease_pct"].tolist() == pytest.approx([0.0, 50.0])


def test_the_paper_stands_beside_three_scales_alone():
    errors = tables.parameter_errors(runs(0.2, 0.05)).set_index(["scales", "parameter"])
    assert errors.loc[(3, "f0_Bi"), "paper_error_pct"] == tables.PRINTED_ERROR_PCT["case1"]["f0_Bi"][0]
    assert np.isnan(errors.loc[(1, "f0_Bi"), "paper_error_pct"])
    assert errors.loc[(3, "f0_Bi"), "error_pct"] == pytest.approx(1.0)
