"""What is left of the equation of motion along a motion, Eq. 38, in the readings that the paper leaves open.

At the samples the torque is that of the instant; `averaged` is the mean over the kernel of the second difference. For
any motion (q_(n+1) - 2 q_n + q_(n-1)) / dt^2 is the mean of qddot over the triangle that falls from sample n to its
neighbours, so only that mean of the torque balances it where EMG is not smooth.

Shapes: S seeds, T trials, N samples, B pieces of trials, K samples of a piece, D points between two samples, M muscles.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.identification.torque import effects_unseen_by_angle
from myowave.identification.windows import between_kinks
from myowave.learning.windows import Pieces
from myowave.physics.dynamics import Torques, torques
from myowave.physics.model import Model
from myowave.physics.simulation import Simulation, channels_of
from myowave.physics.valued import Valued, along, give_values

STENCIL = 4  # samples that a motion between two of them follows from


class MotionResidual:
    """The equation of motion along pieces of some trials, `averaged` where the torque is a mean between samples. A
    ValueError for a model with effects that it cannot hold."""

    def __init__(
        self, model: Model, trials: Trials, names: Sequence[str], device: torch.device, *, averaged: bool = False
    ) -> None:
        if unseen := effects_unseen_by_angle(model):
            raise ValueError(
                f"model {model.name}: the residual of Eq. 38 cannot hold {', '.join(unseen)}, which has a state of its "
                "own or acts on the measured angle. Train by rollouts, or leave the effect out."
            )
        self._model, self._dt = model, trials.dt
        self._emg = channels_of(model, trials.channels, torch.from_numpy(trials.emg).to(device))
        self._known = {name: torch.from_numpy(value).to(device) for name, value in trials.known(model.defaults).items()}
        # Where between two samples the torque is taken, fractions of dt (D,), and how much it counts there.
        points, weights = torch.zeros(1), torch.ones(1)
        if averaged:
            points, weights = between_kinks(Simulation(model, self._known, self._emg, trials.dt).breakpoints)
        self._points, self._weights = points.to(self._emg), weights.to(self._emg)
        self._recorded = None if any(model.drives(name) for name in names) else self._activate({})

    @property
    def margin(self) -> int:
        """Samples at either end of a piece without a residual along a sequence."""
        return STENCIL // 2 if len(self._points) > 1 else 1

    def along(self, params: Mapping[str, Tensor], pieces: Pieces, q: Tensor, qdot: Tensor, qddot: Tensor) -> Tensor:
        """I qddot - E - T^MT - (torques of effects) at every sample [N m], (S, B, K), Eq. 38, with identified
        parameters (S, 1), SI units, along a motion (S, B, K) [rad, rad/s, rad/s^2]."""
        activation = self._activation(params, pieces)[..., 0, :]
        result = torques(self._valued(params, pieces, 1), q, qdot, activation, {})
        return result.inertia * qddot - result.total

    def along_sequence(self, params: Mapping[str, Tensor], pieces: Pieces, q: Tensor) -> Tensor:
        """The same along sequences of angles q (S, B, K) [rad], accelerations from their second differences; without
        `margin` samples at either end, (S, B, K - 2 margin)."""
        bend = (q[..., 2:] - 2 * q[..., 1:-1] + q[..., :-2]) / self._dt**2
        if self.margin == 1:
            inner = Pieces(pieces.trial, pieces.start + 1, pieces.length - 2)
            return self.along(params, inner, q[..., 1:-1], (q[..., 2:] - q[..., :-2]) / (2 * self._dt), bend)
        result = self._between(params, pieces, q)
        share = self._weights * self._points  # of what comes before a sample; of what comes after, the rest
        before, after = result.total[..., :-1, :], result.total[..., 1:, :]
        mean = (before * share).sum(-1) + (after * (self._weights - share)).sum(-1)
        # ASSUME: the moment of inertia hardly changes within two samples.
        inertia = (result.inertia + torch.zeros_like(result.total))[..., 1:, 0]
        cut = self.margin - 1
        return inertia * bend[..., cut:-cut] - mean

    def _between(self, params: Mapping[str, Tensor], pieces: Pieces, q: Tensor) -> Torques:
        """Torques (S, B, K - STENCIL + 1, D) at the points between samples of a sequence."""
        value, slope = (torch.from_numpy(w).to(q) for w in _interpolation(self._points.cpu().numpy()))
        nodes = q.unfold(-1, STENCIL, 1)
        inner = Pieces(pieces.trial, pieces.start + STENCIL // 2 - 1, pieces.length - STENCIL + 1)
        activation = self._activation(params, inner)
        valued = self._valued(params, inner, 2)
        return torques(valued, nodes @ value, nodes @ slope / self._dt, activation, {})

    def _valued(self, params: Mapping[str, Tensor], pieces: Pieces, axes: int) -> Valued:
        """The model, for quantities with so many axes behind the pieces."""
        known = {name: value[pieces.trial] for name, value in self._known.items()}
        return give_values(self._model, along({**known, **params}, axes, self._emg), self._emg)

    def _activation(self, params: Mapping[str, Tensor], pieces: Pieces) -> Tensor:
        """Activation (B, K, D, M) or (S, B, K, D, M) at the points after each sample."""
        return pieces.of(self._activate(params), seeds=True) if self._recorded is None else pieces.of(self._recorded)

    def _activate(self, params: Mapping[str, Tensor]) -> Tensor:
        sample = torch.arange(self._emg.shape[-2], dtype=self._emg.dtype, device=self._emg.device)
        simulation = Simulation(self._model, {**self._known, **params}, self._emg, self._dt)
        return simulation.activate(sample[:, None, None] + self._points[:, None])[1]


def _interpolation(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights (STENCIL, D) of the samples around a step for the value and the slope (by samples) at points within."""
    nodes = np.arange(STENCIL) - (STENCIL // 2 - 1)
    powers = np.arange(STENCIL)
    to_nodes = np.linalg.inv(nodes[:, None].astype(float) ** powers)  # from values at the nodes to coefficients
    value = points[:, None] ** powers
    slope = np.where(powers > 0, powers * points[:, None] ** np.maximum(powers - 1, 0), 0.0)
    return (value @ to_nodes).T, (slope @ to_nodes).T
