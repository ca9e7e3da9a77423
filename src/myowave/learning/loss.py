"""The loss of an epoch and its gradients.

`RolloutLoss`: mean square error of windows fed by the network's own predictions, measured and simulated.
`TeacherForcedLoss`: J = J_data + beta J_res, Eqs. 16-18 and 38.

Losses are kept apart by seed, so that a seed trains the same alone or among others.

Shapes: S seeds, T trials, N samples, B windows, K samples of a window.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.identification.weak_form import hidden_effects
from myowave.learning.network import differentiate_cell
from myowave.learning.prediction import Network, follow, predict_teacher_forced
from myowave.learning.rollout import Workspace, roll_out, roll_out_gru
from myowave.learning.windows import Corpus, count_windows
from myowave.physics.drive import channels_of
from myowave.physics.model import Model, torques
from myowave.physics.simulation import Simulation


@dataclass(frozen=True)
class Losses:
    """Loss of each seed and its parts, (S,) each: `data` [rad^2], `residual` [(N m)^2], weights not in them."""

    total: Tensor
    data: Tensor
    residual: Tensor


class Noise:
    """Noise on the history, from a generator for each seed."""

    def __init__(self, std: float, seeds: Sequence[int], level: int) -> None:
        self.std = std
        self._random = [torch.Generator().manual_seed(seed * 100 + level) for seed in seeds]

    def draw(self, *shape: int, like: Tensor) -> Tensor:
        """(S, *shape) [rad]."""
        noise = torch.stack([torch.randn(*shape, generator=random) for random in self._random])
        return (self.std * noise).to(like)


class RolloutLoss:
    """Windows of the training trials, and of simulated ones once there are any, predicted from their history."""

    def __init__(self, network: Network, corpus: Corpus, steps: int, noise: Noise, random: torch.Generator) -> None:
        longest = int(corpus.usable.max()) - network.history
        self._network, self._corpus, self._noise, self._random = network, corpus, noise, random
        self._length = network.history + min(steps, longest)
        self._count = count_windows(corpus.usable, self._length - network.history)
        self._simulated: Corpus | None = None
        self._usable = torch.zeros(0)
        self.trust = torch.ones(())  # weight of a simulated window beside a measured one, () or (S,)
        self._workspace = Workspace()

    def add_simulated(self, corpus: Corpus, usable: Tensor) -> None:
        """Train on simulated trials, too; `usable` (S, T) says which of them count."""
        self._simulated, self._usable = corpus, usable

    def backward(self, weights: Mapping[str, Tensor], params: Mapping[str, Tensor]) -> Losses:
        """Losses of one epoch; leaves gradients in the weights. `params` are not used: no physics is in this loss."""
        simulated = self._count // 2 if self._simulated is not None else 0
        x, z, v = self._draw(self._corpus, self._count - simulated)
        weight = z.new_ones(z.shape[0], self._count - simulated)
        if simulated:
            trial, start = self._simulated.draw(simulated, self._length, self._random)
            parts = self._simulated.cut(trial, start, self._length)
            x = torch.cat([x, parts[0]])
            z, v = (torch.cat(pair, dim=1) for pair in ((z, parts[1]), (v, parts[2])))
            weight = torch.cat([weight, self.trust.unsqueeze(-1) * self._usable[:, trial]], dim=-1).to(z)
        m = self._network.history
        target = z[..., m:]
        z, v = self._add_noise(z[..., :m], v[..., :m])
        steps = target.shape[-1]
        weight = (weight / (weight.sum(-1, keepdim=True) * steps)).unsqueeze(-1)
        loss = self._gradients(weights, x, z.contiguous(), v.contiguous(), target, weight)
        data = loss * self._network.scaling.angle_std**2
        return Losses(data, data, torch.zeros_like(data))

    def _draw(self, corpus: Corpus, count: int) -> tuple[Tensor, Tensor, Tensor]:
        trial, start = corpus.draw(count, self._length, self._random)
        x, z, v = corpus.cut(trial, start, self._length)
        seeds = self._network.weights["hidden"].shape[0]
        return x, z.expand(seeds, -1, -1), v.expand(seeds, -1, -1)

    def _add_noise(self, z: Tensor, v: Tensor) -> tuple[Tensor, Tensor]:
        if self._noise.std == 0:
            return z, v
        scaling = self._network.scaling
        noise = self._noise.draw(z.shape[1], z.shape[2] + 1, like=z)
        return z + noise[..., 1:] / scaling.angle_std, v + torch.diff(noise, dim=-1) / scaling.step_std

    def _gradients(
        self, weights: Mapping[str, Tensor], x: Tensor, z: Tensor, v: Tensor, target: Tensor, weight: Tensor
    ) -> Tensor:
        architecture, units = self._network.architecture, self._network.units
        for value in weights.values():
            value.grad = None
        if architecture.cell == "gru" and architecture.increments:
            predicted = roll_out_gru(units, weights, x, z, v, self._workspace)
        else:
            predicted = roll_out(architecture, units, weights, x, z, v)
        loss = (weight * (predicted - target).square()).sum((1, 2))
        loss.sum().backward()
        return loss.detach()


class TeacherForcedLoss:
    """One-step predictions of the training trials, and the residual of the equation of motion along them.

    Args:
        usable: samples of each trial to train on, (T,).
        derivative: `sequence` differentiates the predicted sequence by central differences; `time` the network by its
            input t_n, holding EMG and history fixed.

    Raises:
        ValueError: for a model with effects that the residual cannot hold.
    """

    def __init__(
        self,
        network: Network,
        model: Model,
        trials: Trials,
        usable: Tensor,
        beta: float,
        derivative: str,
        noise: Noise,
        device: torch.device,
    ) -> None:
        if beta and (hidden := hidden_effects(model)):
            raise ValueError(
                f"model {model.name}: the residual of Eq. 38 cannot hold {', '.join(hidden)}, which has a state of its "
                "own or acts on the measured angle. Train with identification: gauss_newton, or leave the effect out."
            )
        self._network, self._model = network, model
        self._beta, self._derivative, self._noise, self._dt = beta, derivative, noise, trials.dt
        emg = torch.from_numpy(trials.emg).to(device)
        self._x, self._angle = network.encode(emg, trials.dt), torch.from_numpy(trials.angle).to(device)
        self._emg = channels_of(model, trials.channels, emg)
        self._known = {n: torch.from_numpy(v).to(device) for n, v in trials.known(model.defaults).items()}
        sample = torch.arange(trials.angle.shape[1], device=device)
        first = max(network.history, network.architecture.features)
        self._counts = (sample < usable.unsqueeze(-1).to(device)) & (sample >= first)
        inner = self._counts.clone()  # where the sample before and after are predicted as well
        inner[:, 1:] &= self._counts[:, :-1]
        inner[:, :-1] &= self._counts[:, 1:]
        inner[:, -1] = False
        self._inner = inner

    def backward(self, weights: Mapping[str, Tensor], params: Mapping[str, Tensor]) -> Losses:
        """Losses of one epoch; leaves gradients in the weights, and adds them to what the parameters come from.

        Args:
            params: physical parameters by name, (S, 1) each.
        """
        for value in weights.values():
            value.grad = None
        angle = self._angle
        if self._noise.std:
            angle = angle + self._noise.draw(*self._angle.shape, like=self._angle)
        if self._derivative == "time":
            q, qdot, qddot = predict_with_time_derivatives(self._network, self._x, angle)
            counts = self._counts
        else:
            q = predict_teacher_forced(self._network, self._x, angle)
            before, after = q.roll(1, -1), q.roll(-1, -1)
            qdot, qddot = (after - before) / (2 * self._dt), (after - 2 * q + before) / self._dt**2
            counts = self._inner
        data = ((q - self._angle).square() * self._counts).sum((1, 2)) / self._counts.sum()
        residual = torch.zeros_like(data)
        if self._beta:
            misfit = self._residual(params, q, qdot, qddot)
            residual = (misfit.square() * counts).sum((1, 2)) / counts.sum()
        total = data + self._beta * residual
        total.sum().backward()
        return Losses(total.detach(), data.detach(), residual.detach())

    def _residual(self, params: Mapping[str, Tensor], q: Tensor, qdot: Tensor, qddot: Tensor) -> Tensor:
        """I qddot - E - T^MT - (torques of effects) at every sample [N m], (S, T, N), Eq. 38."""
        simulation = Simulation(self._model, {**self._known, **params}, self._emg, self._dt)
        sample = torch.arange(q.shape[-1], dtype=q.dtype, device=q.device)
        _, activation = simulation.activate(sample[:, None, None])
        result = torques(simulation.along_time, q, qdot, activation.squeeze(-2), {})
        return result.inertia * qddot - result.total


def predict_with_time_derivatives(network: Network, x: Tensor, angle: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Teacher-forced prediction and its first two derivatives by the input t_n, (S, T, N) each [rad, rad/s, rad/s^2].

    Only the current cell sees t_n: EMG and history are held fixed, so this is not the derivative of the motion. The
    first samples are those given, with derivatives 0.
    """
    assert network.architecture.time_input and not network.architecture.increments
    weights = network.weights
    angle = angle.expand(weights["hidden"].shape[0], *angle.shape[-2:])
    driven, states = follow(network, x, angle)
    count = states.shape[2]
    current = driven[:, :, -count:].flatten(1, 2)
    slope = weights["input"][:, -1:]  # of `driven` by t_n, the last input
    cells = differentiate_cell(network.architecture.cell, weights, states.flatten(1, 2), current, slope)
    value, first, second = (torch.bmm(cell, weights["output"]).unflatten(1, (-1, count)).squeeze(-1) for cell in cells)
    value = network.to_rad(value + weights["output_bias"])
    scaling = network.scaling
    given = angle[..., :-count]
    return tuple(
        torch.cat(pair, dim=-1)
        for pair in (
            (given, value),
            (torch.zeros_like(given), first.double() * scaling.angle_std / scaling.duration),
            (torch.zeros_like(given), second.double() * scaling.angle_std / scaling.duration**2),
        )
    )
