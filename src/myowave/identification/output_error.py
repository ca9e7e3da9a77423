"""Fit a model to trials by output error: the parameters whose simulated motion is nearest to the measured one.

The motion and its derivatives come from `physics.trajectory.solve`, all samples at once. That allows two stages:
1. *Lifted* Gauss-Newton steps, that start from the measured motion and close the gaps to a simulated one and move the
   parameters together. Linearised near the data rather than near a wrong simulation, they reach the right basin
   from far away. Several starts run as one batch, and after each step the better half goes on.
2. Levenberg-Marquardt on simulated motions, with bounds, until a step would gain nothing that noise allows to see.
Noise on the angle averages out, every effect may take part, and where the physics is wrong the fit becomes the best
simulator of these trials that it can be. The angle and velocity at the start of each trial are estimated with the
parameters; nobody measures them (`least_squares`).

Shapes: B starts of the search, T trials, N samples, K numbers of a state, P free parameters.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from myowave.identification.free_parameters import Free, bind_values, moved, scales, start_values, within
from myowave.identification.least_squares import Normal, bounded_step, normal_equations
from myowave.identification.noise import correlation_time
from myowave.identification.record import Record
from myowave.identification.torque import TorqueFit, with_torque
from myowave.identification.uncertainty import covariance
from myowave.physics.model import Model, Params
from myowave.physics.motion import resting_states, simulate
from myowave.physics.simulation import Simulation
from myowave.physics.tangent import Linear
from myowave.physics.trajectory import Newton, Sensitive, solve

Array = NDArray[np.float64]

TOLERANCE = 1e-5  # of the simulated state [rad, rad/s]
GAIN = 1e-3  # stop where the next step would lower the sum of squares by less than this many residual variances
STANDSTILL = 0.03  # stop after a step that gained less than this many independent samples are worth
LIFTED_STEPS, STEPS = 4, 30  # the first suffice for sixteen starts to come down to two
WATCHDOG, WATCHDOG_STEPS = 100.0, 3  # a step that fails is followed further if the sum of squares grew by less
KEEPS = 0.5  # of its promise: a step that keeps more is followed by a bolder one
DAMPING, DAMPING_UP, DAMPING_DOWN, DAMPING_MOST = 1e-4, 10.0, 0.1, 1e8


@dataclass(frozen=True)
class Fit:
    """A fitted model.

    Args:
        simulation: the model with its fitted parameters and the EMG of the trials.
        values: the free parameters, (P,); `free` says which.
        starts: angle and velocity at the start of each trial, (T, 2).
        angle: simulated [rad], (T, N).
        normal: residuals and derivatives at the solution.
        sensitive: the solved motion.
        record: what was fitted.
        converged: whether no step could gain anything any more.
        torque: the fit to torque that all values are taken from, where no motion of the model follows the trials.
    """

    simulation: Simulation
    free: tuple[Free, ...]
    values: Array
    starts: Array
    normal: Normal
    sensitive: Sensitive
    record: Record
    converged: bool = False
    torque: TorqueFit | None = None

    @property
    def model(self) -> Model:
        return self.simulation.model

    @property
    def params(self) -> Params:
        """Every parameter that is not at its default, as tensors for the physics."""
        return self.simulation.params

    @property
    def angle(self) -> Array:
        return self.sensitive.motion.angle.numpy()

    @property
    def linear(self) -> Linear:
        return self.sensitive.linear

    @property
    def residual(self) -> Array:
        """Measured - simulated angle, 0 where padded, (T, N) [rad]."""
        return np.where(self.record.valid, self.record.angle - self.angle, 0.0)

    @property
    def rss(self) -> float:
        """Sum of squares of the residual [rad^2]."""
        return float((self.residual**2).sum())

    @property
    def objective(self) -> float:
        """What the fit lowers [rad^2], see `Normal.objective`."""
        return float(self.normal.objective)

    @property
    def variance(self) -> float:
        """Variance of the residual, or of its innovations [rad^2]."""
        return self.normal.variance(self.record.samples)

    @property
    def independent_variance(self) -> float:
        """Variance of what is independent in the residual, or in its innovations [rad^2]."""
        return self.variance * correlation_time(self.normal.residual, self.record.samples)

    @property
    def parameters(self) -> dict[str, float]:
        return {p.name: float(v) for p, v in zip(self.free, self.values, strict=True)}

    @property
    def expected(self) -> Array:
        """Values (P,) with constants where they are expected, and the parameters of effects as they are fitted."""
        return np.array([value if "." in p.name else p.start for p, value in zip(self.free, self.values, strict=True)])

    def at_bound(self, name: str) -> bool:
        """Whether a parameter ended on a bound that is neither 0, the absence of an effect, nor its usual strength, as
        the share of other curves, which is 1 where they replace the base model's."""
        p, value = next((p, v) for p, v in zip(self.free, self.values, strict=True) if p.name == name)
        return any(
            abs(value - bound) < 1e-9 * p.scale and abs(bound) not in (0.0, p.scale) for bound in (p.low, p.high)
        )

    def covariance(self) -> Array:
        """Covariance of the free parameters (P, P), see `uncertainty`."""
        return self.torque.covariance if self.torque else covariance(self.normal, self.record, self.free)

    def standard_errors(self) -> dict[str, float]:
        return {p.name: float(e) for p, e in zip(self.free, np.sqrt(np.diag(self.covariance())), strict=True)}

    def rmse(self) -> float:
        """Root mean square of the residual [rad]."""
        return float(np.sqrt(self.rss / self.record.samples))


@dataclass(frozen=True)
class LiftedSearch:
    """Where searches stand before their motion is simulated, B of them as one batch.

    Args:
        simulation: of the model with any parameters.
        values: (B, P).
        starts: angle and velocity at the start of each trial, (B, T, 2).
        guess: the state along each trial, a motion but for gaps, (B, T, N, K).
        error: `Normal.objective` that the last step started from (B,); infinite before the first.
    """

    simulation: Simulation
    record: Record
    free: tuple[Free, ...]
    values: Array
    starts: Array
    guess: Tensor
    error: Array

    @classmethod
    def begin(cls, model: Model, record: Record, free: Sequence[Free], values: Array) -> "LiftedSearch":
        """From the measured motion, smoothed, for every row of values (B, P)."""
        free, measured = tuple(free), record.motion.expand(len(values), -1, -1, -1)
        simulation = record.simulation(model, bind_values(free, values))
        guess = resting_states(simulation, measured[..., 0], measured[..., 1])
        return cls(simulation, record, free, values, record.starts_of(guess), guess, np.full(len(values), np.inf))

    def lifted(self) -> "LiftedSearch":
        """A Gauss-Newton step of the parameters that closes the gaps of the guess at the same time."""
        simulation = self.simulation.with_params(bind_values(self.free, self.values))
        result = _solve(simulation, self.free, self.starts, self.guess, iterations=1)
        normal = normal_equations(result, self.record, self.free, self.values)
        normal = with_torque(normal, simulation.model, self.record, self.free, self.values)
        step = bounded_step(normal.matrix, normal.vector, self.free, self.values, DAMPING)
        shift = normal.starts_after(step)
        values, starts, guess = _move(self.free, self.values, self.starts, result, step, shift)
        return replace(self, simulation=simulation, values=values, starts=starts, guess=guess, error=normal.objective)

    def better_half(self) -> "LiftedSearch":
        """The half, but at least two, whose last step started from the smallest error."""
        keep = np.argsort(self.error, kind="stable")[: max(2, -(-len(self.values) // 2))]  # diverged ones come last
        guess = self.guess[torch.from_numpy(keep)]
        return replace(self, values=self.values[keep], starts=self.starts[keep], guess=guess, error=self.error[keep])

    def fits(self) -> Iterator[Fit | None]:
        """The fit where each search stands, None where no motion is found near its guess."""
        for values, starts, guess in zip(self.values, self.starts, self.guess, strict=True):
            yield _attempt(self.simulation, self.record, self.free, values, starts, guess)


def fit_model(
    model: Model,
    record: Record,
    free: Sequence[Free],
    *,
    starts: int = 1,
    seed: int = 0,
    further: Sequence[Array] = (),
) -> Fit:
    """Fit a model from scratch.

    Args:
        record: all trials in it are fitted.
        free: what to estimate.
        starts: searches, the first from `Free.start`, the others up to `Free.spread` away.
        further: values (P,) that more searches start from.

    Raises:
        ValueError: if the model is not able to move from any of the starts.
    """
    usual = np.array([p.start for p in free])
    around = start_values(free, range(seed + 1, seed + starts))
    return fit_from(model, record, free, np.concatenate([usual[None], around, *(v[None] for v in further)]))


def fit_from(model: Model, record: Record, free: Sequence[Free], values: Array) -> Fit:
    """Fit a model from given values (B, P), side by side; raises as `fit_model` does."""
    return min(map(polish, _survivors(model, record, free, values)), key=lambda fit: fit.objective)


def begin_from(model: Model, record: Record, free: Sequence[Free], values: Array) -> Fit:
    """The fit to descend from that the best of some values (B, P) lead to; raises as `fit_model` does."""
    return _survivors(model, record, free, values)[0]


def _survivors(model: Model, record: Record, free: Sequence[Free], values: Array) -> list[Fit]:
    """The fits that searches from given values (B, P) end at, at most two, before any descent. Which of them leads to
    the lower valley is not seen from there."""
    search = LiftedSearch.begin(model, record, free, values)
    for _ in range(LIFTED_STEPS):
        search = search.lifted().better_half()
    fits = [fit for fit in search.fits() if fit is not None]
    if not fits:
        raise ValueError(
            f"model {model.name}: its motion diverges from every start of the fit. Check the units of the recording "
            "and the constants of the arm's muscles."
        )
    return fits


def fit_simulated(model: Model, record: Record, free: Sequence[Free], values: Array) -> Fit | None:
    """Fit a model from the motion that values (P,) simulate from the measured starts; None where they have none."""
    free, begin = tuple(free), record.starts_of(record.motion)
    simulation = record.simulation(model, bind_values(free, values))
    guess = simulate(simulation, *torch.from_numpy(begin).unbind(-1)).state
    begun = _attempt(simulation, record, free, values, begin, guess)
    return None if begun is None else polish(begun)


def refit(fit: Fit, model: Model, free: Sequence[Free]) -> Fit:
    """Fit a related model from where another fit ended.

    Args:
        fit: parameters that both have start from here; others from `Free.start`.
        model: with effects added or taken away.
        free: all that is estimated now.
    """
    record, free = fit.record, tuple(free)
    known = fit.parameters
    values = within(free, np.array([known.get(p.name, p.start) for p in free]))
    simulation, guess = record.simulation(model, bind_values(free, values)), fit.sensitive.motion.state
    if model.stateful != fit.model.stateful:
        guess = resting_states(simulation, guess[..., 0], guess[..., 1])
    begun = _attempt(simulation, record, free, values, fit.starts, guess)
    return fit_model(model, record, free) if begun is None else polish(begun)


def _solve(
    simulation: Simulation,
    free: Sequence[Free],
    begin: Array,
    guess: Tensor,
    iterations: int = 25,
    near: Tensor | None = None,
) -> Sensitive:
    """The motion near a guess, with derivatives that are 0 for parameters that are fixed."""
    q0, qdot0 = (torch.from_numpy(begin[..., i].copy()) for i in range(2))
    newton = Newton(iterations, TOLERANCE, rescue=False)
    wrt = {p.name: p.scale for p in free if not p.fixed}
    result = solve(simulation, q0, qdot0, guess=guess, wrt=wrt, newton=newton, near=near)
    if len(wrt) == len(free):
        return result
    place = [i for i, p in enumerate(free) if not p.fixed]
    by_parameter = result.by_start.new_zeros(len(free), *result.by_start.shape[1:])
    by_parameter[place] = result.by_parameter
    tangent = result.tangent.new_zeros(*result.tangent.shape[:-1], len(free) + 2)
    tangent[..., [*place, len(free), len(free) + 1]] = result.tangent
    return replace(result, by_parameter=by_parameter, tangent=tangent)


def _move(
    free: Sequence[Free], values: Array, begin: Array, result: Sensitive, step: Array, shift: Array
) -> tuple[Array, Array, Tensor]:
    """Values, starts and a guess of the state after a step of the parameters and a shift of the starts."""
    shift = _padded(shift)
    change = np.broadcast_to((step * scales(free))[..., None, :], (*shift.shape[:-1], len(free)))
    both = np.concatenate([change, shift], -1)
    change = torch.einsum("...tnkp,...tp->...tnk", result.tangent, torch.from_numpy(both))
    return moved(free, values, step), begin + shift, result.motion.state + change


def _padded(shift: Array) -> Array:
    """Changes of angle and velocity at the start (..., 2), where the velocity is known too."""
    return np.concatenate([shift, np.zeros_like(shift)], -1)[..., :2]


def _attempt(
    simulation: Simulation,
    record: Record,
    free: tuple[Free, ...],
    values: Array,
    begin: Array,
    guess: Tensor,
    near: Tensor | None = None,
) -> Fit | None:
    """The fit at given values, or None where no motion was found near the guess.

    Args:
        simulation: of the model with any parameters.
        near: Jacobian of the steps of a motion nearby.
    """
    simulation = simulation.with_params(bind_values(free, values))
    result = _solve(simulation, free, begin, guess, near=near)
    if not result.gap < TOLERANCE:
        return None
    normal = with_torque(normal_equations(result, record, free, values), simulation.model, record, free, values)
    return Fit(simulation, free, values, begin, normal, result, record)


def polish(fit: Fit) -> Fit:
    """The fit at the end of its descent."""
    *_, last = descend(fit)
    return last


def descend(fit: Fit) -> Iterator[Fit]:
    """Levenberg-Marquardt: the fit as it is, then after each step, each no worse than the one before.

    A full step along a curved valley may land on its slope; the next steps from there lead back to the floor, further
    on. So a step that promises more than a residual variance and fails gets these before it is given up (Chamberlain et
    al. 1982, the "watchdog" technique).
    """
    damping = DAMPING
    yield fit
    for _ in range(STEPS):
        step = _step(fit, damping)
        promise = gain(fit, *step)
        if fit.converged or promise < GAIN * fit.variance:
            yield replace(fit, converged=True)
            return
        tried = take_step(fit, *step)
        kept = _kept(fit, tried, promise)
        if promise > fit.variance and fit.record.pieces is None and not fit.model.stateful:
            tried = _follow(fit, tried, damping)  # in pieces, and with states, a shorter step costs less
        if tried is not None and tried.objective < fit.objective:
            if fit.objective - tried.objective < _standstill(tried):
                yield replace(tried, converged=True)
                return
            fit, damping = tried, max(damping * DAMPING_DOWN, 1e-12) if kept > KEEPS else damping
        elif damping > DAMPING_MOST:
            return
        else:
            damping = max(damping, DAMPING) * DAMPING_UP
        yield fit


def _kept(fit: Fit, tried: Fit | None, promise: float) -> float:
    """How much of its promise a step has kept [-]."""
    return -math.inf if tried is None else (fit.objective - tried.objective) / promise


def _standstill(fit: Fit) -> float:
    """What a step must gain at least if another is to follow [rad^2].

    The residual of a model that is far from the truth is slow, so hundreds of samples are worth a few, and its steps
    may creep along kinks of curves for ever without any gain that counts as evidence.
    """
    return STANDSTILL * fit.independent_variance


def _step(fit: Fit, damping: float) -> tuple[Array, Array]:
    """A step of the parameters (P,), in units of their scales, and the shift of the starts with it, both damped."""
    step = bounded_step(fit.normal.matrix, fit.normal.vector, fit.free, fit.values, damping)
    return step, fit.normal.starts_after(step) / (1 + damping)


def _follow(fit: Fit, tried: Fit | None, damping: float) -> Fit | None:
    """What a failed step leads to in a few more, as long as each lowers the objective."""
    limit = WATCHDOG * fit.objective
    for _ in range(WATCHDOG_STEPS):
        if tried is None or tried.objective < fit.objective or tried.objective > limit:
            break
        limit = tried.objective
        tried = take_step(tried, *_step(tried, damping))
    return tried


def take_step(fit: Fit, step: Array, shift: Array) -> Fit | None:
    """The fit after a step, or None where no motion was found there."""
    values, begin, guess = _move(fit.free, fit.values, fit.starts, fit.sensitive, step, shift)
    return _attempt(fit.simulation, fit.record, fit.free, values, begin, guess, fit.linear.jacobian)


def promised(fit: Fit) -> float:
    """The objective that the next full step promises [rad^2]."""
    return fit.objective - gain(fit, *_step(fit, DAMPING))


def gain(fit: Fit, step: Array, shift: Array) -> float:
    """How much a step of the parameters (P,) and a shift of the starts (T, S) would lower the objective, to first
    order."""
    normal = fit.normal
    left = normal.residual - normal.slope @ step - (normal.by_start @ shift[..., None])[..., 0]
    nearer = normal.weight @ (normal.off**2 - (normal.off - step) ** 2)
    if normal.torque_slope is not None:
        nearer += (normal.torque**2).sum() - ((normal.torque - normal.torque_slope @ step) ** 2).sum()
    return float(normal.rss - (left**2).sum() + nearer)
