"""The loss as the paper prints it, J = J_data + beta J_res (Eqs. 16-18 and 38), on one-step predictions.

Shapes: S seeds, T trials, N samples.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.identification.weak_form import effects_unseen_by_angle
from myowave.learning.loss import Losses, Noise
from myowave.learning.paper.derivatives import predict_with_time_derivatives
from myowave.learning.paper.windowed import first_predicted, predict_teacher_forced
from myowave.learning.task import Stage
from myowave.physics.drive import channels_of
from myowave.physics.dynamics import torques
from myowave.physics.model import Model
from myowave.physics.simulation import Simulation


@dataclass(frozen=True)
class Residual:
    """What is left of the equation of motion along a motion with the EMG of some trials.

    Args:
        emg: of the model's channels, see `physics.drive.channels_of`.
        known: parameters that are known of each trial.
        dt: sampling interval [s].
    """

    model: Model
    emg: Tensor
    known: Mapping[str, Tensor]
    dt: float

    @classmethod
    def of(cls, model: Model, trials: Trials, device: torch.device) -> "Residual":
        """For these trials.

        Raises:
            ValueError: for a model with effects that the residual cannot hold.
        """
        if unseen := effects_unseen_by_angle(model):
            raise ValueError(
                f"model {model.name}: the residual of Eq. 38 cannot hold {', '.join(unseen)}, which has a state of its "
                "own or acts on the measured angle. Train with identification: gauss_newton, or leave the effect out."
            )
        emg = channels_of(model, trials.channels, torch.from_numpy(trials.emg).to(device))
        known = {name: torch.from_numpy(value).to(device) for name, value in trials.known(model.defaults).items()}
        return cls(model, emg, known, trials.dt)

    def along(self, params: Mapping[str, Tensor], q: Tensor, qdot: Tensor, qddot: Tensor) -> Tensor:
        """I qddot - E - T^MT - (torques of effects) at every sample [N m], (S, T, N), Eq. 38.

        Args:
            params: identified parameters, (S, 1) each, SI units.
            q, qdot, qddot: the motion, (S, T, N) [rad, rad/s, rad/s^2].
        """
        params = {name: value.to(self.emg.device) for name, value in params.items()}
        simulation = Simulation(self.model, {**self.known, **params}, self.emg, self.dt)
        sample = torch.arange(q.shape[-1], dtype=q.dtype, device=q.device)
        _, activation = simulation.activate(sample[:, None, None])
        result = torques(simulation.along_time, q, qdot, activation.squeeze(-2), {})
        return result.inertia * qddot - result.total


class PaperLoss:
    """One-step predictions of the training trials, and the residual along them.

    Raises:
        ValueError: for a model with effects that the residual cannot hold.
    """

    def __init__(self, stage: Stage) -> None:
        recipe, trials, device = stage.task.recipe, stage.trials, stage.task.device
        self._network, self._x = stage.network, stage.corpus.x
        self._angle = torch.from_numpy(trials.angle).to(device)
        self._beta, self._derivative, self._dt = recipe.beta, recipe.derivative, trials.dt
        self._residual = Residual.of(stage.task.model, trials, device) if recipe.beta else None
        self._noise = Noise(recipe.history_noise, stage.task.seeds, stage.level)
        sample = torch.arange(trials.angle.shape[1], device=device)
        usable = stage.corpus.usable.unsqueeze(-1)
        self._predicted = (sample < usable) & (sample >= first_predicted(stage.network))

    def backward(self, params: Mapping[str, Tensor]) -> Losses:
        """Losses of one epoch; adds gradients to those of the weights and of what `params`, (S, 1) each, come from."""
        angle = self._angle
        if self._noise.std:
            angle = angle + self._noise.draw(*angle.shape, like=angle)
        q, qdot, qddot, counts = self._predict(angle)
        data = _mean((q - self._angle).square(), self._predicted)
        residual = torch.zeros_like(data)
        if self._residual is not None:
            residual = _mean(self._residual.along(params, q, qdot, qddot).square(), counts)
        total = data + self._beta * residual
        total.sum().backward()
        return Losses(total.detach(), data.detach(), residual.detach())

    def _predict(self, angle: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Motion predicted after a history of these angles, (S, T, N) each, and where its residual counts, (T, N)."""
        if self._derivative == "time":
            return *predict_with_time_derivatives(self._network, self._x, angle), self._predicted
        q = predict_teacher_forced(self._network, self._x, angle)
        before, after = q.roll(1, -1), q.roll(-1, -1)
        qdot, qddot = (after - before) / (2 * self._dt), (after - 2 * q + before) / self._dt**2
        return q, qdot, qddot, _inner(self._predicted)


def _mean(values: Tensor, counts: Tensor) -> Tensor:
    """Mean (S,) of values (S, T, N) where they count, (T, N)."""
    return (values * counts).sum((1, 2)) / counts.sum()


def _inner(counts: Tensor) -> Tensor:
    """Samples (T, N) that count, and whose neighbours before and after do."""
    inner = counts.clone()
    inner[:, 1:] &= counts[:, :-1]
    inner[:, :-1] &= counts[:, 1:]
    inner[:, -1] = False
    return inner
