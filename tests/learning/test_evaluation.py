"""Scores: the paper's formulas by hand, and of the test trials only."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch

from myowave.data.trials import Trials
from myowave.learning import evaluation
from myowave.learning.evaluation import evaluate, r_squared, tabulate_predictions
from myowave.learning.training import train_scale
from myowave.scores import read_evaluation

SCORES = ["test_mse", "test_r2", "test_nmse"]
LENGTHS = (30, 24, 40, 18)


@pytest.fixture
def four_trials():
    """Two trials that train and two that test, all of different length, far from 0 on average."""
    random = np.random.default_rng(2)
    return Trials.from_sequences(
        dataset="four", dt=0.03, names=("a", "b", "c", "d"), channels=("emg_biceps", "emg_triceps"), test=("b", "d"),
        emg=[random.random((n, 2)) for n in LENGTHS], angle=[1.0 + 0.3 * random.standard_normal(n) for n in LENGTHS],
    )  # fmt: skip


@pytest.fixture
def checkpoint(teacher_forced):
    """It gives labels and a history of two samples, and predicts nothing."""
    recipe = teacher_forced.recipe.model_copy(update={"epochs": 1, "history_steps": 2})
    *_, last = train_scale(replace(teacher_forced, recipe=recipe), level=0)
    return last.checkpoint


@pytest.fixture
def score(checkpoint):
    """The scores of predictions (S, T, N) of some trials, by seed."""
    return lambda trials, predicted: evaluate(checkpoint, trials, predicted, recipe="mine")[SCORES]


def predictions_of(trials, seeds=2):
    random = np.random.default_rng(3)
    return torch.from_numpy(trials.angle + 0.1 * random.standard_normal((seeds, *trials.angle.shape)))


def by_hand(measured, predicted):
    """Eqs. 39, 40 and 44, sum by sum."""
    n, mean = len(measured), sum(measured) / len(measured)
    misses = sum((q - p) ** 2 for q, p in zip(measured, predicted, strict=True))
    spread = sum((q - mean) ** 2 for q in measured)
    return misses / n, 1 - misses / spread, misses / spread / n


def test_metrics_are_those_of_the_paper():
    measured, predicted = torch.tensor([[1.0, 2.0, 4.0], [9.0, 9.5, 7.0]]), torch.tensor([[1.5, 2.0, 3.0], [9, 9, 9.0]])
    for row, (q, p) in enumerate(zip(measured.tolist(), predicted.tolist(), strict=True)):
        found = evaluation.score(measured, predicted)
        assert [found[name][row] for name in SCORES] == pytest.approx(by_hand(q, p))


def test_the_mean_as_a_prediction_explains_nothing_and_a_shift_of_both_changes_nothing():
    measured = torch.randn(3, 50, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    flat = measured.mean(-1, keepdim=True).expand_as(measured)
    torch.testing.assert_close(r_squared(measured, flat), torch.zeros(3, dtype=torch.float64))
    torch.testing.assert_close(r_squared(measured, measured), torch.ones(3, dtype=torch.float64))
    noisy = measured + 0.1 * flat + 0.2
    torch.testing.assert_close(r_squared(measured + 7, noisy + 7), r_squared(measured, noisy))


def test_scores_are_means_over_the_test_trials_without_the_samples_that_were_given(four_trials, score):
    predicted = predictions_of(four_trials)
    found = score(four_trials, predicted)
    for seed in (0, 1):
        each = [
            by_hand(four_trials.angle[i, 2 : LENGTHS[i]], predicted[seed, i, 2 : LENGTHS[i]].numpy()) for i in (1, 3)
        ]
        assert found.loc[seed].tolist() == pytest.approx(np.mean(each, axis=0).tolist())


@pytest.mark.parametrize("name", ["a", "b", "c", "d"])
def test_a_trial_moves_the_scores_if_and_only_if_it_tests(name, four_trials, score):
    predicted, angle = predictions_of(four_trials), four_trials.angle.copy()
    i = four_trials.names.index(name)
    angle[i, : LENGTHS[i]] += np.linspace(0, 0.5, LENGTHS[i])
    angle[i, LENGTHS[i] :] = angle[i, LENGTHS[i] - 1]
    before, after = score(four_trials, predicted), score(replace(four_trials, angle=angle), predicted)
    assert (before != after).all(axis=None) == (name in four_trials.test)
    assert (before == after).all(axis=None) == (name in four_trials.train)


def test_predictions_are_listed_under_their_trial_seed_and_role(four_trials, checkpoint):
    predicted = predictions_of(four_trials)
    table = tabulate_predictions(checkpoint, four_trials, predicted)
    assert len(table) == 2 * sum(LENGTHS)
    for (name, seed), rows in table.groupby(["trial", "seed"]):
        i = four_trials.names.index(name)
        np.testing.assert_array_equal(rows["predicted_rad"], predicted[seed, i, : LENGTHS[i]])
        np.testing.assert_array_equal(rows["angle_rad"], four_trials.angle[i, : LENGTHS[i]])
        assert set(rows["role"]) == {"test" if name in ("b", "d") else "train"}


def test_an_evaluation_cut_short_is_not_summarised(tmp_path):
    scores = {"dataset": "a", "model": "base", "recipe": "r", "scales": 1, "seed": [0, 1], "epochs": 9, "seconds": 1.5}
    path = tmp_path / "evaluation.csv"
    pd.DataFrame({**scores, "test_r2": [0.9, np.nan]}).to_csv(path, index=False)
    whole = path.read_text()
    pd.DataFrame({"seed": [0, 0, 1, 1], "parameter": "f0"}).to_csv(tmp_path / "parameters.csv", index=False)
    assert len(read_evaluation(path, 2)) == 2
    lines = whole.splitlines(keepends=True)
    for cut in (whole[:-1], whole[: -len(lines[-1]) // 2], "".join(lines[:2]), lines[0], "", whole[:9]):
        path.write_text(cut)
        with pytest.raises(ValueError, match="evaluation.csv: no table of scores .*Remove it, and run again"):
            read_evaluation(path)


def test_an_evaluation_without_some_of_its_seeds_is_not_summarised(tmp_path):
    # Cut off after a whole line, and nothing beside it tells how many there were, as with a baseline.
    scores = {"dataset": "a", "model": "base", "recipe": "r", "scales": 1, "seed": [0, 1], "epochs": 9, "seconds": 1.5}
    pd.DataFrame(scores).to_csv(path := tmp_path / "evaluation.csv", index=False)
    with pytest.raises(ValueError, match=r"evaluation.csv: no table of scores .it has 2 of 5 seeds.*Remove it"):
        read_evaluation(path, 5)
