"""Scores one step ahead: of the unseen trial alone, with its measured history."""

import pytest
import torch

from myowave.data.store import write_trials
from myowave.learning.evaluation import r_squared
from myowave.learning.paper.one_step import score_one_step, tabulate_one_step
from myowave.learning.prediction import Network, predict_teacher_forced, to_tensors
from myowave.learning.training import train_scale


@pytest.fixture
def checkpoint(scales, model, wanted, teacher_forced):
    *_, last = train_scale(scales, model, teacher_forced, wanted, level=0, total=1, seeds=(0, 1))
    return last.checkpoint


def test_the_score_is_that_of_the_unseen_trial_without_given_samples(checkpoint, trials):
    network = Network.of(checkpoint)
    emg, angle = to_tensors(trials, torch.device("cpu"))
    with torch.no_grad():
        predicted = predict_teacher_forced(network, network.encode(emg, trials.dt), angle)
    (test,) = trials.index(trials.test)
    expected = r_squared(angle[test, 2:], predicted[:, test, 2:])
    assert score_one_step(checkpoint, trials) == pytest.approx(expected.tolist())


def test_every_run_and_seed_has_a_row(checkpoint, trials, tmp_path):
    path = tmp_path / "small" / "base" / "mine" / "1-scale" / "scale-0.pt"
    path.parent.mkdir(parents=True)
    checkpoint.save(path)
    write_trials(trials, tmp_path / "trials.parquet")
    table = tabulate_one_step([str(path)], [str(tmp_path / "trials.parquet")])
    assert table[["dataset", "recipe", "scales", "seed"]].values.tolist() == [["small", "mine", 1, s] for s in (0, 1)]
    assert table["test_r2_one_step"].tolist() == pytest.approx(score_one_step(checkpoint, trials))
