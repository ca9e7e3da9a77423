"""What a sweep judges settings by: training trials that the judged networks have not seen, and never a test trial."""

from dataclasses import replace

import numpy as np
import pytest

from myowave.learning.prediction import predict_motion
from myowave.learning.sweep.objective import judge
from myowave.learning.training import train_scales


@pytest.fixture
def training(rollout):
    """The task of a sweep: training trials only."""
    scales = {level: trials.select(trials.train) for level, trials in rollout.scales.items()}
    return replace(rollout, scales=scales, total=2)


def test_each_training_trial_judges_networks_that_were_trained_without_it(training):
    scores = list(judge({"hidden": 6}, training, 4))
    assert [left for left, _ in scores] == [1, 0]
    errors = []
    for name, other in (("1", "2"), ("2", "1")):
        alone = {level: trials.select([other]) for level, trials in training.scales.items()}
        recipe = training.recipe.model_copy(update={"hidden": 6, "epochs": 4})
        *_, checkpoint = train_scales(replace(training, scales=alone, recipe=recipe))
        trial, given = training.scales[0].select([name]), checkpoint.network.history
        missed = predict_motion(checkpoint.network, trial)[:, 0, given:].numpy() - trial.angle[0, given:]
        errors.append(np.rad2deg(np.sqrt(np.square(missed).mean(1))))
    assert scores[0][1] == pytest.approx(errors[0])
    assert scores[1][1] == pytest.approx(np.mean(errors, axis=0))


def test_what_judges_is_in_no_training_trial(rollout):
    fold = rollout.holding_out(["2"])
    for level, trials in fold.scales.items():
        assert trials.names == ("1", "2") and trials.train == ("1",), level
