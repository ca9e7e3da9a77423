"""One definition of the score that is shown, errors in degrees, standard errors, and scales judged everywhere."""

import numpy as np
import pandas as pd
import pytest
import torch

from myowave.learning.evaluation import evaluate, tabulate_parameters
from myowave.learning.figures import draw_metrics, draw_predictions
from myowave.learning.tables import judge_scales
from myowave.learning.training import train_scale
from myowave.scores import median_over_seeds


def rows(dataset, scales, r2, model="base", recipe="rollout"):
    return pd.DataFrame(
        {"dataset": dataset, "model": model, "recipe": recipe, "scales": scales, "seed": range(len(r2)), "test_r2": r2}
    )


def test_a_seed_that_ran_away_counts_as_the_worst():
    shown = median_over_seeds(pd.DataFrame({"test_mse": [1.0, 2.0, np.nan], "test_r2": [0.9, 0.8, np.nan]}))
    assert shown.to_dict() == {"test_mse": 2.0, "test_r2": 0.8}


def test_every_dataset_model_and_recipe_with_several_scales_is_judged():
    summary = pd.concat(
        [
            *(rows("a", scales, r2) for scales, r2 in ((1, [0.5, 0.6, 0.7]), (3, [0.8, 0.91, 1.0]))),
            *(rows("b", scales, r2, recipe="other") for scales, r2 in ((1, [0.9, 0.9, 0.9]), (2, [0.5, 0.6, 0.5]))),
            *(rows("a", scales, r2, model="base+x") for scales, r2 in ((1, [0.5, 0.6]), (2, [0.4, 0.7]))),
            rows("alone", 1, [0.5, 0.6]),
        ]
    )
    judged = judge_scales(summary).set_index(["dataset", "model"])
    assert len(judged) == 3
    assert judged.loc[("a", "base"), ["scales", "finding"]].tolist() == ["3 against 1", "helps in this draw"]
    assert judged.loc[("b", "base"), ["recipe", "finding"]].tolist() == ["other", "harms in this draw"]
    assert judged.loc[("a", "base+x"), "finding"] == "not more than the scatter of seeds"
    # Two standard errors of three seeds are 18 % chance.
    few = pd.concat([rows("a", 1, [0.5, 0.5, 0.5]), rows("a", 3, [0.51, 0.54, 0.56])])
    assert judge_scales(few)["finding"].item() == "not more than the scatter of seeds"
    away = pd.concat([rows("a", 1, [0.5, 0.5, 0.5]), rows("a", 3, [0.8, 0.81, np.nan])])
    assert judge_scales(away)[["seeds_that_gain", "finding"]].values.tolist() == [["2 of 3", "a seed ran away"]]
    # Runs with other settings trained other numbers of seeds.
    fewer = pd.concat([rows("a", 1, [0.5, 0.5, 0.5]), rows("a", 3, [0.8, 0.81])])
    assert judge_scales(fewer)[["seeds_that_gain", "finding"]].values.tolist() == [["2 of 2", "helps in this draw"]]
    one_seed = pd.concat([rows("a", 1, [0.1]), rows("a", 2, [0.9])])
    assert judge_scales(one_seed)["finding"].item() == "not more than the scatter of seeds"
    assert list(judge_scales(rows("alone", 1, [0.5])).columns) == list(judge_scales(summary).columns)


def test_rows_carry_degrees_and_the_standard_errors_of_the_table_of_parameters(rollout, scales):
    *_, last = train_scale(rollout, level=0)
    predicted = torch.from_numpy(scales[0].angle + 0.01).expand(2, -1, -1)
    found = evaluate(last.checkpoint, scales[0], predicted, recipe="mine")
    assert found["test_rmse_deg"].tolist() == pytest.approx([np.degrees(0.01)] * 2)
    parameters = tabulate_parameters(last.checkpoint).set_index(["parameter", "seed"])["standard_error"]
    for name in last.checkpoint.names:
        assert found[f"{name}_se"].tolist() == pytest.approx(parameters[name].tolist(), nan_ok=True)
        assert found[f"{name}_se"].notna().all()


def test_markers_and_baselines_count_a_seed_that_ran_away_as_the_title_does():
    away = rows("a", 1, [0.9, 0.8, np.nan]).assign(test_mse=[0.1, 0.2, np.nan])
    rivals = away.assign(recipe="cnn")
    history = pd.DataFrame({"epoch": [1, 2], "seed": 0, "loss": [1.0, 0.5]})
    figure = draw_metrics(away, {1: history}, rivals)
    assert "0.8000 (median of seeds)" in figure.get_suptitle() and "convolution, has 0.8000" in figure.get_suptitle()
    for axis, expected in zip(figure.axes[1:], (0.2, 0.8), strict=True):
        middle, *_, baseline = (np.unique(line.get_ydata()) for line in axis.lines)
        assert middle == baseline == expected
    nothing = draw_metrics(away.assign(test_mse=np.nan, test_r2=np.nan), {1: history}, rivals)
    nothing.canvas.draw()
    assert "R$^2$ is -inf" in nothing.get_suptitle()


def test_pictures_show_the_medians():
    summary = rows("a", 1, [0.1, 0.9, 0.8]).assign(test_mse=[0.9, 0.1, 0.2], test_rmse_deg=[9.0, 1.0, 2.0])
    history = pd.DataFrame({"epoch": [1, 2], "seed": 0, "loss": [1.0, 0.5]})
    alone = draw_metrics(summary, {1: history}, summary.iloc[:0]).get_suptitle()
    assert "0.8000 (median of seeds)" in alone and "baseline" not in alone
    rivals = pd.concat([summary.assign(recipe=name, test_r2=r2) for name, r2 in (("hold", -1.0), ("cnn", 0.85))])
    beaten = draw_metrics(summary, {1: history}, rivals)
    assert "the best baseline, causal convolution, has 0.8500, which is better" in beaten.get_suptitle()
    assert [text.get_text() for text in beaten.axes[2].get_legend().get_texts()] == ["causal convolution"]
    assert "which is better" not in draw_metrics(summary, {1: history}, rivals.query("recipe == 'hold'")).get_suptitle()
    predictions = pd.DataFrame(
        {"trial": "t", "seed": [0, 0, 1, 1], "time_s": [0.0, 0.1] * 2, "angle_rad": 1.0, "predicted_rad": 1.1}
    ).assign(low_rad=0.9, high_rad=1.2, role="test")
    figure = draw_predictions({1: predictions}, summary.assign(band_coverage=0.75))
    above = "".join(figure.axes[0].get_title(loc=where) for where in ("left", "center"))
    assert "0.8000, 2 deg" in above and "75 %" in above
    assert "the unseen trial is missed by 2 deg (median over seeds)" in figure.get_suptitle()
