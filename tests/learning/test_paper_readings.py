"""The readings that the paper leaves open, each alone: what its residual is, and what learns from it."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.data.simulate import simulate_trials
from myowave.data.trials import Trials
from myowave.learning.inputs import to_tensors
from myowave.learning.methods.paper.residual import MotionResidual
from myowave.learning.methods.paper.training import PaperTraining
from myowave.learning.network import delayed
from myowave.learning.prediction import predict_free_running
from myowave.learning.streaming.predictor import Predictor
from myowave.learning.task import Task, begin_stage
from myowave.learning.training import train_scale
from myowave.learning.windows import Pieces
from myowave.settings import SimulatedDataset

CPU = torch.device("cpu")
NAMES = ("f0_Bi", "l0_Bi", "f0_Tri", "l0_Tri")


@pytest.fixture(scope="module")
def exact(model) -> Trials:
    dataset = SimulatedDataset(kind="simulated", trials=3, samples=300, emg_noise=0.2, test=("3",))
    return simulate_trials("small", dataset, model, {})[0]


def whole(trials: Trials) -> Pieces:
    count, samples = trials.angle.shape
    return Pieces(torch.arange(count), torch.zeros(count, dtype=torch.long), samples)


def along(residual: MotionResidual, trials: Trials, params, pieces: Pieces | None = None) -> torch.Tensor:
    """Along the measured angle."""
    pieces = pieces or whole(trials)
    return residual.along_sequence(params, pieces, pieces.of(torch.from_numpy(trials.angle))[None])


def least_squares(model, trials: Trials, **reading) -> np.ndarray:
    """Error [%] of the parameters with the smallest residual along the measured angle."""
    residual = MotionResidual(model, trials, NAMES, CPU, **reading)
    truth = torch.tensor([model.defaults[name] for name in NAMES], dtype=torch.float64)

    def of(factors):
        params = {name: (f * t).reshape(1, 1) for name, f, t in zip(NAMES, factors, truth, strict=True)}
        return along(residual, trials, params).flatten()

    factors = torch.ones(4, dtype=torch.float64)
    for _ in range(6):
        slope = torch.stack([(of(factors + 1e-6 * e) - of(factors)) / 1e-6 for e in torch.eye(4)], -1)
        factors = factors - torch.linalg.lstsq(slope, of(factors)).solution
    return 100 * (factors.numpy() - 1)


def test_torque_at_the_samples_of_an_exact_motion_makes_forces_weaker_and_its_mean_over_the_kernel_does_not(
    model, exact
):
    sampled, averaged = (least_squares(model, exact, averaged=a)[[0, 2]] for a in (False, True))
    assert (sampled < -2.0).all() and (np.abs(averaged) < 0.1).all()


@pytest.mark.parametrize("averaged", [False, True])
def test_the_residual_of_a_piece_is_that_of_the_whole_trial_there(averaged, model, exact):
    residual = MotionResidual(model, exact, NAMES, CPU, averaged=averaged)
    params, margin = {"f0_Bi": torch.tensor([[250.0], [350.0]])}, residual.margin
    expected = along(residual, exact, params)
    pieces = Pieces(torch.tensor([2, 0]), torch.tensor([40, 111]), 30)
    found = along(residual, exact, params, pieces)
    for i, (trial, start) in enumerate([(2, 40), (0, 111)]):
        torch.testing.assert_close(found[:, i], expected[:, trial, start : start + 30 - 2 * margin])


def test_parameters_of_the_drive_get_their_gradient_through_the_activation(model, exact):
    residual = MotionResidual(model, exact, ["delay_Bi"], CPU, averaged=True)
    delay = torch.tensor([[0.07], [0.09]], dtype=torch.float64, requires_grad=True)
    along(residual, exact, {"delay_Bi": delay}).square().mean().backward()
    assert (delay.grad[0] < 0) and (delay.grad[1] > 0), "the true delay of 0.08 s lies between"


def changed(task: Task, **changes) -> Task:
    return replace(task, recipe=task.recipe.changed({"history_noise": 0.0, **changes}))


def losses_of(task: Task, level: int = 0):
    """Losses at the start, and the gradients that the residual alone gives to weights and parameters."""
    stage = begin_stage(task, level)
    values = stage.values.clone().requires_grad_()
    found = PaperTraining(stage).backward({name: values[:, i, None] for i, name in enumerate(stage.names)})
    return found, sum(w.grad.abs().sum() for w in stage.network.weights.values()), values.grad


def test_each_residual_is_a_reading_of_its_own(teacher_forced):
    found = {r: losses_of(changed(teacher_forced, residual=r)) for r in ("time", "sequence", "averaged", "measured")}
    residuals = torch.stack([losses.residual for losses, *_ in found.values()])
    assert len({round(r, 6) for r in residuals[:, 0].tolist()}) == 4
    for losses, *_ in found.values():
        torch.testing.assert_close(losses.data, found["sequence"][0].data)


def test_along_the_measured_motion_the_residual_teaches_parameters_only(teacher_forced):
    (_, light, by_light), (_, heavy, by_heavy) = (
        losses_of(changed(teacher_forced, beta=beta, residual="measured")) for beta in (1e-3, 2e-3)
    )
    torch.testing.assert_close(heavy, light)
    torch.testing.assert_close(by_heavy, 2 * by_light)
    _, light, _ = losses_of(changed(teacher_forced, beta=1e-3))
    _, heavy, _ = losses_of(changed(teacher_forced, beta=2e-3))
    assert heavy > 1.01 * light


def test_split_teaches_the_weights_along_predictions_and_the_parameters_along_measured_motion(teacher_forced):
    averaged, measured, split = (
        losses_of(changed(teacher_forced, residual=reading)) for reading in ("averaged", "measured", "split")
    )
    torch.testing.assert_close(split[1], averaged[1])  # gradients of the weights
    torch.testing.assert_close(split[2], measured[2])  # and of the parameters
    assert not torch.allclose(averaged[2], measured[2])


def test_mini_batches_are_many_steps_that_never_see_what_validates(teacher_forced):
    task = changed(teacher_forced, batches=4, validation_fraction=0.25)
    stage = begin_stage(task, 0)
    loss, seen = PaperTraining(stage), set()
    for _ in range(60):
        pieces = loss._pieces()
        seen |= {
            (int(t), int(s) + i) for t, s in zip(pieces.trial, pieces.start, strict=True) for i in range(pieces.length)
        }
    assert max(sample for _, sample in seen) < 150
    assert len(seen) > 0.98 * 2 * 150
    one, many = (list(train_scale(changed(task, batches=b, epochs=5), 0))[-1] for b in (1, 4))
    assert (many.losses.data < one.losses.data).all()


def test_a_delayed_input_is_the_excitation_of_eq_1(teacher_forced, trials):
    emg = torch.arange(10.0, dtype=torch.float64)[:, None].repeat(1, 2)
    torch.testing.assert_close(delayed(emg, [0.0, 2.5])[:, 1], (emg[:, 1] - 2.5).clamp(min=0.0))
    torch.testing.assert_close(delayed(emg, [0.0, 2.5])[:, 0], emg[:, 0])
    network = begin_stage(changed(teacher_forced, emg_input="delayed"), 0).network
    assert network.architecture.delays == (0.08, 0.08)


def test_a_stream_of_emg_is_delayed_as_a_trial_is(teacher_forced, trials, tmp_path):
    task = changed(teacher_forced, emg_input="delayed", epochs=2)
    *_, last = train_scale(task, 0)
    last.checkpoint.save(tmp_path / "scale-0.pt")
    checkpoint = type(last.checkpoint).load(tmp_path / "scale-0.pt")
    emg, angle = to_tensors(trials.select(trials.test), CPU)
    expected = predict_free_running(checkpoint.network, emg, angle, trials.dt)[:, 0, :40]
    predictor = Predictor(checkpoint)
    samples = zip(emg[0, :40].tolist(), angle[0, :40].tolist(), strict=True)
    found = np.stack([predictor.step(sample, angle=given) for sample, given in samples], -1)
    np.testing.assert_allclose(found, expected.numpy(), atol=1e-9)
