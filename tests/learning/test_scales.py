"""The scales, Algorithm 1: each trains on its own projection and begins where the coarser one ended."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from pydantic import ValidationError

from myowave.data.wavelets import decompose, project
from myowave.learning.from_settings import build_task
from myowave.learning.methods.paper.one_step import predict_teacher_forced
from myowave.learning.optimisers import Adam
from myowave.learning.prediction import predict_free_running
from myowave.learning.task import begin_stage
from myowave.learning.training import train_scale, train_scales
from myowave.settings import RolloutRecipe, dump


@pytest.fixture
def printed(teacher_forced):
    """One step ahead, without noise on the history: the loss of an epoch is then a plain mean."""
    return changed(teacher_forced, history_noise=0.0)


def changed(task, *, scales=None, total=2, **settings):
    """The task with other settings of its recipe, on other scales."""
    recipe = task.recipe.model_copy(update=settings)
    return replace(task, scales=scales or task.scales, total=total, recipe=recipe)


@pytest.fixture(scope="module")
def far_apart(trials):
    """Scales [0] to [-3]: the last one is plainly another motion."""
    return decompose(trials, 3)


def projected(trials, level):
    """EMG and angle of the training trials at scale [-level], straight from the projection."""
    train = trials.select(trials.train)
    emg, angle = (np.stack([project(one, level) for one in each]) for each in (train.emg, train.angle))
    return torch.from_numpy(emg), torch.from_numpy(angle)


def data_loss(checkpoint, emg, angle, dt):
    """J_data of Eq. 17 by hand, of the samples that neither validate nor were given, (S,)."""
    network, fraction = checkpoint.network, checkpoint.recipe["validation_fraction"]
    with torch.no_grad():
        predicted = predict_teacher_forced(network, network.encode_inputs(emg, dt), angle)
    end = angle.shape[1] - round(fraction * angle.shape[1])
    inside = slice(network.history, end)
    return (predicted - angle)[..., inside].square().mean((1, 2))


def validation_by_hand(checkpoint, emg, angle, dt):
    """MSE (Eq. 39) and R2 (Eq. 40) of a free run over the end of each trial, (S,) each."""
    network = checkpoint.network
    begin = angle.shape[1] - round(checkpoint.recipe["validation_fraction"] * angle.shape[1])
    given = slice(begin - network.history, None)
    predicted = predict_free_running(network, emg[:, given], angle[:, given], dt)[..., network.history :]
    measured = angle[:, begin:]
    squares = (predicted - measured).square().sum((1, 2))
    return squares / measured.numel(), 1 - squares / (measured - measured.mean()).square().sum()


def values_of(task, report):
    """Identified parameters of a report, (S, P)."""
    return torch.stack([report.values[name] for name in task.wanted], dim=-1)


@pytest.mark.parametrize("level", [0, 1])
def test_a_scale_trains_on_its_own_projection(level, trials, printed):
    """The loss of the first epoch is that of the first weights, which steps as good as 0 leave in the checkpoint."""
    noise = 0.2 * np.random.default_rng(0).standard_normal(trials.angle.shape)
    rough = replace(trials, angle=trials.angle + noise)  # half of the noise is gone at scale [-1]
    still = changed(printed, scales=decompose(rough, level), total=level + 1, learning_rate=1e-12)
    first, *_, last = train_scale(still, level)
    by_scale = {j: data_loss(last.checkpoint, *projected(rough, j), trials.dt) for j in (0, 1)}
    torch.testing.assert_close(first.losses.data, by_scale[level], rtol=1e-4, atol=0)
    assert (by_scale[0] / by_scale[1] > 1.1).all(), "the scales cannot be told apart"


@pytest.mark.parametrize("level", [0, 3])
def test_a_scale_is_validated_on_the_ends_of_its_own_projection(level, far_apart, trials, rollout):
    *_, last = train_scale(changed(rollout, scales=far_apart, total=level + 1), level)
    by_scale = {j: validation_by_hand(last.checkpoint, *projected(trials, j), trials.dt) for j in (0, 3)}
    torch.testing.assert_close(1 - last.checkpoint.val_r2, 1 - by_scale[level][1], rtol=1e-2, atol=0)
    assert (by_scale[0][0] / by_scale[3][0] - 1).abs().max() > 3e-2, "the scales cannot be told apart"


def test_the_finer_scale_begins_with_the_weights_of_the_coarser(trials, printed):
    task = changed(printed, epochs=30, learning_rate=0.02)
    untrained, *_, last = train_scale(task, level=1)
    assert (last.losses.data < 0.5 * untrained.losses.data).all(), "nothing was learned to hand on"
    first = next(train_scale(task, level=0, before=last.checkpoint))
    expected = data_loss(last.checkpoint, *projected(trials, 0), trials.dt)
    torch.testing.assert_close(first.losses.data, expected, rtol=1e-4, atol=0)


def test_the_finer_scale_begins_with_the_parameters_of_the_coarser(printed):
    """A first step of Adam is as long as the learning rate, in units of the start; the coarser scale took many."""
    task = changed(printed, epochs=40, learning_rate=0.01)
    start = begin_stage(task, level=1).values
    *_, coarse = train_scale(task, level=1)
    first = next(train_scale(task, level=0, before=coarse.checkpoint))
    reached, begun = coarse.checkpoint.values, values_of(task, first)
    assert ((reached / start - 1).abs() > 3 * task.recipe.learning_rate).any()
    assert ((begun - reached).abs() / start <= 1.05 * task.recipe.learning_rate).all()


@pytest.mark.parametrize("level", [0, 1])
def test_steps_of_the_papers_method_are_as_long_at_every_scale(level, printed):
    """A first step of Adam is as long as the learning rate, whatever the gradient."""
    task = changed(printed, epochs=40, learning_rate=0.01)
    start, coarse = begin_stage(task, level=1).values, None
    before = start
    if level == 0:
        *_, last = train_scale(task, level=1)
        coarse = last.checkpoint
        before = coarse.values
    first = next(train_scale(task, level, coarse))
    step = (values_of(task, first) - before).abs() / start
    torch.testing.assert_close(step, torch.full_like(step, 0.01), rtol=1e-3, atol=0)


def test_steps_of_rollouts_fall_along_one_cosine_over_all_scales(rollout, scales, monkeypatch):
    """And each scale begins with a twentieth of it."""
    rates = []
    monkeypatch.setattr(Adam, "move", lambda self, rate: rates.append(rate))
    task = changed(replace(rollout, scales=scales, total=2), epochs=80, learning_rate=0.01, simulated_trials=0)
    list(train_scales(replace(task, final=False)))
    cosine = [0.005 * (1 + math.cos(math.pi * n / 80)) * min(1.0, (n % 40 + 1) / 20) for n in range(80)]
    assert rates == pytest.approx(cosine)


def test_a_task_from_plain_data_is_that_of_the_settings(settings, model, scales, wanted):
    recipe = RolloutRecipe(hidden=8, rate_hz=16.0)  # every second sample
    plain = {"physics": dump(settings.physics.of_arm("paper")), "recipe": dump(recipe)}
    plain["identify"] = {name: dump(choice) for name, choice in wanted.items()}
    thinned = build_task(scales, "base", **plain, total=2, seeds=3, wavelet={"name": "db2", "levels": 4})
    assert (thinned.recipe, thinned.wanted, thinned.total, thinned.seeds) == (recipe, wanted, 2, range(3))
    assert thinned.model.defaults == model.defaults
    for level, again in decompose(scales[0].thinned(16.0), 1).items():
        np.testing.assert_array_equal(thinned.scales[level].emg, again.emg)
    assert build_task(scales, "base", **plain, total=2, seeds=3).scales is scales, "where they were thinned before"
    with pytest.raises(ValidationError, match="hiden"):
        build_task(scales, "base", **plain | {"recipe": {**plain["recipe"], "hiden": 9}}, total=2, seeds=3)
