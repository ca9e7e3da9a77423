"""The equation of motion in weak form along a known sequence, and Gauss-Newton steps on it.

With test functions w that vanish with their first derivatives at both ends, the residual

    r_k = int w_k'' q - w_k (torque / inertia) dt

holds no derivative of q beyond the velocity that muscles need: second differences, which amplify every error, do not
appear. Between samples q is a quintic spline and EMG is what the simulator takes it to be; a sample step is cut where
the delayed EMG has its kinks, and each piece is integrated by Gauss-Legendre points. The residual of an exact motion is
then small enough to identify parameters to 0.02 %.

Shapes: ... copies of the parameters, S seeds, T trials, N samples, D points in a sample step, K test functions, R raw.
"""

from dataclasses import dataclass

import numpy as np
import torch
from scipy.interpolate import make_interp_spline
from torch import Tensor

from myowave.data.trials import Trials
from myowave.identification.parameters import Identified
from myowave.physics.drive import breakpoints, channels_of
from myowave.physics.model import Model, acceleration, bind
from myowave.physics.simulation import Simulation

HALF_WIDTH_S = 0.5  # of a test function [s]
STRIDE = 4  # test functions stand a quarter of their half width apart
GAUSS_POINTS = 2  # in each piece between kinks
NUDGE = 1e-5  # of raw numbers, for differences
LARGEST_STEP = 0.2  # of raw numbers, in one Gauss-Newton step


@dataclass(frozen=True)
class WeakResidual:
    """The weak residual of the training trials under a model.

    Args:
        emg: (T, N, M), float64.
        known: constants and conditions, name -> (T,).
        lengths: recorded samples of each trial.
    """

    model: Model
    emg: Tensor
    dt: float
    known: dict[str, Tensor]
    lengths: tuple[int, ...]
    points: Tensor  # (D,), fractions of a sample step
    weights: Tensor  # (D,) [s]

    @classmethod
    def of(cls, model: Model, trials: Trials) -> "WeakResidual":
        """For all trials given; the model must have no `hidden_effects`."""
        assert not hidden_effects(model), model.name
        emg = channels_of(model, trials.channels, torch.from_numpy(trials.emg))
        known = known_params(trials, model)
        points, weights = _quadrature(breakpoints(bind(model, known, emg), trials.dt, 1), trials.dt)
        return cls(model, emg, trials.dt, known, trials.lengths, points, weights)

    @property
    def half_width(self) -> int:
        """Half width of a test function in samples."""
        return int(np.clip(round(HALF_WIDTH_S / self.dt), 8, (min(self.lengths) - 1) // 2))

    def along(self, angle: Tensor) -> "Sequence":
        """Prepare a sequence (S, T, N) [rad], such as the network's predictions of the trials."""
        q, qdot = (torch.empty(*angle.shape[:-1], angle.shape[-1] - 1, len(self.points)) for _ in range(2))
        q, qdot = q.double(), qdot.double()
        values = angle.double().cpu().numpy()
        for trial, length in enumerate(self.lengths):
            time = np.arange(length, dtype=np.float64)
            spline = make_interp_spline(time, values[:, trial, :length].T, k=5)
            fine = (time[:-1, None] + self.points.numpy()).ravel()
            for target, order in ((q, 0), (qdot, 1)):
                at = torch.from_numpy(spline(fine, order)).T / self.dt**order
                target[:, trial, : length - 1] = at.unflatten(-1, (length - 1, -1))
                target[:, trial, length - 1 :] = target[:, trial, length - 2 : length - 1, -1:]
        return Sequence(self, q, qdot)

    def project(self, density: Tensor, order: int) -> Tensor:
        """Integral of test functions, differentiated `order` times, against (..., T, N - 1, D): (..., T, K)."""
        w, step = self.half_width, max(1, self.half_width // STRIDE)
        s = ((torch.arange(-w, w)[:, None] + self.points) / w).double()  # (2 w, D)
        bump = (1 - s**2) ** 3 if order == 0 else (-6 * (1 - s**2) ** 2 + 24 * s**2 * (1 - s**2)) / (w * self.dt) ** 2
        kernel = (bump * self.weights).flatten()
        d = len(self.points)
        return density.flatten(-2).unfold(-1, 2 * w * d, step * d) @ kernel

    @property
    def inside(self) -> Tensor:
        """Which test functions lie within the recorded part, (T, K)."""
        w, step = self.half_width, max(1, self.half_width // STRIDE)
        ends = torch.arange(0, self.emg.shape[-2] - 2 * w, step) + 2 * w
        return ends < torch.tensor(self.lengths)[:, None]


@dataclass(frozen=True)
class Sequence:
    """A sequence as a smooth motion: angle and velocity (S, T, N - 1, D) at the points of the quadrature."""

    form: WeakResidual
    q: Tensor
    qdot: Tensor

    def residual(self, params: dict[str, Tensor]) -> Tensor:
        """Weak residual (..., S, T, K) [rad]; parameters broadcast to (..., S, T)."""
        form = self.form
        simulation = Simulation(form.model, {**form.known, **params}, form.emg, form.dt)
        start = torch.arange(form.emg.shape[-2] - 1, dtype=torch.float64)
        position = start[:, None, None] + form.points[:, None]
        _, activation = simulation.activate(position)
        qddot = acceleration(simulation.bound.along(2), self.q, self.qdot, activation, {})
        residual = form.project(self.q, 2) - form.project(qddot, 0)
        return residual * form.inside

    def linearise(self, identified: Identified, raw: Tensor) -> tuple[Tensor, Tensor]:
        """Residual (S, n) and its Jacobian (S, n, R) by the raw numbers."""
        bumps = torch.cat([raw.new_zeros(1, raw.shape[-1]), NUDGE * torch.eye(raw.shape[-1], dtype=raw.dtype)])
        residual = self.residual(identified.params(raw + bumps.unsqueeze(1))).flatten(-2)
        return residual[0], ((residual[1:] - residual[0]) / NUDGE).movedim(0, -1)


def gauss_newton(sequence: Sequence, identified: Identified, raw: Tensor, damping: Tensor) -> tuple[Tensor, Tensor]:
    """One damped Gauss-Newton (Levenberg-Marquardt) step, taken where it lowers the residual.

    Args:
        raw: (S, R).
        damping: (S,), relative to the diagonal of the normal matrix.

    Returns:
        New raw numbers and damping.
    """
    residual, jacobian = sequence.linearise(identified, raw)
    normal = jacobian.mT @ jacobian
    diagonal = torch.diagonal(normal, dim1=-2, dim2=-1)
    ridge = damping.unsqueeze(-1) * diagonal + 1e-12 * diagonal.amax(-1, keepdim=True).clamp(min=1e-30)
    gradient = jacobian.mT @ residual.unsqueeze(-1)
    change = -torch.linalg.solve(normal + torch.diag_embed(ridge), gradient).squeeze(-1)
    change = change * (LARGEST_STEP / change.abs().amax(-1, keepdim=True).clamp(min=LARGEST_STEP))
    proposed = sequence.residual(identified.params(raw + change)).flatten(-2)
    better = proposed.square().sum(-1) < residual.square().sum(-1)
    damping = torch.where(better, damping / 10, damping * 10).clamp(1e-9, 1e6)
    return torch.where(better.unsqueeze(-1), raw + change, raw), damping


def hidden_effects(model: Model) -> list[str]:
    """Effects that a measured angle does not determine, so that no residual along it holds them."""
    return [effect.name for effect in model.effects if effect.stateful or effect.acts_on == "observation"]


def known_params(trials: Trials, model: Model) -> dict[str, Tensor]:
    """Known constants and conditions of the trials, name -> (T,), float64."""
    names = sorted(set(trials.constants).union(*trials.conditions.values()))
    return {name: torch.from_numpy(trials.condition(name, model.defaults[name])) for name in names}


def _quadrature(split: Tensor, dt: float) -> tuple[Tensor, Tensor]:
    """Gauss-Legendre points (D,) in units of a sample and weights [s] between the kinks of the EMG."""
    split = split.reshape(-1, split.shape[-1])
    # ASSUME: kinks are cut out only where all trials have them at the same place; else finer pieces do.
    edges = split[0].numpy() if bool((split == split[0]).all()) else np.linspace(0, 1, 5)
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    width = np.diff(edges)[:, None]
    points = edges[:-1, None] + width * (nodes + 1) / 2
    return torch.from_numpy(points.ravel()), torch.from_numpy((width * weights / 2 * dt).ravel())
