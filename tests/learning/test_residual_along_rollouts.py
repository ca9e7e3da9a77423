"""Physics teaches rollouts by its residual along them."""

from dataclasses import replace

import pytest
import torch

from myowave.learning.loss import Noise
from myowave.learning.methods.rollout import loss as rollout_loss
from myowave.learning.methods.rollout.loss import RolloutLoss, Taught
from myowave.learning.methods.rollout.training import RolloutTraining
from myowave.learning.residual import Residual
from myowave.learning.task import begin_stage
from myowave.learning.training import train_scale

CPU = torch.device("cpu")


def with_recipe(task, **changes):
    return replace(task, recipe=task.recipe.changed(changes))


def taught(stage, model, weight, **params):
    values = {name: torch.full((2, 1), model.defaults[name] * factor) for name, factor in params.items()}
    residual = Residual.of(model, stage.trials, ["f0_Bi", "l0_Tri"], CPU, averaged=True)
    return Taught(residual, values, torch.tensor([weight, 2 * weight]))


def begin(stage, steps=10):
    none = Noise(0.0, (0, 1), 0)
    return RolloutLoss(stage.network, stage.corpus, steps, torch.Generator().manual_seed(0), none, none)


def gradients(stage):
    found = {name: weight.grad.clone() for name, weight in stage.network.weights.items()}
    for weight in stage.network.weights.values():
        weight.grad = None
    return found


def test_the_residual_adds_its_weight_times_its_gradient_to_that_of_the_data(rollout, model):
    stage, by_weight = begin_stage(rollout, 0), {}
    for weight in (0.0, 1e-3, 2e-3):
        losses = begin(stage).backward(taught=taught(stage, model, weight, f0_Bi=1.0))
        torch.testing.assert_close(losses.total, losses.data + torch.tensor([weight, 2 * weight]) * losses.residual)
        by_weight[weight] = gradients(stage)
    alone = begin(stage).backward()
    assert (alone.residual == 0).all() and (losses.residual > 0).all()
    torch.testing.assert_close(alone.data, losses.data)
    for name, gradient in gradients(stage).items():
        torch.testing.assert_close(by_weight[0.0][name], gradient)
        one, two = (by_weight[weight][name] - gradient for weight in (1e-3, 2e-3))
        torch.testing.assert_close(two, 2 * one, rtol=1e-3, atol=1e-5 * float(two.abs().max() + 1))


def test_the_gradient_is_that_of_data_and_residual_together(rollout, model):
    stage, totals = begin_stage(rollout, 0), []
    bias = stage.network.weights["output_bias"]
    for nudge in (0.02, -0.02, 0.0):
        with torch.no_grad():
            bias += nudge
        totals.append(begin(stage).backward(taught=taught(stage, model, 1e-3, f0_Bi=1.0)).total)
        gradient = gradients(stage)["output_bias"].flatten()
        with torch.no_grad():
            bias -= nudge
    slope = (totals[0] - totals[1]) / 0.04
    torch.testing.assert_close(gradient * stage.network.scaling.angle_std**2, slope, rtol=0.02, atol=1e-6)


def test_a_rollout_along_the_measured_motion_leaves_next_to_nothing_with_the_true_parameters_only(
    rollout, model, monkeypatch
):
    stage = begin_stage(rollout, 0)
    left = {}
    for factor in (1.0, 1.2):
        loss = begin(stage)
        # The windows that the loss draws, from the same generator.
        trial, start = stage.corpus.draw(loss._count, loss._length, torch.Generator().manual_seed(0))
        _, z, _ = stage.corpus.cut(trial, start, loss._length)
        measured = z[..., stage.network.history :].expand(2, -1, -1).clone().requires_grad_()
        monkeypatch.setattr(rollout_loss, "roll_out_gru", lambda *_, predicted=measured: predicted)
        left[factor] = loss.backward(taught=taught(stage, model, 1.0, f0_Bi=factor, l0_Tri=1.0)).residual
    assert (left[1.0] < 0.02 * left[1.2]).all()


def test_a_residual_takes_training_nearer_to_the_equation_of_motion(rollout):
    last = {}
    for beta in (1e-7, 1e-3):
        task = with_recipe(rollout, epochs=60, simulated_trials=0, beta=beta)
        *_, report = train_scale(task, 0)
        last[beta] = report.losses.residual
    assert (last[1e-3] < last[1e-7]).all()


@pytest.mark.parametrize("level", [1, 0])
def test_physics_teaches_at_every_scale_once_its_parameters_are_found(rollout, level):
    task = replace(with_recipe(rollout, epochs=40, beta=1e-5, simulated_trials=0), total=2)
    checkpoint = None
    for each in range(1, level - 1, -1):
        reports = list(train_scale(task, each, checkpoint))
        checkpoint = reports[-1].checkpoint
    assert (reports[0].losses.residual == 0).all() and (reports[-1].losses.residual > 0).all()


def test_physics_that_does_not_follow_the_motion_teaches_nothing(rollout, monkeypatch):
    weights = {}
    for beta in (0.0, 1e-2):
        monkeypatch.setattr(RolloutTraining, "_follows", lambda self, mse: torch.zeros_like(mse, dtype=torch.bool))
        *_, report = train_scale(with_recipe(rollout, epochs=30, beta=beta, simulated_trials=0), 0)
        weights[beta] = report.checkpoint.weights
    for name, weight in weights[0.0].items():
        assert torch.equal(weight, weights[1e-2][name]), name
