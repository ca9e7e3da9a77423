"""The residual of the paper's loss: its derivatives, and that it vanishes on a true motion."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.data.wavelets import decompose
from myowave.learning.loss import Noise, RolloutLoss, TeacherForcedLoss, predict_with_time_derivatives
from myowave.learning.network import Architecture, Scaling, apply_cell, initialise
from myowave.learning.parameters import identify
from myowave.learning.prediction import Network, predict_teacher_forced, to_tensors
from myowave.learning.training import train_scale
from myowave.learning.windows import Corpus
from myowave.physics.build import build_model
from myowave.physics.effects import catalogue
from myowave.physics.model import bind, torques
from myowave.physics.motion import drive_muscles
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


def test_the_residual_is_small_along_a_true_motion_and_grows_with_wrong_parameters(network, trials, model, monkeypatch):
    """Noisy EMG has kinks that central differences smear, so the true residual is small beside a wrong one, not 0."""
    monkeypatch.setattr(
        "myowave.learning.loss.predict_teacher_forced", lambda network, x, angle: angle.expand(2, -1, -1)
    )
    identified, raw = identify(model, {"f0_Bi": Identify(start_spread=0.0)}, {}, (0, 1))
    loss = teacher_forced_loss(network, trials, model, identified)
    true, wrong = (
        loss.backward(network.weights, (factor * raw).requires_grad_()).residual.max() for factor in (1.0, 1.2)
    )
    assert wrong > 5 * true


@pytest.mark.parametrize("derivative", ["sequence", "time"])
def test_what_validates_is_in_no_loss(derivative, network, trials, model):
    identified, raw = identify(model, {"f0_Bi": Identify()}, {}, (0, 1))
    usable = 150
    moved = replace(trials, angle=trials.angle.copy(), emg=trials.emg.copy())
    moved.angle[:, usable:] += 0.5
    moved.emg[:, usable:] = 0.9
    losses = [
        teacher_forced_loss(network, each, model, identified, derivative=derivative, usable=usable).backward(
            {name: value.requires_grad_() for name, value in network.weights.items()}, raw.clone().requires_grad_()
        )
        for each in (trials, moved)
    ]
    torch.testing.assert_close(losses[0].data, losses[1].data)
    torch.testing.assert_close(losses[0].residual, losses[1].residual)


def teacher_forced_loss(
    network, trials, model, identified, *, beta=1e-3, derivative="sequence", usable=None, noise=0.0
):
    """The loss on all samples or the first `usable`."""
    lengths = torch.tensor(trials.lengths if usable is None else [usable] * len(trials.lengths))
    return TeacherForcedLoss(
        network, model, identified, trials, lengths, beta, derivative, Noise(noise, (0, 1), 0), CPU
    )  # fmt: skip


def test_identified_parameters_get_a_gradient_only_through_the_residual(network, trials, model):
    identified, raw = identify(model, {"f0_Bi": Identify()}, {}, (0, 1))
    weights = {name: value.requires_grad_() for name, value in network.weights.items()}
    gradients = []
    for beta in (1e-3, 2e-3):
        raw = raw.detach().requires_grad_()
        loss = teacher_forced_loss(network, trials, model, identified, beta=beta)
        losses = loss.backward(weights, raw)
        torch.testing.assert_close(losses.total, losses.data + beta * losses.residual)
        gradients.append(raw.grad)
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


@pytest.fixture
def rolled(trials):
    """What makes a rollout loss of networks whose output weights are 0, {increments: make(noise)}."""
    seeds, steps, history = range(20), 4, 3

    def make(noise, increments):
        architecture = Architecture("gru", 6, 2, increments=increments, time_input=False)
        weights = initialise(architecture, seeds, CPU)
        weights = {n: torch.zeros_like(w) if "output" in n else w for n, w in weights.items()}
        weights = {n: w.requires_grad_() for n, w in weights.items()}
        network = Network(architecture, Scaling.of(trials), weights, carried=True, history=history)
        emg, angle = to_tensors(trials, CPU)
        corpus = Corpus.of(architecture, network.scaling, emg, angle[None], trials.dt, torch.tensor(trials.lengths))
        random = torch.Generator().manual_seed(1)  # the same windows every time
        loss = RolloutLoss(network, corpus, steps, Noise(noise, seeds, 0), random)
        return loss.backward(weights, torch.zeros(())).data

    return make


def test_noise_on_the_history_of_a_rollout_moves_its_last_angle_and_its_last_step(rolled):
    """Without output an increment network goes straight on: errors n, n' of the last two angles become n + k (n - n')
    after k steps, with variance s^2 ((1 + k)^2 + k^2)."""
    noise = 0.2
    expected = noise**2 * sum((1 + k) ** 2 + k**2 for k in (1, 2, 3, 4)) / 4
    gained = rolled(noise, increments=True) - rolled(0.0, increments=True)
    assert gained.mean().item() == pytest.approx(expected, rel=0.1)
    assert gained.std() > 0, "each seed has noise of its own"


def test_noise_on_the_history_is_not_on_the_target_of_a_rollout(rolled):
    """Without output an absolute network predicts the mean angle whatever its history was."""
    torch.testing.assert_close(rolled(0.2, increments=False), rolled(0.0, increments=False))


def test_noise_on_the_history_of_one_step_is_not_on_the_target(network, trials, model):
    """J_data of predictions from noisy angles against measured ones, by hand."""
    identified, raw = identify(model, {"f0_Bi": Identify()}, {}, (0, 1))
    emg, angle = to_tensors(trials, CPU)
    noisy = angle + Noise(0.3, (0, 1), 0).draw(*angle.shape, like=angle)
    x = network.encode(emg, trials.dt)
    expected, without = (
        (predict_teacher_forced(network, x, seen) - angle)[..., network.history :].square().mean((1, 2))
        for seen in (noisy, angle)
    )
    weights = {name: value.requires_grad_() for name, value in network.weights.items()}
    loss = teacher_forced_loss(network, trials, model, identified, noise=0.3)
    found = loss.backward(weights, raw.clone().requires_grad_())
    torch.testing.assert_close(found.data, expected.detach())
    assert (found.data / without - 1).abs().min() > 1e-3


def test_noise_has_its_size_and_differs_between_seeds_scales_and_epochs():
    like = torch.zeros((), dtype=torch.float64)
    noise = Noise(0.1, (3, 5), 1)
    first, second = (noise.draw(4000, like=like) for _ in range(2))
    alone, coarser = (Noise(0.1, (5,), level).draw(4000, like=like) for level in (1, 2))
    assert first.std(1).tolist() == pytest.approx([0.1, 0.1], rel=0.05)
    torch.testing.assert_close(alone[0], first[1], rtol=0, atol=0)
    rows = torch.stack([first[0], first[1], second[0], second[1], coarser[0]])
    assert (torch.corrcoef(rows) - torch.eye(5)).abs().max() < 0.1


def test_the_residual_is_eq_38_of_the_predicted_motion(network, trials, model):
    """I qddot - E - T with central differences of the predictions and the activations at the samples, by hand."""
    identified, raw = identify(model, {"f0_Bi": Identify()}, {}, (0, 1))
    trials = decompose(trials, 4)[4]  # slow, or q would be all acceleration
    lively = {name: 4 * value for name, value in network.weights.items()}  # or it would hardly move
    network = replace(network, weights=lively)
    emg, angle = to_tensors(trials, CPU)
    with torch.no_grad():
        q = predict_teacher_forced(network, network.encode(emg, trials.dt), angle).numpy()
    qdot, qddot = np.gradient(q, trials.dt, axis=-1), np.diff(q, 2, axis=-1) / trials.dt**2
    q, qdot = (torch.from_numpy(x[..., 1:-1]) for x in (q, qdot))
    bound = bind(model, identified.params(raw), emg)
    activation = drive_muscles(bound, emg, trials.dt).activation[..., 1:, 0, :]  # at the beginning of each step
    torque = torques(bound.along(1), q, qdot, activation, {})
    residual = (torque.inertia * torch.from_numpy(qddot) - torque.total)[..., network.history :]
    weights = {name: value.requires_grad_() for name, value in lively.items()}
    loss = teacher_forced_loss(network, trials, model, identified).backward(weights, raw.clone().requires_grad_())
    torch.testing.assert_close(loss.residual, residual.square().mean((1, 2)), rtol=1e-4, atol=0)
    slow = torques(bound.along(1), q, 0.5 * qdot, activation, {})
    assert ((slow.total - torque.total).square().mean() / residual.square().mean()) > 1e-3, "speed does not matter"
