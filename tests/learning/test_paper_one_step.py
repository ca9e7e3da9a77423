"""Scores one step ahead: of only the unseen trial, with its measured history."""

import numpy as np
import pytest
import torch

from myowave.data.store import write_trials
from myowave.learning.evaluation import r_squared
from myowave.learning.paper.bias import accelerations_seen
from myowave.learning.paper.one_step import score_one_step, tabulate_one_step
from myowave.learning.paper.windowed import predict_teacher_forced
from myowave.learning.prediction import to_tensors
from myowave.learning.training import train_scale


@pytest.fixture
def checkpoint(teacher_forced):
    *_, last = train_scale(teacher_forced, level=0)
    return last.checkpoint


def test_the_score_is_that_of_the_unseen_trial_without_given_samples(checkpoint, trials):
    network = checkpoint.network
    emg, angle = to_tensors(trials, torch.device("cpu"))
    with torch.no_grad():
        predicted = predict_teacher_forced(network, network.encode_inputs(emg, trials.dt), angle)
    (test,) = trials.index(trials.test)
    expected = r_squared(angle[test, 2:], predicted[:, test, 2:])
    assert score_one_step(checkpoint, trials)[0] == pytest.approx(expected.tolist())


def test_the_share_of_accelerations_is_the_slope_of_second_differences():
    random = np.random.default_rng(0)
    measured = random.standard_normal(200)
    predicted = np.stack([measured + 3.0, 0.7 * measured, np.zeros(200)])
    assert accelerations_seen(predicted, measured) == pytest.approx([1.0, 0.7, 0.0])


def test_every_run_and_seed_has_a_row(checkpoint, trials, tmp_path):
    path = tmp_path / "small" / "base" / "mine" / "1-scale" / "scale-0.pt"
    path.parent.mkdir(parents=True)
    checkpoint.save(path)
    write_trials(trials, tmp_path / "trials.parquet")
    table = tabulate_one_step([str(path)], [str(tmp_path / "trials.parquet")])
    assert table[["dataset", "recipe", "scales", "seed"]].values.tolist() == [["small", "mine", 1, s] for s in (0, 1)]
    scores, shares = score_one_step(checkpoint, trials)
    assert table["test_r2_one_step"].tolist() == pytest.approx(scores)
    assert table["acceleration_share"].tolist() == pytest.approx(shares)


def test_a_network_that_carries_its_state_is_refused(rollout, trials):
    *_, last = train_scale(rollout, level=0)
    with pytest.raises(ValueError, match="hidden_state: windowed"):
        score_one_step(last.checkpoint, trials)
