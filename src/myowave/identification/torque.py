"""Fit a model to the torque that the measured motion needs: the first stage of a fit, where nothing can diverge.

With the test functions w of the weak form, inertia I and gravity of the model, the motion needs

    needed = [int w'' q dt - int w gravity / I dt] / int w / I dt
    given  = int w (muscles + effects) / I dt / int w / I dt                                                     [N m]

on every window. Both are homogeneous: a forearm without mass needs no torque, and muscles without force give none, so
what is left in N m falls to nothing along with both. Residuals are therefore weighed against the torque that they
explain, and masses stay where they are expected, as all constants do that nobody measured.

Shapes: ... copies of the parameters, T trials, N samples, D points in a sample step, K windows, P free parameters.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from myowave.identification.free_parameters import Free, bind_values, expected, moved, scales
from myowave.identification.least_squares import bounded_step, pseudo_inverse
from myowave.identification.record import Record
from myowave.identification.uncertainty import samples_for_one
from myowave.identification.weak_form import effects_unseen_by_angle
from myowave.identification.windows import HALF_WIDTH_S, Windows
from myowave.physics.dynamics import torques
from myowave.physics.model import Model

Array = NDArray[np.float64]

COARSE_S = 0.02  # steps in which the torque of muscles is taken
NUDGE = 1e-5  # in units of the scales, for differences
ROUNDS, STEPS = 2, 30  # the variance is estimated anew in each round
DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-9, 1e9
GAIN = 0.05  # stop after a step that lowers the objective, a chi-square, by less
LARGEST = 1e6  # of residuals: where a torque overflows, its sums are large and not infinite


@dataclass(frozen=True)
class Balance:
    """Torques of a model along the measured motion of trials.

    Args:
        q, qdot: the motion, smoothed, in the middle of coarse steps [rad, rad/s], (T, steps, 1).
        position: of these in samples, (steps, 1, 1).
        moved: int w'' q dt of the angle as measured [rad/s], (T, K).
        windows: in coarse steps.
        inside: which of them count, (T, K).
        measured: torque of the muscles over each window as a dynamometer measured it [N m], NaN where none did, (T, K);
            None where none ever did.
    """

    model: Model
    record: Record
    q: Tensor
    qdot: Tensor
    position: Tensor
    moved: Tensor
    windows: Windows
    inside: NDArray[np.bool_]
    measured: Array | None = None

    @classmethod
    def of(cls, model: Model, record: Record) -> "Balance":
        """Along the motion of whole trials.

        Raises:
            ValueError: if no trial is as long as a window, or the model has effects that no angle shows.
        """
        if unseen := effects_unseen_by_angle(model):
            raise ValueError(f"the measured angle says nothing of the states of {', '.join(unseen)}")
        assert record.pieces is None
        coarse = max(1, round(COARSE_S / record.dt))
        windows = Windows.over(record.lengths, record.dt, coarse)
        if not windows.inside.any():
            raise ValueError(f"no trial is as long as the {2 * HALF_WIDTH_S:g} s that a torque is taken over")
        steps = (record.angle.shape[1] - 1) // coarse
        position = (torch.arange(steps, dtype=torch.float64) + 0.5) * coarse
        left = position.floor().long()
        share = (position - left)[:, None]
        state = record.first_guess()
        q, qdot = (state[:, left] * (1 - share) + state[:, (left + 1).clamp(max=state.shape[1] - 1)] * share).unbind(-1)
        moved = windows.accelerated(record.angle, record.lengths)
        merged = windows.merged(coarse)
        count = merged.integrate(q[..., None]).shape[-1]
        inside = windows.inside[:, :count]
        state = q[..., None], qdot[..., None], position[:, None, None]
        measured = None
        if record.torque is not None:
            told = torch.from_numpy(record.torque)[..., None]
            between = told[:, left] * (1 - share) + told[:, left + 1] * share
            measured = (merged.integrate(between) / merged.integrate(torch.ones_like(between))).numpy()
        return cls(model, record, *state, moved[:, :count], merged, inside, measured)

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Windows over which a dynamometer measured, (T, K)."""
        return np.zeros_like(self.inside) if self.measured is None else self.inside & np.isfinite(self.measured)

    def torques(self, free: Sequence[Free], values: Array) -> tuple[Array, Array]:
        """Needed and given torque [N m], (..., T, K) each, for free parameters (..., P)."""
        simulation = self.record.simulation(self.model, bind_values(free, values))
        _, activation = simulation.activate(self.position)
        valued = simulation.valued.along(2).leaning(simulation.sway_at(self.position))
        found = torques(valued, self.q, self.qdot, activation, {})
        inverse = (1 / found.inertia).expand_as(found.total)
        area = self.windows.integrate(inverse)
        needed = (self.moved - self.windows.integrate(found.gravity * inverse)) / area
        given = self.windows.integrate((found.muscles + found.effects) * inverse) / area
        return needed.numpy(), given.numpy()

    def residual(self, free: Sequence[Free], values: Array) -> Array:
        """What is not given of the needed torque and, where a dynamometer measured, of that torque, in units of the
        needed one (root mean square), 0 outside trials, (..., T, K) or (..., T, 2 K)."""
        needed, given = self.torques(free, values)
        size = np.sqrt(np.where(self.inside, needed**2, 0.0).sum((-1, -2), keepdims=True) / self.inside.sum())
        left = [np.where(self.inside, needed - given, 0.0)]
        if self.measured is not None:
            left.append(np.where(self.seen, self.measured - given, 0.0))
        return np.nan_to_num(np.concatenate(left, -1) / size, nan=LARGEST).clip(-LARGEST, LARGEST)

    @property
    def count(self) -> int:
        """Residuals that count."""
        return int(self.inside.sum() + self.seen.sum())


@dataclass(frozen=True)
class TorqueFit:
    """A model fitted to torque.

    Args:
        values: (P,), and their `covariance` (P, P), SI units; `free` says of what.
        left_out: share of the torque of each trial that is given where the others alone are fitted [-], as `leave_out`
            gives it; empty where nobody asked.
    """

    free: tuple[Free, ...]
    values: Array
    covariance: Array

    left_out: Mapping[str, float] = field(default_factory=dict)

    @property
    def held(self) -> tuple[Free, ...]:
        """The parameters, to be held at these values."""
        errors = np.sqrt(np.diag(self.covariance))
        pairs = zip(self.free, self.values, errors, strict=True)
        return tuple(
            replace(p, start=float(v), deviation=float(e) or np.inf, held=True, beforehand=p.known) for p, v, e in pairs
        )


def shares_given(balance: Balance, free: Sequence[Free], values: Array) -> dict[str, float]:
    """Share of the needed torque about its mean that a model gives [-], by trial; not of trials without a window."""
    needed, given = balance.torques(free, values)
    found = {}
    for trial, inside in enumerate(balance.inside):
        if inside.any() and (variance := needed[trial, inside].var()) > 0:
            left = (needed - given)[trial, inside]
            found[balance.record.names[trial]] = float(1 - (left**2).mean() / variance)
    return found


def fit_torque(model: Model, record: Record, free: Sequence[Free]) -> TorqueFit:
    """Fit a model to the torque that the measured motion of all trials in a record needs.

    Args:
        record: whole trials.
        free: what to estimate; what is known of it beforehand counts as further samples.

    Raises:
        ValueError: if no trial is long enough, or the model has effects that no angle shows.
    """
    free = tuple(free)
    balance = Balance.of(model, record)
    values = torque_values(balance, free, np.array([p.start for p in free]))
    residual, slope = _linearise(balance, free, values)
    matrix = slope.T @ slope / _variance(residual, balance.count) + np.diag(expected(free)[1])
    unit = np.outer(scales(free), scales(free))
    return TorqueFit(free, values, pseudo_inverse(matrix) * unit)


def torque_values(balance: Balance, free: Sequence[Free], start: Array) -> Array:
    """The values (P,) that give the needed torque best, from some to start from (P,)."""
    values = start
    for _ in range(ROUNDS):
        values = _descend(balance, free, values, _variance(balance.residual(free, values), balance.count))
    return values


def leave_out(model: Model, record: Record, free: Sequence[Free]) -> dict[str, float]:
    """Share of the torque of each trial that is given where only the others are fitted, from the usual values [-]."""
    found: dict[str, float] = {}
    for trial in range(len(record.names) if len(record.names) > 1 else 0):
        rest, alone = record.take(np.delete(np.arange(len(record.names)), trial)), record.take([trial])
        try:
            fitted = torque_values(Balance.of(model, rest), free, np.array([p.start for p in free]))
            found |= shares_given(Balance.of(model, alone), free, fitted)
        except ValueError:  # a trial, or all others, too short for a window
            continue
    return found


def _variance(residual: Array, count: int) -> float:
    """Of what is independent in a residual (T, K) of which so many count."""
    return float((residual**2).sum() / count * samples_for_one(residual, count))


def _objective(residual: Array, free: Sequence[Free], values: Array, variance: float) -> float:
    usual, weight = expected(free)
    return float((residual**2).sum() / variance + (weight * ((usual - values) / scales(free)) ** 2).sum())


def _linearise(balance: Balance, free: Sequence[Free], values: Array) -> tuple[Array, Array]:
    """Residual (T, K) and its derivatives (T K, P) by the parameters in units of their scales."""
    bumps = np.concatenate([np.zeros((1, len(free))), NUDGE * np.diag(scales(free))])
    residual = balance.residual(free, values + bumps)
    slope = (residual[1:] - residual[0]) / NUDGE
    return residual[0], slope.reshape(len(free), -1).T


def _descend(balance: Balance, free: Sequence[Free], values: Array, variance: float) -> Array:
    """Levenberg-Marquardt from some values (P,) at a given variance."""
    damping = DAMPING
    usual, weight = expected(free)
    residual, slope = _linearise(balance, free, values)
    for _ in range(STEPS):
        now = _objective(residual, free, values, variance)
        matrix = slope.T @ slope / variance + np.diag(weight)
        vector = -slope.T @ residual.ravel() / variance + weight * (usual - values) / scales(free)
        proposed = moved(free, values, bounded_step(matrix, vector, free, values, damping))
        gained = now - _objective(balance.residual(free, proposed), free, proposed, variance)
        if gained > 0:
            values, damping = proposed, max(damping / 10, LEAST_DAMPING)
            if gained < GAIN:
                break
            residual, slope = _linearise(balance, free, values)
        elif damping >= MOST_DAMPING:
            break
        else:
            damping *= 10
    return values
