"""The ladder of scales, Algorithm 1: each trains on its own projection and begins where the coarser one ended."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from myowave.learning.parameters import identify

from myowave.data.wavelets import decompose, project
from myowave.learning.prediction import Network, predict_free_running, predict_teacher_forced
from myowave.learning.training import train_scale

CPU = torch.device("cpu")
SEEDS = (0, 1)


@pytest.fixture
def printed(teacher_forced):
    """One step ahead, without noise on the history: the loss of an epoch is then a plain mean."""
    return teacher_forced.model_copy(update={"history_noise": 0.0})


@pytest.fixture(scope="module")
def far_apart(trials):
    """Scales [0] to [-3]: the last one is plainly another motion."""
    return decompose(trials, 3)


def reports_of(scales, model, recipe, wanted, level, start=None, total=2):
    return list(
        train_scale(scales, model, recipe, wanted, level=level, total=total, seeds=SEEDS, start=start, device=CPU)
    )


def projected(trials, level):
    """EMG and angle of the training trials at scale [-level], straight from the projection."""
    train = trials.select(trials.train)
    emg, angle = (np.stack([project(one, level) for one in each]) for each in (train.emg, train.angle))
    return torch.from_numpy(emg), torch.from_numpy(angle)


def data_loss(checkpoint, emg, angle, dt):
    """J_data of Eq. 17 by hand, of the samples that neither validate nor were given, (S,)."""
    network, fraction = Network.of(checkpoint), checkpoint.recipe["validation_fraction"]
    with torch.no_grad():
        predicted = predict_teacher_forced(network, network.encode(emg, dt), angle)
    end = angle.shape[1] - round(fraction * angle.shape[1])
    inside = slice(network.history, end)
    return (predicted - angle)[..., inside].square().mean((1, 2))


def validation_by_hand(checkpoint, emg, angle, dt):
    """MSE (Eq. 39) and R2 (Eq. 40) of a free run over the end of each trial, (S,) each."""
    network = Network.of(checkpoint)
    begin = angle.shape[1] - round(checkpoint.recipe["validation_fraction"] * angle.shape[1])
    given = slice(begin - network.history, None)
    predicted = predict_free_running(network, emg[:, given], angle[:, given], dt)[..., network.history :]
    measured = angle[:, begin:]
    squares = (predicted - measured).square().sum((1, 2))
    return squares / measured.numel(), 1 - squares / (measured - measured.mean()).square().sum()


@pytest.mark.parametrize("level", [0, 1])
def test_a_scale_trains_on_its_own_projection(level, trials, model, wanted, printed):
    """The loss of the first epoch is that of the first weights, which steps as good as 0 leave in the checkpoint."""
    noise = 0.2 * np.random.default_rng(0).standard_normal(trials.angle.shape)
    rough = replace(trials, angle=trials.angle + noise)  # half of the noise is gone at scale [-1]
    still = printed.model_copy(update={"learning_rate": 1e-12})
    first, *_, last = reports_of(decompose(rough, level), model, still, wanted, level, total=level + 1)
    by_scale = {j: data_loss(last.checkpoint, *projected(rough, j), trials.dt) for j in (0, 1)}
    torch.testing.assert_close(first.losses.data, by_scale[level], rtol=1e-4, atol=0)
    assert (by_scale[0] / by_scale[1] > 1.1).all(), "the scales cannot be told apart"


@pytest.mark.parametrize("level", [0, 3])
def test_a_scale_is_validated_on_the_ends_of_its_own_projection(level, far_apart, trials, model, wanted, rollout):
    checkpoint = reports_of(far_apart, model, rollout, wanted, level, total=level + 1)[-1].checkpoint
    by_scale = {j: validation_by_hand(checkpoint, *projected(trials, j), trials.dt) for j in (0, 3)}
    mse, r2 = by_scale[level]
    torch.testing.assert_close(checkpoint.val_mse, mse, rtol=1e-2, atol=0)
    torch.testing.assert_close(1 - checkpoint.val_r2, 1 - r2, rtol=1e-2, atol=0)
    assert (by_scale[0][0] / by_scale[3][0] - 1).abs().max() > 3e-2, "the scales cannot be told apart"


def test_the_finer_scale_begins_with_the_weights_of_the_coarser(scales, trials, model, wanted, printed):
    recipe = printed.model_copy(update={"epochs": 30, "learning_rate": 0.02})
    untrained, *_, last = reports_of(scales, model, recipe, wanted, 1)
    assert (last.losses.data < 0.5 * untrained.losses.data).all(), "nothing was learned to hand on"
    first, *_ = reports_of(scales, model, recipe, wanted, 0, last.checkpoint)
    expected = data_loss(last.checkpoint, *projected(trials, 0), trials.dt)
    torch.testing.assert_close(first.losses.data, expected, rtol=1e-4, atol=0)


def test_the_finer_scale_begins_with_the_parameters_of_the_coarser(scales, trials, model, wanted, printed):
    """A first step of Adam is as long as the learning rate, in units of the start; the coarser scale took many."""
    recipe = printed.model_copy(update={"epochs": 40, "learning_rate": 0.01})
    identified, raw = identify(model, wanted, trials.constants, SEEDS)
    start = identified.values(raw)
    coarse = reports_of(scales, model, recipe, wanted, 1)[-1].checkpoint
    first, *_ = reports_of(scales, model, recipe, wanted, 0, coarse)
    begun = torch.stack([first.values[name] for name in identified.names], dim=-1)
    assert ((coarse.values / start - 1).abs() > 3 * recipe.learning_rate).any()
    assert ((begun - coarse.values).abs() / start <= 1.05 * recipe.learning_rate).all()


@pytest.mark.parametrize("level", [0, 1])
def test_steps_fall_along_one_cosine_over_all_scales(level, scales, trials, model, wanted, printed):
    """A first step of Adam is as long as the learning rate; each scale begins with a twentieth of it."""
    changes = {"epochs": 40, "learning_rate": 0.01, "schedule": "cosine"}
    recipe = printed.model_copy(update=changes)
    identified, raw = identify(model, wanted, trials.constants, SEEDS)
    start, before, coarse = identified.values(raw), identified.values(raw), None
    if level == 0:
        coarse = reports_of(scales, model, recipe, wanted, 1)[-1].checkpoint
        before = coarse.values
    first, *_ = reports_of(scales, model, recipe, wanted, level, coarse)
    step = (torch.stack([first.values[name] for name in identified.names], dim=-1) - before).abs() / start
    done = 20 * (1 - level)
    expected = 0.01 / 20 * 0.5 * (1 + math.cos(math.pi * done / 40))
    torch.testing.assert_close(step, torch.full_like(step, expected), rtol=1e-3, atol=0)
