"""Torque along the measured motion: what it needs, what a model gives, and the fit of a model to it.

With test functions w (see `windows`), inertia I and gravity of the model, the motion needs

    needed = [int w'' q dt - int w gravity / I dt] / int w / I dt
    given  = int w (muscles + effects) / I dt / int w / I dt                                                     [N m]

on every window. Nothing is simulated, so nothing diverges: a fit converges from any start. But it takes the measured
motion for the true one and cannot follow states that no angle shows; `output_error` does, from near by.

There are two balances. That `along` a smoothed motion, in windows of 0.3 s, is for recorded trials. A forearm without
mass needs no torque, and muscles without force give none, so what is left is weighed against the torque that is needed:
in N m it would fall to nothing along with both. That `between_kinks` takes the measured angle as it is, in windows of
1 s, with steps cut where the delayed EMG has its kinks; an exact motion identifies parameters to 0.02 %.

Shapes: ... copies of the parameters, T trials, N samples, n steps, D points in a step, K windows, P free parameters.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from myowave.data.trials import Array
from myowave.identification.along import Along
from myowave.identification.free_parameters import Free, bind_values, expected, scales
from myowave.identification.least_squares import Residual, covariance_of, limited, linearise, search
from myowave.identification.noise import correlation_time
from myowave.identification.record import Record
from myowave.identification.windows import Windows, between, between_kinks, gauss
from myowave.physics.dynamics import Torques, torques
from myowave.physics.model import Model, Params
from myowave.physics.motion import late_activation, unpack
from myowave.physics.simulation import Instant, between_samples

HALF_WIDTH_S, OVERLAP = 0.15, 2  # of a window, as an elbow's motion is slower; they stand half of that apart
FEWEST = 3  # steps in a half width
WIDE_S, WIDE_OVERLAP, WIDE_FEWEST = 0.5, 4, 8  # the same between kinks
COARSE_S = 0.03  # steps in which the torque of muscles is taken, at two points each
ROUNDS, STEPS = 2, 30  # the variance is estimated anew in each round
GAIN = 0.05  # stop after a step that lowers the objective, a chi-square, by less
# ASSUME: dynamometer, lever and the muscles' model together are as good as this share of the torque they measure.
ACCURACY = 0.05


@dataclass(frozen=True)
class WindowTorques:
    """Torques in every window [N m], and the moment of inertia [kg m^2], (..., T, K) each; what is given counts muscles
    and `effects` on the joint."""

    needed: Array
    given: Array
    effects: Array
    inertia: Array


@dataclass(frozen=True)
class TorqueBalance:
    """The measured motion of trials, and torques of a model along it."""

    model: Model
    record: Record
    # q, qdot: the motion of the joint [rad, rad/s], (T, n, D)
    q: Tensor
    qdot: Tensor
    states: Mapping[str, Tensor]  # of effects, by name, (T, n, D, M)
    position: Tensor  # of these in samples, (n, D, 1)
    moved: Tensor  # int w'' q dt of the angle as measured [rad/s], (T, K)
    windows: Windows  # test functions in these steps

    @classmethod
    def along(cls, along: Along) -> "TorqueBalance":
        """Along the smoothed motion of whole trials; states of effects are those of the parameters there."""
        record, windows = along.record, windows_of(along.record)
        merged, samples = windows.merged(_coarse(record)), record.angle.shape[1]
        position = merged.positions(samples)
        angle, *motion = along.motion
        moved = windows.integrate(between(angle, record.lengths, windows.positions(samples)), 2)
        q, qdot = (between(x, record.lengths, position) for x in motion)
        *_, states = unpack(along.model, between_samples(along.state, position[..., None]))
        return cls(along.model, record, q, qdot, states, position[..., None], moved, merged)

    @classmethod
    def between_kinks(cls, model: Model, record: Record) -> "TorqueBalance":
        """Along the measured angle as it is; the model must have no `effects_unseen_by_angle`."""
        assert not effects_unseen_by_angle(model), model.name
        dt, lengths = record.dt, record.lengths
        points, weights = between_kinks(record.simulation(model, {}).breakpoints)
        half = int(np.clip(round(WIDE_S / dt), WIDE_FEWEST, (lengths.min() - 1) // 2))
        windows = Windows.over(lengths, dt, half, max(1, half // WIDE_OVERLAP), points, weights)
        position = windows.positions(record.angle.shape[1])
        q, qdot = (between(record.angle, lengths, position, n) / dt**n for n in range(2))
        return cls(model, record, q, qdot, {}, position[..., None], windows.integrate(q, 2), windows)

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Which windows count, (T, K)."""
        return self.windows.inside

    def mean(self, values: Tensor) -> Array:
        """Means of values (T, n, D, F) over the windows, (T, K, F)."""
        area = self.windows.integrate(torch.ones_like(values[..., 0]))[..., None]
        return (torch.stack([self.windows.integrate(each) for each in values.unbind(-1)], -1) / area).numpy()

    @cached_property
    def measured(self) -> Array | None:
        """Torque of the muscles over each window as a dynamometer measured it [N m], NaN where none did, (T, K); None
        where none ever did."""
        if self.record.torque is None:
            return None
        told = between_samples(torch.from_numpy(self.record.torque)[..., None], self.position)
        return self.mean(told)[..., 0]

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Windows over which a dynamometer measured, (T, K)."""
        return np.zeros_like(self.inside) if self.measured is None else self.inside & np.isfinite(self.measured)

    def _at_points(self, params: Params) -> Torques:
        """Torques of the model at every point, (..., T, n, D)."""
        simulation = self.record.simulation(self.model, params)
        valued = simulation.valued_along(2).timed(simulation.course_at(self.position))
        instant = Instant(valued, *simulation.activate(self.position))
        activation, _ = late_activation(instant, lambda acting, _: self.states[acting.effect.name])
        return torques(valued, self.q, self.qdot, activation, self.states)

    def torques(self, params: Params) -> WindowTorques:
        """Torques over every window; what overflows is not finite."""
        found, integrate = self._at_points(params), self.windows.integrate
        inverse, _ = torch.broadcast_tensors(1 / found.inertia, found.total)
        area = integrate(inverse)
        needed = (self.moved - integrate(found.gravity * inverse)) / area
        effects = integrate(found.effects * inverse) / area
        given = integrate((found.driving + found.effects) * inverse) / area
        inertia = integrate(torch.ones_like(inverse)) / area
        return WindowTorques(needed.numpy(), given.numpy(), effects.numpy(), inertia.numpy())

    def unmoved(self, free: Sequence[Free], values: Array) -> Array:
        """int w'' q - w (torque / I) dt of free parameters (..., P), 0 outside trials [rad/s], (..., T K)."""
        found = self._at_points(bind_values(free, values))
        residual = self.moved - self.windows.integrate(found.acceleration)
        return (residual * torch.from_numpy(self.inside)).flatten(-2).numpy()

    def residual(self, free: Sequence[Free], values: Array) -> Array:
        """What is not given of the needed torque and, where a dynamometer measured, of that torque, in units of the
        needed one (root mean square), 0 outside trials, (..., T, K) or (..., T, 2 K)."""
        found = self.torques(bind_values(free, values))
        needed = np.where(self.inside, found.needed, 0.0)
        size = np.sqrt((needed**2).sum((-1, -2), keepdims=True) / self.inside.sum())
        left = [np.where(self.inside, needed - found.given, 0.0)]
        if self.measured is not None:
            left.append(np.where(self.seen, self.measured - found.given, 0.0))
        return limited(np.concatenate(left, -1) / size)

    def scaled(self, free: Sequence[Free], values: Array) -> Residual:
        """The residual as a function of values (..., P), in units of what is independent in it at some, and how far
        they are from where they are expected, as further samples of variance 1: (..., R)."""
        now, count = self.residual(free, values), int(self.inside.sum() + self.seen.sum())
        deviation = np.sqrt((now**2).sum() / count * correlation_time(now, count))
        usual, weight = expected(free)

        def residual(values: Array) -> Array:
            left = (self.residual(free, values) / deviation).reshape(*values.shape[:-1], -1)
            return np.concatenate([left, np.sqrt(weight) * (values - usual) / scales(free)], -1)

        return residual


def _coarse(record: Record) -> int:
    """Samples in a step in which the torque of muscles is taken."""
    return max(1, round(COARSE_S / record.dt))


def windows_of(record: Record) -> Windows:
    """The windows over which torques are compared, in steps of a sample."""
    coarse = _coarse(record)
    half = max(FEWEST, round(HALF_WIDTH_S / record.dt / coarse))
    return Windows.over(record.lengths, record.dt, coarse * half, coarse * max(1, half // OVERLAP), *gauss(3))


def effects_unseen_by_angle(model: Model) -> list[str]:
    """Effects that a measured angle does not determine, so that no residual along it holds them."""
    return [effect.name for effect in model.effects if effect.stateful or effect.acts_on == "observation"]


@dataclass(frozen=True)
class TorqueFit:
    """A model fitted to torque."""

    free: tuple[Free, ...]
    values: Array  # (P,), and their `covariance` (P, P), SI units; `free` says of what
    covariance: Array


def fit_torque(model: Model, record: Record, free: Sequence[Free]) -> TorqueFit | None:
    """Fit a model to the torque that the measured motion of all trials in a record needs; None where no trial is as
    long as a window, nothing drives the arm, the model has effects that no angle shows, or sums are not finite.

    Args:
        record: whole trials.
    """
    if effects_unseen_by_angle(model):
        return None
    balance = TorqueBalance.along(Along(model, record, {}))
    if not balance.torques({}).given.any():  # an effect may brake it, but what is left is all of what is needed
        return None
    values = np.array([p.start for p in free])
    for _ in range(ROUNDS):
        for found in search(balance.scaled(free, values), free, values[None], STEPS, GAIN):
            values = found[0]
    _, slope = linearise(balance.scaled(free, values), free, values)
    unit = np.outer(scales(free), scales(free))
    if not np.isfinite(slope).all():
        return None
    return TorqueFit(tuple(free), values, covariance_of(slope.T @ slope) * unit)


def measured_torque(model: Model, record: Record, free: Sequence[Free], values: Array) -> tuple[Array, Array] | None:
    """Torque that a dynamometer measured less what a model gives, (..., R), and derivatives of the latter, (..., R, P),
    in units of its error; None where none was measured, or where it hangs on states that no angle shows.

    It depends on the parameters alone, not on where a simulated motion has got to, and tells forces from masses: a
    motion stays the same if both grow by one factor, a torque does not.

    Args:
        values: of the parameters, (..., P).
    """
    if record.torque is None or record.pieces is not None or effects_unseen_by_angle(model):
        return None
    balance = TorqueBalance.along(Along(model, record, {}))
    if balance.measured is None or not balance.seen.any():
        return None
    measured, seen = balance.measured[balance.seen], balance.seen
    # Windows that overlap hold one error: together they count as those that stand side by side.
    error = ACCURACY * np.sqrt((measured**2).mean() * 2 * OVERLAP)

    def left(values: Array) -> Array:
        given = balance.torques(bind_values(free, values)).given
        return limited((measured - given[..., seen]) / error)

    residual, change = linearise(left, free, values)
    return residual, -change
