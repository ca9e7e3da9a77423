"""Scores one step ahead: of only the unseen trial, with its measured history."""

import numpy as np
import pandas as pd
import pytest
import torch
import yaml

from myowave.data.store import write_trials
from myowave.learning.evaluation import r_squared
from myowave.learning.methods.paper.one_step import predict_teacher_forced
from myowave.learning.prediction import to_tensors
from myowave.learning.task import Task
from myowave.learning.training import train_scale
from myowave.settings import PaperRecipe
from studies.paper.one_step import accelerations_seen, score_one_step, tabulate_one_step


@pytest.fixture(scope="module")
def checkpoint(trials, model, wanted, pytestconfig):
    recipes = yaml.safe_load((pytestconfig.rootpath / "studies/paper/settings.yaml").read_text())["learning"]["recipes"]
    recipe = PaperRecipe.model_validate(recipes["paper"] | {"hidden": 8, "epochs": 4})
    task = Task({0: trials}, model, recipe, wanted, total=1, seeds=(0, 1), device=torch.device("cpu"))
    *_, last = train_scale(task, level=0)
    return last.checkpoint


def test_the_score_is_that_of_the_unseen_trial_without_given_samples(checkpoint, trials):
    network = checkpoint.network
    emg, angle = to_tensors(trials, torch.device("cpu"))
    with torch.no_grad():
        predicted = predict_teacher_forced(network, network.encode_inputs(emg, trials.dt), angle)
    (test,) = trials.index(trials.test)
    expected = r_squared(angle[test, 2:], predicted[:, test, 2:])
    assert score_one_step(checkpoint, trials)["test_r2_one_step"].tolist() == pytest.approx(expected.tolist())


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
    scores = score_one_step(checkpoint, trials)
    pd.testing.assert_frame_equal(table[list(scores)], scores)
