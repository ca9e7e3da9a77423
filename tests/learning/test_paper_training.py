"""The paper's own loss: its derivatives, its residual, which vanishes on a true motion, and what gets a gradient."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.data.wavelets import decompose
from myowave.learning.methods.paper.one_step import predict_teacher_forced, predict_with_time_derivatives
from myowave.learning.methods.paper.residual import MotionResidual
from myowave.learning.methods.paper.training import PaperTraining
from myowave.learning.prediction import run_free
from myowave.learning.task import Stage, begin_stage
from myowave.learning.training import train_scale
from myowave.learning.windows import Corpus, Pieces
from myowave.models import build_model
from myowave.physics.dynamics import torques
from myowave.physics.effects import catalogue
from myowave.physics.simulation import Simulation

CPU = torch.device("cpu")


@pytest.fixture
def stage(teacher_forced) -> Stage:
    """The beginning of a training, of which 150 of 200 samples are trained on."""
    return begin_stage(with_settings(teacher_forced, hidden=6, history_noise=0.0, validation_fraction=0.25), level=0)


def with_settings(task, **changes):
    return replace(task, recipe=task.recipe.model_copy(update=changes))


def with_recipe(stage: Stage, **changes) -> Stage:
    return replace(stage, task=with_settings(stage.task, **changes))


def params_of(stage: Stage):
    """Parameters as a loss takes them, which may take gradients."""
    values = stage.values.clone().requires_grad_()
    return {name: values[:, i, None] for i, name in enumerate(stage.names)}, values


def forced(stage: Stage):
    """The network, its inputs and all angles."""
    return stage.network, stage.corpus.x, torch.from_numpy(stage.trials.angle)


def test_a_prediction_between_measured_angles_is_a_free_run_of_one_step(teacher_forced):
    network, x, angle = forced(begin_stage(teacher_forced, level=0))
    network = replace(network, weights={**network.weights, "state_bias": network.weights["state_bias"] + 0.3})
    predicted = predict_teacher_forced(network, x, angle)
    z, v = (values.expand(2, -1, -1) for values in network.encode_angle(angle))
    for n in (50, 199):
        window = slice(n - network.history, n)
        one = run_free(network, x[:, window.start : n + 1], z[..., window], v[..., window])
        torch.testing.assert_close(predicted[..., n], network.to_rad(one[..., 0]), rtol=0, atol=1e-6)


def test_time_derivatives_equal_finite_differences_over_the_input_time(teacher_forced):
    stage = begin_stage(with_settings(teacher_forced, hidden=6), level=0)
    (network, x, angle), step_s = forced(stage), 0.3
    value, first, second = predict_with_time_derivatives(network, x, angle)
    torch.testing.assert_close(value, predict_teacher_forced(network, x, angle))
    # Only the time of the last prediction moves; no history holds it.
    moved = []
    for sign in (1, -1):
        shifted = x.clone()
        shifted[:, -1, -1] += sign * step_s / network.scaling.duration
        moved.append(predict_teacher_forced(network, shifted, angle)[..., -1])
    slope = (moved[0] - moved[1]) / (2 * step_s)
    bend = (moved[0] - 2 * value[..., -1] + moved[1]) / step_s**2
    torch.testing.assert_close(first[..., -1], slope, rtol=1e-2, atol=1e-5)
    torch.testing.assert_close(second[..., -1], bend, rtol=5e-2, atol=1e-5)


def test_the_residual_is_small_along_a_true_motion_and_grows_with_wrong_parameters(trials, model):
    """Noisy EMG has kinks that central differences smear, so the true residual is small beside a wrong one, not 0."""
    q = torch.from_numpy(trials.angle)[None]
    residual = MotionResidual(model, trials, ["f0_Bi"], CPU)
    whole = Pieces(torch.arange(3), torch.zeros(3, dtype=torch.long), trials.angle.shape[1])
    true, wrong = (
        residual.along_sequence({"f0_Bi": torch.full((1, 1), strength)}, whole, q).square().mean()
        for strength in (model.defaults["f0_Bi"], 1.2 * model.defaults["f0_Bi"])
    )
    assert wrong > 5 * true


def test_the_residual_is_eq_38_of_the_predicted_motion(stage):
    """I qddot - E - T with central differences of the predictions and the activations at the samples, by hand."""
    slow = decompose(stage.task.scales[0], 4)[4]  # or q would be all acceleration
    stage = begin_stage(replace(stage.task, scales={0: slow}), level=0)
    lively = {name: 4 * value.detach() for name, value in stage.network.weights.items()}  # or it would hardly move
    stage = replace(stage, network=replace(stage.network, weights=lively).trainable())
    trials, dt, params = stage.trials, stage.trials.dt, params_of(stage)[0]
    with torch.no_grad():
        q = predict_teacher_forced(*forced(stage)).numpy()
    qdot, qddot = np.gradient(q, dt, axis=-1), np.diff(q, 2, axis=-1) / dt**2
    q, qdot = (torch.from_numpy(x[..., 1:-1]) for x in (q, qdot))
    simulation = Simulation(stage.task.model, params, torch.from_numpy(trials.emg), dt)
    activation = simulation.drive.activation[..., 1:, 0, :]  # at the beginning of each step
    torque = torques(simulation.along_time, q, qdot, activation, {})
    inside = slice(stage.network.history, 150 - 2)  # of the samples that have two neighbours
    residual = (torque.inertia * torch.from_numpy(qddot) - torque.total)[..., inside].detach()
    losses = PaperTraining(stage).backward(params)
    torch.testing.assert_close(losses.residual, residual.square().mean((1, 2)), rtol=1e-4, atol=0)
    slower = torques(simulation.along_time, q, 0.5 * qdot, activation, {}).total - torque.total
    assert slower.square().mean() / residual.square().mean() > 1e-3, "speed does not matter"


@pytest.mark.parametrize("residual", ["sequence", "time"])
def test_what_validates_is_in_no_loss(residual, stage):
    trials = replace(stage.trials, angle=stage.trials.angle.copy(), emg=stage.trials.emg.copy())
    trials.angle[:, 150:] += 0.5
    trials.emg[:, 150:] = 0.9
    emg, angle = torch.from_numpy(trials.emg), torch.from_numpy(trials.angle)[None]
    corpus = Corpus.of(stage.network, emg, angle, trials.dt, stage.corpus.usable)
    as_it_is = with_recipe(stage, residual=residual)
    losses = [
        PaperTraining(each).backward(params_of(each)[0])
        for each in (as_it_is, replace(as_it_is, trials=trials, corpus=corpus))
    ]
    torch.testing.assert_close(losses[0].data, losses[1].data)
    torch.testing.assert_close(losses[0].residual, losses[1].residual)


def test_parameters_get_a_gradient_only_through_the_residual(stage):
    gradients = []
    for beta in (1e-3, 2e-3):
        params, values = params_of(stage)
        losses = PaperTraining(with_recipe(stage, beta=beta)).backward(params)
        torch.testing.assert_close(losses.total, losses.data + beta * losses.residual)
        gradients.append(values.grad)
    torch.testing.assert_close(gradients[1], 2 * gradients[0])


def test_an_effect_with_a_state_is_refused_by_the_residual(settings, teacher_forced):
    stateful = next(e.name for e in catalogue(()).values() if e.stateful)
    task = replace(teacher_forced, model=build_model(f"base+{stateful}", settings.physics.of_arm("paper")))
    with pytest.raises(ValueError, match="state of its own"):
        next(train_scale(task, level=0))
