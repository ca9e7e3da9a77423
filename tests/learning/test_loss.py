"""The residual of the paper's loss: its derivatives, and that it vanishes on a true motion."""

from dataclasses import replace

import pytest
import torch

from myowave.learning.loss import Noise, TeacherForcedLoss, predict_with_time_derivatives
from myowave.learning.network import Architecture, Scaling, apply_cell, initialise
from myowave.learning.prediction import Network, predict_teacher_forced, to_tensors
from myowave.learning.training import train_scale
from myowave.physics.build import build_model
from myowave.physics.effects import catalogue

CPU = torch.device("cpu")


@pytest.mark.parametrize("cell", ["gru", "rnn"])
def test_a_cell_without_a_state_before_it_is_one_after_a_state_of_0(cell):
    weights = initialise(Architecture(cell, 6, 2, increments=False, time_input=True), (0, 1), CPU)
    if cell == "gru":
        weights["state_bias"] += 0.3
    driven = torch.randn(2, 5, weights["hidden"].shape[-1], generator=torch.Generator().manual_seed(1))
    torch.testing.assert_close(
        apply_cell(cell, weights, None, driven), apply_cell(cell, weights, torch.zeros(2, 5, 6), driven)
    )


@pytest.fixture
def network(trials):
    architecture = Architecture("gru", 6, 2, increments=False, time_input=True)
    return Network(architecture, Scaling.of(trials), initialise(architecture, (0, 1), CPU), carried=False, history=2)


def test_time_derivatives_equal_finite_differences_over_the_input_time(network, trials):
    emg, angle = to_tensors(trials, CPU)
    x, step_s = network.encode(emg, trials.dt), 0.3
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


def test_the_residual_is_small_along_a_true_motion_and_grows_with_wrong_parameters(network, trials, model, monkeypatch):
    """Noisy EMG has kinks that central differences smear, so the true residual is small beside a wrong one, not 0."""
    monkeypatch.setattr(
        "myowave.learning.loss.predict_teacher_forced", lambda network, x, angle: angle.expand(2, -1, -1)
    )
    weights = network.weights
    loss = teacher_forced_loss(network, trials, model)
    params = [{n: v.requires_grad_() for n, v in strength(model, factor).items()} for factor in (1.0, 1.2)]
    true, wrong = (loss.backward(weights, each).residual.max() for each in params)
    assert wrong > 5 * true


@pytest.mark.parametrize("derivative", ["sequence", "time"])
def test_what_validates_is_in_no_loss(derivative, network, trials, model):
    usable = 150
    moved = replace(trials, angle=trials.angle.copy(), emg=trials.emg.copy())
    moved.angle[:, usable:] += 0.5
    moved.emg[:, usable:] = 0.9
    losses = [
        teacher_forced_loss(network, each, model, derivative=derivative, usable=usable).backward(
            {name: value.requires_grad_() for name, value in network.weights.items()}, strength(model, 1.1)
        )
        for each in (trials, moved)
    ]
    torch.testing.assert_close(losses[0].data, losses[1].data)
    torch.testing.assert_close(losses[0].residual, losses[1].residual)


def strength(model, factor):
    """A parameter of both seeds, as a loss takes it."""
    return {"f0_Bi": torch.full((2, 1), factor * model.defaults["f0_Bi"], dtype=torch.float64)}


def teacher_forced_loss(network, trials, model, *, beta=1e-3, derivative="sequence", usable=None):
    """The loss without noise, on all samples or the first `usable`."""
    lengths = torch.tensor(trials.lengths if usable is None else [usable] * len(trials.lengths))
    return TeacherForcedLoss(network, model, trials, lengths, beta, derivative, Noise(0.0, (0, 1), 0), CPU)


def test_identified_parameters_get_a_gradient_only_through_the_residual(network, trials, model):
    weights = {name: value.requires_grad_() for name, value in network.weights.items()}
    gradients = []
    for beta in (1e-3, 2e-3):
        params = strength(model, 1.1)
        params["f0_Bi"].requires_grad_()
        losses = teacher_forced_loss(network, trials, model, beta=beta).backward(weights, params)
        torch.testing.assert_close(losses.total, losses.data + beta * losses.residual)
        gradients.append(params["f0_Bi"].grad)
    torch.testing.assert_close(gradients[1], 2 * gradients[0])


@pytest.mark.parametrize("changes", [{"cell": "rnn"}, {"output": "absolute"}, {"history_noise": 1e-4}])
def test_other_networks_train_by_rollouts_too(changes, scales, model, wanted, rollout):
    recipe = rollout.model_copy(update={"epochs": 60, "learning_rate": 0.01, "simulated_trials": 0, **changes})
    reports = list(train_scale(scales, model, recipe, wanted, level=0, total=1, seeds=(0,), device=CPU))
    first, last = (sum(r.losses.data.item() for r in part) for part in (reports[:5], reports[-5:]))
    assert last < 0.7 * first


def test_an_effect_with_a_state_is_refused_by_the_residual(settings, scales, wanted, teacher_forced):
    stateful = next(e.name for e in catalogue(()).values() if e.stateful)
    model = build_model(f"base+{stateful}", settings.physics)
    with pytest.raises(ValueError, match="state of its own"):
        next(train_scale(scales, model, teacher_forced, wanted, level=0, total=1, seeds=(0,), device=CPU))
