"""The residual of the paper's loss: its derivatives, and that it vanishes on a true motion."""

import pytest
import torch

from myowave.learning.loss import Noise, TeacherForcedLoss, predict_with_time_derivatives
from myowave.learning.network import Architecture, Scaling, apply_cell, initialise
from myowave.learning.parameters import identify
from myowave.learning.prediction import Network, predict_teacher_forced, to_tensors
from myowave.learning.training import train_scale
from myowave.physics.build import build_model
from myowave.physics.effects import catalogue
from myowave.settings import Identify

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


def test_the_residual_is_small_on_a_true_motion_and_grows_with_wrong_parameters(network, trials, model):
    """Noisy EMG has kinks that central differences smear, so the true residual is small beside a wrong one, not 0."""
    identified, raw = identify(model, {"f0_Bi": Identify(start_spread=0.0)}, {}, (0, 1))
    usable = torch.tensor(trials.lengths)
    loss = TeacherForcedLoss(
        network, model, identified, trials, usable, 1e-3, "sequence", Noise(0.0, (0, 1), 0), CPU
    )  # fmt: skip
    angle = torch.from_numpy(trials.angle).expand(2, -1, -1)
    before, after = angle.roll(1, -1), angle.roll(-1, -1)
    motion = angle, (after - before) / (2 * trials.dt), (after - 2 * angle + before) / trials.dt**2
    true, wrong = (
        loss._residual(identified.params(factor * raw), *motion)[..., 1:-1].square().mean() for factor in (1.0, 1.2)
    )
    assert wrong > 5 * true


def test_identified_parameters_get_a_gradient_only_through_the_residual(network, trials, model):
    identified, raw = identify(model, {"f0_Bi": Identify()}, {}, (0, 1))
    weights = {name: value.requires_grad_() for name, value in network.weights.items()}
    gradients = []
    for beta in (1e-3, 2e-3):
        raw = raw.detach().requires_grad_()
        loss = TeacherForcedLoss(
            network, model, identified, trials, torch.tensor(trials.lengths), beta, "sequence",
            Noise(0.0, (0, 1), 0), CPU,
        )  # fmt: skip
        losses = loss.backward(weights, raw)
        torch.testing.assert_close(losses.total, losses.data + beta * losses.residual)
        gradients.append(raw.grad)
    torch.testing.assert_close(gradients[1], 2 * gradients[0])


@pytest.mark.parametrize("changes", [{"cell": "rnn"}, {"output": "absolute"}, {"history_noise": 1e-4}])
def test_other_networks_train_by_rollouts_too(changes, scales, model, wanted, rollout):
    recipe = rollout.model_copy(update={"epochs": 30, "learning_rate": 0.01, "simulated_trials": 0, **changes})
    reports = list(train_scale(scales, model, recipe, wanted, level=0, total=1, seeds=(0,), device=CPU))
    first, last = (sum(r.losses.data.item() for r in part) for part in (reports[:5], reports[-5:]))
    assert last < 0.7 * first


def test_an_effect_with_a_state_is_refused_by_the_residual(settings, scales, wanted, teacher_forced):
    stateful = next(e.name for e in catalogue(()).values() if e.stateful)
    model = build_model(f"base+{stateful}", settings.physics)
    with pytest.raises(ValueError, match="state of its own"):
        next(train_scale(scales, model, teacher_forced, wanted, level=0, total=1, seeds=(0,), device=CPU))
