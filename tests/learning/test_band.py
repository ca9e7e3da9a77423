"""The band about a prediction holds 90 % of what was never trained on, and leaving the training range is said."""

import io
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch
from typer.testing import CliRunner

from myowave.cli import app
from myowave.learning.band import Band, Seen, band_about, calibrate, gather
from myowave.learning.evaluation import evaluate, predict_trials, tabulate_predictions
from myowave.learning.figures import draw_predictions
from myowave.learning.training import train_scale, train_scales


def errors_like(random, trials, samples, smooth, spread):
    """Errors of trials, alike over `smooth` samples, larger where the seeds disagree."""
    noise = random.standard_normal((trials, samples + smooth - 1))
    slow = np.stack([np.convolve(row, np.ones(smooth) / np.sqrt(smooth), "valid") for row in noise])
    return slow * np.hypot(spread, 0.01)


@pytest.mark.parametrize("smooth", [1, 8])
def test_a_band_holds_90_percent_of_samples_like_those_that_it_was_made_of(smooth):
    random, held = np.random.default_rng(0), []
    for _ in range(60):
        spread = 0.02 * random.random((5, 100))
        band = calibrate(list(errors_like(random, 5, 100, smooth, spread)), list(spread))
        new = errors_like(random, 5, 100, smooth, spread)
        held.append(np.mean(np.abs(new) <= band.half_width(spread)))
    assert 0.88 < np.mean(held) < 0.95


def test_the_band_is_wider_where_the_seeds_disagree_and_never_without_width():
    band = calibrate([np.array([0.1, -0.1, 0.05])], [np.zeros(3)])
    narrow, wide = band.half_width(np.array([0.0, 1.0]))
    assert 0.1 <= narrow < wide


def test_errors_worth_few_samples_give_the_largest_seen():
    error = np.linspace(0.1, 0.5, 40)  # so slow that 40 samples say little
    band = calibrate([error], [np.zeros(40)])
    assert band.half_width(np.zeros(1)) == pytest.approx(0.5)


def test_a_prediction_that_ran_away_has_an_infinite_band():
    band = calibrate([np.array([np.inf, 0.1]), np.array([np.nan])], [np.zeros(2), np.zeros(1)])
    assert np.isinf(band.half_width(np.zeros(2))).all()


def test_the_band_is_about_the_mean_of_the_seeds_and_begins_after_the_given_samples():
    predicted = np.stack([np.zeros((1, 5)), np.ones((1, 5))])
    low, high = band_about(predicted, Band(2.0, 0.0), given=2)
    assert low[0].tolist() == [0.5, 0.5, -0.5, -0.5, -0.5]
    assert high[0].tolist() == [0.5, 0.5, 1.5, 1.5, 1.5]


@pytest.fixture(scope="module")
def scored(scales, model, wanted):
    """A network with its predictions."""
    from myowave.learning.task import Task
    from myowave.settings import RolloutRecipe

    recipe = RolloutRecipe(hidden=8, epochs=5, rollout_s=0.3, simulated_trials=0)
    task = Task(scales, model, recipe, wanted, total=1, seeds=(0, 1), device=torch.device("cpu"))
    *_, last = train_scale(task, level=0)
    return last.checkpoint, predict_trials(last.checkpoint, scales[0])


def test_a_test_trial_moves_neither_the_band_nor_what_was_seen(scored, scales, model, wanted):
    from myowave.learning.task import Task
    from myowave.settings import RolloutRecipe

    checkpoint, _ = scored
    other = {level: replace(t, angle=t.angle + np.array([0, 0, 1.0])[:, None]) for level, t in scales.items()}
    recipe = RolloutRecipe(hidden=8, epochs=5, rollout_s=0.3, simulated_trials=0)
    task = Task(other, model, recipe, wanted, total=1, seeds=(0, 1), device=torch.device("cpu"))
    *_, last = train_scale(task, level=0)
    assert last.checkpoint.band == checkpoint.band and last.checkpoint.seen == checkpoint.seen


def test_the_band_is_that_of_the_ends_that_no_weight_was_trained_on(scored, scales):
    checkpoint, predicted = scored
    trials, error = scales[0], scales[0].angle - predicted.mean(0).numpy()
    ends = [slice(180, 200)] * 2  # a tenth of 200 samples
    spread = predicted.numpy().std(0)
    expected = calibrate([error[t, end] for t, end in enumerate(ends)], [spread[t, end] for t, end in enumerate(ends)])
    assert trials.train == ("1", "2")
    assert (checkpoint.band.factor, checkpoint.band.floor) == pytest.approx((expected.factor, expected.floor))


def test_the_band_of_trials_is_that_of_networks_that_lack_each_training_trial_in_turn(rollout, scales):
    recipe = rollout.recipe.model_copy(update={"validation_fraction": 0.0, "epochs": 4})
    task = replace(rollout, recipe=recipe, total=2)
    *_, checkpoint = train_scales(task)
    errors, spreads = [], []
    for name, other in (("1", "2"), ("2", "1")):
        alone = {level: t.select([other, name]) for level, t in scales.items()}
        alone = {level: replace(t, test=(name,)) for level, t in alone.items()}
        *_, without = train_scales(replace(task, scales=alone, recipe=recipe, final=False))
        predicted = predict_trials(without, alone[0])[:, 1, 4:].numpy()
        errors.append(alone[0].angle[1, 4:] - predicted.mean(0))
        spreads.append(predicted.std(0))
    expected = calibrate(errors, spreads)
    assert without.band is None
    assert (checkpoint.band.factor, checkpoint.band.floor) == pytest.approx((expected.factor, expected.floor))


def test_the_only_trial_with_another_load_is_predicted_by_networks_that_know_of_none(rollout, scales):
    """Without it all loads are the same, and no network is told of them."""
    heavy = {level: replace(trials, conditions={trials.train[0]: {"load": 0.5}}) for level, trials in scales.items()}
    recipe = rollout.recipe.changed({"epochs": 2, "validation_fraction": 0.0})
    *_, checkpoint = train_scales(replace(rollout, scales=heavy, recipe=recipe))
    assert checkpoint.architecture.known == {"load": 0.0}
    assert checkpoint.band is not None and np.isfinite(checkpoint.band.factor)


def test_a_test_trial_moves_no_band_of_trials(rollout, scales):
    recipe = rollout.recipe.model_copy(update={"validation_fraction": 0.0, "epochs": 3})
    other = {level: replace(t, angle=t.angle + np.array([0, 0, 1.0])[:, None]) for level, t in scales.items()}
    bands = []
    for seen in (scales, other):
        *_, last = train_scale(replace(rollout, scales=seen, recipe=recipe), level=0)
        bands.append(last.checkpoint.band)
    assert bands[0] is not None and bands[0] == bands[1]


def test_a_single_training_trial_has_no_band_of_trials(rollout, scales):
    recipe = rollout.recipe.model_copy(update={"validation_fraction": 0.0, "epochs": 2})
    alone = {level: replace(t, test=("2", "3")) for level, t in scales.items()}
    *_, last = train_scale(replace(rollout, scales=alone, recipe=recipe), level=0)
    assert last.checkpoint.band is None


def test_scores_tell_the_share_within_the_band_and_outside_the_training_range(scored, scales):
    checkpoint, predicted = scored
    rows = evaluate(checkpoint, scales[0], predicted, recipe="mine")
    low, high = band_about(predicted.numpy(), checkpoint.band, 4)
    angle = scales[0].angle[2]
    held = np.mean(((low[2] <= angle) & (angle <= high[2]))[4:])
    assert rows["band_coverage"].tolist() == pytest.approx([held, held])
    wide = replace(checkpoint, seen=Seen((-9.0,) * 4, (9.0,) * 4))
    assert (evaluate(wide, scales[0], predicted, recipe="mine")["outside_training"] == 0).all()
    still = replace(checkpoint, seen=Seen((-9.0,) * 3 + (-1e-3,), (9.0,) * 3 + (1e-3,)))
    assert (evaluate(still, scales[0], predicted, recipe="mine")["outside_training"] > 0.5).all()


def test_the_predictions_carry_the_band_and_the_picture_draws_it(scored, scales):
    checkpoint, predicted = scored
    table = tabulate_predictions(checkpoint, scales[0], predicted)
    low, high = band_about(predicted.numpy(), checkpoint.band, 4)
    for t, name in enumerate(scales[0].names):
        rows = table[(table["trial"] == name) & (table["seed"] == 1)]
        np.testing.assert_array_equal(rows["low_rad"], low[t])
        np.testing.assert_array_equal(rows["high_rad"], high[t])
    figure = draw_predictions({1: table}, evaluate(checkpoint, scales[0], predicted, recipe="mine"))
    drawn = figure.axes[0].collections[0].get_paths()[0].vertices[:, 1]
    assert drawn.max() == pytest.approx(np.degrees(high[2].max())) and drawn.min() == pytest.approx(
        np.degrees(low[2].min())
    )


def test_a_network_that_all_samples_trained_has_no_band_and_is_scored(rollout, scales):
    recipe = rollout.recipe.model_copy(update={"validation_fraction": 0.0})
    *_, last = train_scale(replace(rollout, recipe=recipe, final=False), level=0)
    assert last.checkpoint.band is None
    predicted = predict_trials(last.checkpoint, scales[0])
    rows = evaluate(last.checkpoint, scales[0], predicted, recipe="mine")
    assert rows["band_coverage"].isna().all() and rows["outside_training"].notna().all()
    table = tabulate_predictions(last.checkpoint, scales[0], predicted)
    assert table["low_rad"].isna().all()
    draw_predictions({1: table}, rows)


def test_the_range_is_left_beyond_a_margin_only():
    seen = Seen((0.0, -1.0, -2.0), (1.0, 1.0, 2.0))
    for quantities, outside in (([1.04, 0, 0], 0), ([1.06, 0, 0], 1), ([0, -1.2, 0], 1), ([0, 0, np.nan], 1)):
        assert seen.outside(quantities).sum() == outside
    assert gather([[0.5], [0.6]], np.array([1.0, 1.5]), 0.1)[1].tolist() == pytest.approx([0.6, 1.5, 5.0])


def predict(path, table):
    return CliRunner().invoke(
        app, ["predict", "--checkpoint", str(path), "--emg", "-"], input=table.to_csv(index=False)
    )


def test_the_stream_carries_the_band_and_says_once_that_the_training_range_is_left(scored, scales, tmp_path):
    checkpoint, predicted = scored
    checkpoint.save(tmp_path / "scale-0.pt")
    trials = scales[0]
    table = pd.DataFrame({"time_s": trials.time, "angle_rad": trials.angle[2]})
    table[list(trials.channels)] = trials.emg[2]
    result = predict(tmp_path / "scale-0.pt", table)
    written = pd.read_csv(io.StringIO(result.stdout))
    low, high = band_about(predicted.numpy(), checkpoint.band, 4)
    np.testing.assert_allclose(written["low_rad"], low[2], atol=1e-6)
    np.testing.assert_allclose(written["high_rad"], high[2], atol=1e-6)
    table.loc[40, "emg_triceps"] = -0.07  # which counts as 0
    table.loc[50:60, "emg_biceps"] = 1.4
    again = predict(tmp_path / "scale-0.pt", table)
    assert "emg_biceps" not in result.stderr and again.stderr.count("emg_biceps is 1.4") == 1
    assert "emg_triceps" not in again.stderr
    assert "line 52: emg_biceps is 1.4; in the training trials it went from" in again.stderr
