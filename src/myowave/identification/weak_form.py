"""The equation of motion in weak form along the measured motion, and Gauss-Newton steps on it.

With test functions w that vanish with their first derivatives at both ends, the residual

    r_k = int w_k'' q - w_k (torque / inertia) dt

holds no derivative of q beyond the velocity that muscles need: second differences, which amplify every error, do not
appear. Between samples q is a quintic spline and EMG is what the simulator takes it to be; a sample step is cut where
the delayed EMG has its kinks, and each piece is integrated by Gauss-Legendre points. The residual of an exact motion is
then small enough to identify parameters to 0.02 %.

The steps converge from any start, but they take the measured angle for the true one and cannot follow states that no
angle shows; `output_error` does, from near by.

Shapes: ... copies of the parameters, B starts of the search, T trials, N samples, D points in a sample step, K test
functions, P free parameters.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from torch import Tensor

from myowave.identification.free_parameters import Free, bind_values, moved, scales
from myowave.identification.least_squares import bounded_step
from myowave.identification.record import Record
from myowave.physics.drive import breakpoints
from myowave.physics.dynamics import acceleration
from myowave.physics.model import Model

Array = NDArray[np.float64]

HALF_WIDTH_S = 0.5  # of a test function [s]
STRIDE = 4  # test functions stand a quarter of their half width apart
GAUSS_POINTS = 2  # in each piece between kinks
NUDGE = 1e-5  # in units of the scales, for differences
DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-9, 1e6


@dataclass(frozen=True)
class WeakForm:
    """Trials as smooth motions, and the weak residual of a model along them.

    Args:
        points: where in a sample step the residual is evaluated, fractions of it, (D,); their `weights` in s.
        q, qdot: angle and velocity there [rad, rad/s], (T, N - 1, D).
    """

    model: Model
    record: Record
    points: Tensor
    weights: Tensor
    q: Tensor
    qdot: Tensor

    @classmethod
    def of(cls, model: Model, record: Record) -> "WeakForm":
        """Along the measured angle of all trials given; the model must have no `effects_unseen_by_angle`."""
        assert not effects_unseen_by_angle(model), model.name
        points, weights = between_kinks(breakpoints(record.simulation(model, {}).valued, record.dt, 1), record.dt)
        steps = record.angle.shape[1] - 1
        q, qdot = np.empty((2, len(record.names), steps, len(points)))
        for trial, length in enumerate(record.lengths):
            time = np.arange(length, dtype=np.float64)
            spline = make_interp_spline(time, record.angle[trial, :length], k=5)
            fine = time[:-1, None] + points.numpy()
            for target, order in ((q, 0), (qdot, 1)):
                target[trial, : length - 1] = spline(fine, order) / record.dt**order
                target[trial, length - 1 :] = target[trial, length - 2]
        return cls(model, record, points, weights, torch.from_numpy(q), torch.from_numpy(qdot))

    @property
    def half_width(self) -> int:
        """Half width of a test function in samples."""
        return int(np.clip(round(HALF_WIDTH_S / self.record.dt), 8, (self.record.lengths.min() - 1) // 2))

    def project(self, density: Tensor, order: int) -> Tensor:
        """Integral of test functions, differentiated `order` times, against (..., T, N - 1, D): (..., T, K)."""
        w, step, dt = self.half_width, max(1, self.half_width // STRIDE), self.record.dt
        s = ((torch.arange(-w, w)[:, None] + self.points) / w).double()  # (2 w, D)
        bump = (1 - s**2) ** 3 if order == 0 else (-6 * (1 - s**2) ** 2 + 24 * s**2 * (1 - s**2)) / (w * dt) ** 2
        kernel = (bump * self.weights).flatten()
        d = len(self.points)
        return density.flatten(-2).unfold(-1, 2 * w * d, step * d) @ kernel

    @property
    def inside(self) -> Tensor:
        """Which test functions lie within the recorded part, (T, K)."""
        w, step = self.half_width, max(1, self.half_width // STRIDE)
        ends = torch.arange(0, self.record.angle.shape[1] - 2 * w, step) + 2 * w
        return ends < torch.from_numpy(self.record.lengths)[:, None]

    def residual(self, free: Sequence[Free], values: Array) -> Array:
        """Weak residual [rad] of free parameters (..., P), all trials in one row: (..., T K)."""
        simulation = self.record.simulation(self.model, bind_values(free, values))
        start = torch.arange(self.record.angle.shape[1] - 1, dtype=torch.float64)
        position = start[:, None, None] + self.points[:, None]
        _, activation = simulation.activate(position)
        valued = simulation.valued.along(2).leaning(simulation.sway_at(position))
        qddot = acceleration(valued, self.q, self.qdot, activation, {})
        residual = self.project(self.q, 2) - self.project(qddot, 0)
        return (residual * self.inside).flatten(-2).numpy()

    def linearise(self, free: Sequence[Free], values: Array) -> tuple[Array, Array]:
        """Residual (B, n) and its derivatives (B, n, P) by the parameters (B, P) in units of their scales."""
        bumps = np.concatenate([np.zeros((1, len(free))), NUDGE * np.diag(scales(free))])
        residual = self.residual(free, values + bumps[:, None])
        return residual[0], np.moveaxis((residual[1:] - residual[0]) / NUDGE, 0, -1)

    def step(self, free: Sequence[Free], values: Array, damping: Array) -> tuple[Array, Array]:
        """One damped Gauss-Newton step, taken where it lowers the residual.

        Args:
            values: (B, P).
            damping: (B,), relative to the diagonal of the normal matrix.

        Returns:
            New values and damping.
        """
        residual, slope = self.linearise(free, values)
        transposed = np.swapaxes(slope, -1, -2)
        vector = -(transposed @ residual[..., None])[..., 0]
        proposed = moved(free, values, bounded_step(transposed @ slope, vector, free, values, damping))
        better = (self.residual(free, proposed) ** 2).sum(-1) < (residual**2).sum(-1)
        damping = np.where(better, damping / 10, damping * 10).clip(LEAST_DAMPING, MOST_DAMPING)
        return np.where(better[:, None], proposed, values), damping


def effects_unseen_by_angle(model: Model) -> list[str]:
    """Effects that a measured angle does not determine, so that no residual along it holds them."""
    return [effect.name for effect in model.effects if effect.stateful or effect.acts_on == "observation"]


def between_kinks(split: Tensor, dt: float) -> tuple[Tensor, Tensor]:
    """Gauss-Legendre points (D,) in units of a sample and weights [s] between the kinks of the EMG."""
    split = split.reshape(-1, split.shape[-1])
    # ASSUME: kinks are cut out only where all trials have them at the same place; else finer pieces do.
    edges = split[0].numpy() if bool((split == split[0]).all()) else np.linspace(0, 1, 5)
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    width = np.diff(edges)[:, None]
    points = edges[:-1, None] + width * (nodes + 1) / 2
    return torch.from_numpy(points.ravel()), torch.from_numpy((width * weights / 2 * dt).ravel())
