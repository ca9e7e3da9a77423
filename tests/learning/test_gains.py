"""EMG at other gains: what a network sees of recorded windows while it trains, and nothing else."""

from dataclasses import replace

import pytest
import torch

from myowave.learning.inputs import Given
from myowave.learning.methods.rollout.training import RolloutLoss
from myowave.learning.task import begin_stage
from myowave.learning.training import train_scale
from myowave.learning.windows import Noise

SEEDS = (0, 1)


@pytest.fixture
def stage(rollout):
    return begin_stage(rollout, level=0)


def windows(stage, **noise):
    """Windows of the first epoch as the network sees them."""
    loss = RolloutLoss(stage.network, stage.corpus, stage.task.recipe.changed(noise), 10, SEEDS)
    return loss._disturb(loss._cut(stage.corpus, 64)[0])


def as_emg(stage, x):
    mean, std = (x.new_tensor(v) for v in (stage.network.scaling.input_mean, stage.network.scaling.input_std))
    return x * std + mean


def test_each_window_channel_and_seed_has_one_factor_over_its_whole_length(stage):
    recorded, seen = (as_emg(stage, windows(stage, emg_gain=gain)) for gain in (0.0, 0.2))
    factor = seen / recorded
    assert factor.shape == (2, 64, recorded.shape[1], 2)
    torch.testing.assert_close(factor, factor[:, :, :1].expand_as(factor), rtol=1e-3, atol=1e-3)
    logs = factor[:, :, 0].log()
    assert logs.std() == pytest.approx(0.2, rel=0.2) and abs(logs.mean()) < 0.05
    assert len(logs.flatten().unique()) == logs.numel()


def known_windows(stage, **noise):
    """Windows of a network that is given a load, which is 0.7 of its scaling everywhere."""
    network = stage.network
    known = replace(
        network,
        architecture=replace(network.architecture, given=Given({"load": 0.0}, ("load",))),
        scaling=replace(network.scaling, input_mean=(0.3, 0.2, 1.0), input_std=(0.2, 0.1, 0.5)),
    )
    x = torch.cat((stage.corpus.x, torch.full_like(stage.corpus.x[..., :1], 0.7)), dim=-1)
    return windows(replace(stage, network=known, corpus=replace(stage.corpus, x=x)), **noise)


def test_gains_leave_what_is_known_as_it_is(stage):
    x = known_windows(stage, emg_gain=0.5)
    assert (x[..., 2] == 0.7).all() and x[..., :2].std() > 0


def test_what_is_known_is_told_with_one_error_for_a_window(stage):
    recorded, x = known_windows(stage), known_windows(stage, known_noise=0.3)
    error = x[..., 2] - 0.7
    assert torch.equal(x[..., :2], recorded[..., :2].expand(2, -1, -1, -1))
    torch.testing.assert_close(error, error[..., :1].expand_as(error))
    assert error[..., 0].std() == pytest.approx(0.3, rel=0.2) and len(error[..., 0].unique()) == 128


def test_a_seed_has_the_same_gains_by_itself_and_each_scale_has_its_own():
    like = torch.zeros(1)
    among = Noise(0.2, (0, 7), 0, 1).draw(5, like=like)
    assert torch.equal(Noise(0.2, (7,), 0, 1).draw(5, like=like)[0], among[1])
    assert not torch.equal(Noise(0.2, (7,), 1, 1).draw(5, like=like)[0], among[1])
    assert not torch.equal(Noise(0.2, (7,), 0, 2).draw(5, like=like)[0], among[1])


def test_simulated_windows_stand_beside_recorded_ones_of_other_gains(rollout):
    recipe = rollout.recipe.model_copy(update={"emg_gain": 0.2, "epochs": 20, "simulated_trials": 8})
    *_, last = train_scale(replace(rollout, recipe=recipe), level=0)
    assert all(weight.isfinite().all() for weight in last.checkpoint.weights.values())


def test_nothing_is_kept_for_validation_where_the_share_is_0(rollout):
    task = replace(
        rollout, final=False, recipe=rollout.recipe.model_copy(update={"validation_fraction": 0.0, "patience": 2})
    )
    stage = begin_stage(task, level=0)
    assert stage.corpus.usable.tolist() == list(stage.trials.lengths)
    *reports, last = train_scale(task, level=0)
    assert len(reports) + 1 == task.recipe.epochs, "nothing stops it"
    assert last.checkpoint.val_r2.isnan().all()
    other = replace(task, recipe=task.recipe.model_copy(update={"patience": 100, "epochs": 6}))
    *_, again = train_scale(other, level=0)
    for name, weight in again.checkpoint.weights.items():
        assert torch.equal(weight, last.checkpoint.weights[name])
        assert not torch.equal(weight, stage.network.weights[name]) or name == "bias", "the last epoch's, not the first"
