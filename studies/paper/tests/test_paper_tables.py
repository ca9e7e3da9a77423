"""The paper's numbers beside ours: transcribed rightly, averaged over seeds; scales judged by the scatter of seeds."""

import numpy as np
import pandas as pd
import pytest
import torch

from myowave.identification.free_parameters import free_parameters
from myowave.learning.methods.paper.joint_identification import Form
from myowave.learning.tables import judge_scales
from myowave.settings import Identify
from studies.paper import tables

SAMPLES = 500


def runs(gain: float, scatter: float, seeds: int = 5) -> pd.DataFrame:
    """Evaluations of 1- and 3-scale training whose R2 differs by `gain`, give or take `scatter`."""
    sway = np.linspace(-scatter, scatter, seeds)
    return pd.concat(
        pd.DataFrame(
            {
                "dataset": "case1",
                "model": "base",
                "recipe": "paper",
                "scales": scales,
                "seed": range(seeds),
                "test_r2": r2,
                "test_nmse": (1 - r2) / SAMPLES,
                "f0_Bi_error_pct": 1.0 + sway,
                "f0_Tri_error_pct": 0.0,
                "l0_Bi_error_pct": 0.0,
                "l0_Tri_error_pct": 0.0,
            }
        )
        for scales, r2 in ((1, np.full(seeds, 0.6)), (3, 0.6 + gain + sway))
    )


def test_the_printed_errors_are_of_500_samples():
    for nmse, r2 in tables.PRINTED_TEST.values():
        assert nmse == pytest.approx((1 - r2) / SAMPLES, rel=0.01)


@pytest.mark.parametrize(
    ("gain", "scatter", "finding"),
    [
        (0.2, 0.05, "helps in this draw"),
        (-0.2, 0.05, "harms in this draw"),
        (0.01, 0.3, "not more than the scatter of seeds"),
    ],
)
def test_scales_are_judged_by_the_scatter_of_seeds(gain, scatter, finding):
    judged = judge_scales(runs(gain, scatter))
    assert judged["finding"].item() == finding
    assert judged["gain_r2"].item() == pytest.approx(gain)


def test_a_single_seed_decides_nothing():
    assert "scatter" in judge_scales(runs(0.2, 0.0, seeds=1))["finding"].item()


def test_changes_are_against_one_scale():
    scores = tables.scores_by_scales(runs(0.2, 0.05)).set_index("scales")
    assert scores["nmse_decrease_pct"].tolist() == pytest.approx([0.0, 50.0])


def test_the_paper_stands_beside_three_scales_only():
    errors = tables.parameter_errors(runs(0.2, 0.05)).set_index(["scales", "parameter"])
    assert errors.loc[(3, "f0_Bi"), "paper_error_pct"] == tables.PRINTED_ERROR_PCT["case1"]["f0_Bi"][0]
    assert np.isnan(errors.loc[(1, "f0_Bi"), "paper_error_pct"])
    assert errors.loc[(3, "f0_Bi"), "error_pct"] == pytest.approx(1.0)


def test_a_further_draw_of_a_case_stands_beside_the_case_and_twice_its_error_is_the_bar():
    errors = tables.parameter_errors(runs(0.2, 0.05).assign(dataset="case1_again", f0_Tri_error_pct=0.13))
    three = errors[errors["scales"] == 3].set_index("parameter")
    assert three["paper_error_pct"].to_dict() == {n: tables.PRINTED_ERROR_PCT["case1"][n][0] for n in tables.PARAMETERS}
    assert three["within_twice"].to_dict() == {"f0_Bi": True, "f0_Tri": False, "l0_Bi": True, "l0_Tri": True}


def test_what_eq_41_can_reach_ends_at_the_mean_of_the_literature(model):
    for values in ((4.0, 8.0), (1.0, 2.0, 9.0)):
        wanted = Identify(literature=values)
        (free,) = free_parameters(model, {"f0_Bi": wanted}, ())
        form = Form.of(free, wanted, torch.ones(1))
        low, high = tables.reach(wanted.model_dump())
        ends = torch.tensor([[-40.0] * len(values), [40.0] * len(values)])
        assert form.value(ends).tolist() == pytest.approx([low, high], abs=1e-9)
    assert tables.reach(Identify(low=2.0, high=3.0).model_dump()) == (2.0, 3.0)


def test_seeds_at_the_end_of_their_reach_are_counted():
    bounds = {name: {"low": 10.0, "high": 100.0} for name in tables.PARAMETERS}
    rows = pd.DataFrame({name: [10.1, 13.0, 50.0, 99.5] for name in tables.PARAMETERS}).assign(
        dataset="elbow", scales=1
    )
    values = tables.identified_values(rows, {"elbow": bounds})
    assert set(values["at_limit"]) == {2}
    assert values["value"].tolist() == pytest.approx([43.15] * 4)


def test_choices_stand_in_the_order_of_the_recipes_with_what_their_residual_weighs():
    rows = pd.concat([runs(0.2, 0.5).assign(recipe=name) for name in ("light", "printed")])
    rows = rows[rows["scales"] == 1]
    one_step = rows[["dataset", "recipe", "scales", "seed"]].assign(
        test_r2_one_step=np.where(rows["recipe"] == "light", 0.9, 0.8), acceleration_share=0.75
    )
    history = pd.DataFrame({"epoch": [1, 1, 2, 2], "data_loss": [9, 9, 1, 3], "residual_loss": [9, 9, 10, 30]})
    recipes = {
        name: dict.fromkeys(tables.CHOICES, 1) | {"residual": "time", "beta": beta}
        for name, beta in (("printed", 0.1), ("light", 0.01))
    }
    choices = tables.compare_choices(rows, one_step, {"light": history, "printed": history}, recipes)
    assert choices["recipe"].tolist() == ["printed", "light"]
    assert choices["beta"].tolist() == [0.1, 0.01]
    assert choices["acceleration_share"].tolist() == [0.75, 0.75]
    assert choices["one_step_r2"].tolist() == pytest.approx([0.8, 0.9])
    assert choices["data_loss"].tolist() == pytest.approx([2.0, 2.0])
    assert choices["weighted_residual"].tolist() == pytest.approx([2.0, 0.2])
    rms = np.sqrt((rows.loc[rows["recipe"] == "light", "f0_Bi_error_pct"] ** 2).mean())
    assert choices["worst_error_pct"].tolist() == pytest.approx([rms, rms])


def test_the_truth_follows_from_values_and_errors():
    row = {name: 110.0 for name in tables.PARAMETERS} | {f"{name}_error_pct": 10.0 for name in tables.PARAMETERS}
    assert list(tables.true_values(pd.DataFrame([row])).values()) == pytest.approx([100.0] * 4)
