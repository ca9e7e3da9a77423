"""Fit a model to trials by output error: the parameters whose simulated motion is nearest to the measured one.

The motion and its derivatives come from `physics.trajectory.solve`, all samples at once. That allows two stages:
1. *Lifted* Gauss-Newton steps, that start from the measured motion, and close the gaps to a simulated one while they
   move the parameters. Linearised near the data rather than near a wrong simulation, they reach the right basin from
   far away. Several starts run as one batch, and after each step the better half goes on.
2. Levenberg-Marquardt on simulated motions, with bounds, until a step would gain nothing that noise allows to see.
The angle and velocity at the start of each trial are estimated with the parameters; nobody measures them.

Shapes: B starts of the search, T trials, N samples, K numbers of a state, P free parameters, S = 2 numbers of a start.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
import torch
from torch import Tensor

from myowave.data.trials import Array
from myowave.identification import least_squares
from myowave.identification.free_parameters import Free, bind_values, expected, moved, scales, start_values, within
from myowave.identification.least_squares import LITTLE, FitError, Normal, bounded_step, covariance_of, normal_equations
from myowave.identification.noise import SOLVERS_DEG, correlation_time
from myowave.identification.record import Record
from myowave.identification.torque import measured_torque
from myowave.physics.model import Model
from myowave.physics.motion import resting_states, simulate
from myowave.physics.simulation import Simulation
from myowave.physics.tangent import Linear
from myowave.physics.trajectory import Newton, Sensitive, solve

TOLERANCE = 1e-5  # of the simulated state [rad, rad/s]
GAIN = 1e-3  # stop where the next step would lower the sum of squares by less than this many residual variances
LIFTED_STEPS, STEPS = 4, 30  # the first suffice for sixteen starts to come down to two
WATCHDOG, WATCHDOG_STEPS = 100.0, 3  # a step that fails is followed further if the sum of squares grew by less
KEEPS = 0.5  # of its promise: a step that keeps more is followed by a bolder one
DAMPING, DAMPING_UP, DAMPING_DOWN, DAMPING_MOST = 1e-4, 10.0, 0.1, 1e8


@dataclass(frozen=True)
class Problem:
    """What is to be explained, by what, and what of it may change."""

    simulation: Simulation  # of the model with any values of its parameters, driven by the EMG of the trials
    record: Record  # the measured motion, its noise, and what is known of the trials
    # what is estimated, with its bounds and what is known of it beforehand; it moves in units of its scales
    free: tuple[Free, ...]

    @classmethod
    def of(cls, model: Model, record: Record, free: Sequence[Free], values: Array) -> "Problem":
        """With values (..., P)."""
        return Problem(record.simulation(model, bind_values(free, values)), record, tuple(free))

    @property
    def model(self) -> Model:
        return self.simulation.model

    def at(self, values: Array) -> "Problem":
        """The same with other values (..., P)."""
        simulation = self.simulation.with_params(bind_values(self.free, values))
        return Problem(simulation, self.record, self.free)

    def solve(self, starts: Array, guess: Tensor, iterations: int = 25, near: Tensor | None = None) -> Sensitive:
        """The motion near a guess, with derivatives by the parameters.

        Args:
            near: Jacobian of the steps of a motion nearby.
        """
        q0, qdot0 = (torch.from_numpy(starts[..., i].copy()) for i in range(2))
        newton = Newton(iterations, TOLERANCE, rescue=False)
        wrt = {p.name: p.scale for p in self.free}
        return solve(self.simulation, q0, qdot0, guess=guess, wrt=wrt, newton=newton, near=near)

    def normal_at(self, result: Sensitive, values: Array) -> Normal:
        """Residuals and their derivatives along a motion."""
        measured = measured_torque(self.model, self.record, self.free, values)
        return normal_equations(result, self.record, self.free, values, measured)

    def moved(
        self, values: Array, starts: Array, result: Sensitive, step: Array, shift: Array
    ) -> tuple[Array, Array, Tensor]:
        """Values, starts and a guess of the state after a step of the parameters and a shift of the starts (..., S)."""
        change = np.broadcast_to((step * scales(self.free))[..., None, :], (*shift.shape[:-1], len(self.free)))
        both = torch.from_numpy(np.concatenate([change, shift], -1))
        guess = result.motion.state + torch.einsum("...tnkp,...tp->...tnk", result.tangent, both)
        return moved(self.free, values, step), starts + shift, guess

    def fit_at(self, values: Array, starts: Array, guess: Tensor, near: Tensor | None = None) -> "Fit | None":
        """The fit at given values, or None where no motion was found near the guess; see `solve`."""
        here = self.at(values)
        result = here.solve(starts, guess, near=near)
        if not result.gap < TOLERANCE:
            return None
        normal = here.normal_at(result, values)
        return Fit(here.simulation, here.record, here.free, values, starts, normal, result)


@dataclass(frozen=True)
class Fit(Problem):
    """A fitted model: the problem with an answer."""

    values: Array  # the free parameters, (P,)
    starts: Array  # angle and velocity at the start of each trial, (T, 2)
    normal: Normal  # residuals and derivatives at the solution
    sensitive: Sensitive  # the solved motion
    converged: bool = False  # whether the last step gained, or the next one promised, next to nothing

    @property
    def angle(self) -> Array:
        """Simulated [rad], (T, N)."""
        return self.sensitive.motion.angle.numpy()

    @property
    def linear(self) -> Linear:
        return self.sensitive.linear

    @property
    def residual(self) -> Array:
        """Measured - simulated angle, 0 where padded, (T, N) [rad]."""
        return self.normal.residual

    @property
    def rss(self) -> float:
        """Sum of squares of the residual [rad^2]."""
        return float(self.normal.rss)

    @property
    def objective(self) -> float:
        """What the fit lowers [rad^2], see `Normal.objective`."""
        return float(self.normal.objective)

    @property
    def variance(self) -> float:
        """Variance of the residual [rad^2]."""
        return self.normal.variance(self.record.samples)

    @property
    def independent_variance(self) -> float:
        """Variance of what is independent in the residual [rad^2]."""
        return self.variance * correlation_time(self.residual, self.record.samples)

    @property
    def measured_torque(self) -> tuple[Array, Array]:
        """Torque that a dynamometer measured less what the model gives, (F,), and derivatives of the latter by the
        parameters in units of their scales, (F, P), each in units of its error; F is 0 where none measured."""
        count, misfit = len(self.normal.further) - len(self.free), self.record.misfit
        return self.normal.further[:count] / misfit, self.normal.further_slope[:count] / misfit

    @property
    def parameters(self) -> dict[str, float]:
        return {p.name: float(v) for p, v in zip(self.free, self.values, strict=True)}

    def covariance(self) -> Array:
        """Covariance of the free parameters (P, P), SI units: that for white noise times the residual's correlation
        time, less what is known beforehand or by a dynamometer, each with the error that a fit takes it to have.

        A residual is slow where noise is coloured or the physics misses something; many of its samples then say no more
        than one. Coverage of nominal 95 % intervals for four muscle parameters, from white noise to autoregressions
        with a coefficient of 0.98: 0.95 to 1.00 with 4 trials of 500 samples, 0.92 to 0.97 with 3 of 200. A sandwich
        over blocks of 1 s has 0.81 to 0.94, one with the residual's autocovariance 0.87 to 0.96.
        """
        variance = max(self.variance, np.radians(SOLVERS_DEG) ** 2)
        variance *= correlation_time(self.residual, self.record.samples)
        known, (_, slope) = np.diag(expected(self.free)[1]), self.measured_torque
        torque, weight = slope.T @ slope, self.record.misfit**2
        data = self.normal.matrix - known * weight - torque * weight
        return covariance_of(data / variance + known + torque) * np.outer(scales(self.free), scales(self.free))

    def standard_errors(self) -> dict[str, float]:
        return {p.name: float(e) for p, e in zip(self.free, np.sqrt(np.diag(self.covariance())), strict=True)}

    def rmse(self) -> float:
        """Root mean square of the residual [rad]."""
        return float(np.sqrt(self.rss / self.record.samples))

    def weighed(self) -> "Fit":
        """The same, what is known of constants weighed against what the model misses here."""
        # ASSUME: what a model misses is no noise of the angle, and moves constants no further than such noise might.
        # Else they go as far as they may to make up for what is missing.
        beyond = max(self.independent_variance - self.record.noise**2, 0.0)
        found = replace(self, record=replace(self.record, missed=float(np.sqrt(beyond))))
        return replace(found, normal=found.normal_at(found.sensitive, found.values))

    def next_step(self, damping: float = DAMPING) -> tuple[Array, Array]:
        """A damped step of the parameters (P,), in units of their scales, and the shift of the starts with it."""
        step = bounded_step(*self.normal.damped(damping), self.free, self.values, damping)
        return step, self.normal.starts_after(step) / (1 + damping)


@dataclass(frozen=True)
class LiftedSearch(Problem):
    """Where searches stand before their motion is simulated, B of them as one batch."""

    values: Array  # (B, P)
    starts: Array  # angle and velocity at the start of each trial, (B, T, 2)
    guess: Tensor  # the state along each trial, a motion but for gaps, (B, T, N, K)
    error: Array  # `Normal.objective` that the last step started from (B,); infinite before the first

    @classmethod
    def begin(cls, model: Model, record: Record, free: Sequence[Free], values: Array) -> "LiftedSearch":
        """From the measured motion, smoothed, for every row of values (B, P)."""
        problem, measured = Problem.of(model, record, free, values), record.motion.expand(len(values), -1, -1, -1)
        guess = resting_states(problem.simulation, measured[..., 0], measured[..., 1])
        error = np.full(len(values), np.inf)
        return cls(problem.simulation, record, problem.free, values, guess[..., 0, :2].numpy(), guess, error)

    def lifted(self) -> "LiftedSearch":
        """A Gauss-Newton step of the parameters that closes the gaps of the guess at the same time."""
        here = self.at(self.values)
        result = here.solve(self.starts, self.guess, iterations=1)
        normal = here.normal_at(result, self.values)
        step = bounded_step(normal.matrix, normal.vector, self.free, self.values, DAMPING)
        after = self.moved(self.values, self.starts, result, step, normal.starts_after(step))
        return LiftedSearch(here.simulation, self.record, self.free, *after, normal.objective)

    def better_half(self) -> "LiftedSearch":
        """The half, but at least two, whose last step started from the smallest error."""
        keep = np.argsort(self.error, kind="stable")[: max(2, -(-len(self.values) // 2))]  # diverged ones come last
        guess = self.guess[torch.from_numpy(keep)]
        return replace(self, values=self.values[keep], starts=self.starts[keep], guess=guess, error=self.error[keep])

    def fits(self) -> Iterator[Fit | None]:
        """The fit where each search stands, None where no motion is found near its guess."""
        return map(self.fit_at, self.values, self.starts, self.guess)


def fit_model(
    model: Model,
    record: Record,
    free: Sequence[Free],
    *,
    starts: int = 1,
    further: Sequence[Array] = (),
) -> Fit:
    """Fit a model from scratch.

    Args:
        record: all trials in it are fitted.
        starts: searches, the first from `Free.start`, the others up to `Free.spread` away; more from `further` (P,).

    Raises:
        FitError: if the model is not able to move from any of the starts.
    """
    usual = np.array([p.start for p in free])
    around = start_values(free, range(1, starts))
    return fit_from(model, record, free, np.concatenate([usual[None], around, *(v[None] for v in further)]))


def fit_from(model: Model, record: Record, free: Sequence[Free], values: Array) -> Fit:
    """Fit a model from given values (B, P), side by side; raises as `fit_model` does."""
    return min(map(polish, begin_from(model, record, free, values)), key=lambda fit: fit.objective)


def begin_from(model: Model, record: Record, free: Sequence[Free], values: Array) -> list[Fit]:
    """The fits to descend from that searches from given values (B, P) end at, the best first, at most two: which of
    them leads to the lower valley is not seen from there. Raises as `fit_model` does."""
    search = LiftedSearch.begin(model, record, free, values)
    for _ in range(LIFTED_STEPS):
        search = search.lifted().better_half()
    fits = [fit for fit in search.fits() if fit is not None]
    if not fits:
        raise FitError(
            f"model {model.name}: its motion diverges from every start of the fit. Check the units of the recording "
            "and the constants of the arm's muscles."
        )
    return fits


def fit_simulated(model: Model, record: Record, free: Sequence[Free], values: Array) -> Fit | None:
    """Fit a model from the motion that values (P,) simulate from the measured starts; None where they have none."""
    problem, starts = Problem.of(model, record, free, values), record.motion[:, 0].numpy()
    guess = simulate(problem.simulation, *torch.from_numpy(starts).unbind(-1)).state
    begun = problem.fit_at(values, starts, guess)
    return None if begun is None else polish(begun)


def refit(fit: Fit, model: Model, free: Sequence[Free]) -> Fit:
    """Fit a related model from where another fit ended.

    Args:
        fit: parameters that both have start from here; others from `Free.start`.
        model: with effects added or taken away.
    """
    known, guess = fit.parameters, fit.sensitive.motion.state
    values = within(free, np.array([known.get(p.name, p.start) for p in free]))
    problem = Problem.of(model, fit.record, free, values)
    if model.stateful != fit.model.stateful:
        guess = resting_states(problem.simulation, guess[..., 0], guess[..., 1])
    begun = problem.fit_at(values, fit.starts, guess)
    return fit_model(model, fit.record, free) if begun is None else polish(begun)


def polish(fit: Fit) -> Fit:
    """The fit at the end of its descent."""
    *_, last = descend(fit)
    return last


def descend(fit: Fit) -> Iterator[Fit]:
    """Levenberg-Marquardt: the fit as it is, then after each step, each no worse than the one before.

    What is known of constants is weighed anew after each step against what the model misses there. So the sequence
    lowers n log(sum of squares) + the constants' squared distance, in standard deviations, from what is expected: minus
    twice the posterior where a misfit of n independent samples has a variance that nobody knows (majorisation: the
    logarithm is below its tangents).

    A full step along a curved valley may land on its slope; the next steps from there lead back to the floor, further
    on. So a step that promises more than a residual variance and fails gets these before it is given up (Chamberlain et
    al. 1982, the "watchdog" technique). A step that gains less than `LITTLE` is the last.
    """
    damping, settled = DAMPING, fit.converged

    def attempts(fit: Fit) -> Iterator[Fit | None]:
        nonlocal damping, settled
        while not settled:
            step = fit.next_step(damping)
            promise = fit.normal.gain(*step)
            if settled := promise < GAIN * fit.variance:
                yield fit
                return
            tried = take_step(fit, *step)
            kept = tried is not None and fit.objective - tried.objective > KEEPS * promise
            if promise > fit.variance and fit.record.pieces is None and not fit.model.stateful:
                tried = _follow(fit, tried, damping)  # in pieces, and with states, a shorter step costs less
            if tried is not None and tried.objective < fit.objective:
                settled = fit.objective - tried.objective < 2 * LITTLE * tried.independent_variance
                damping = max(damping * DAMPING_DOWN, 1e-12) if kept else damping
            yield tried
            if damping > DAMPING_MOST:
                return
            damping = max(damping, DAMPING) * DAMPING_UP

    descent = least_squares.descend(fit, lambda fit: fit.objective, attempts, STEPS, arrive=Fit.weighed)
    for found in islice(descent, 1 + STEPS):
        yield replace(found, converged=settled)


def _follow(fit: Fit, tried: Fit | None, damping: float) -> Fit | None:
    """What a failed step leads to in a few more, as long as each lowers the objective."""
    limit = WATCHDOG * fit.objective
    for _ in range(WATCHDOG_STEPS):
        if tried is None or tried.objective < fit.objective or tried.objective > limit:
            break
        limit = tried.objective
        tried = take_step(tried, *tried.next_step(damping))
    return tried


def take_step(fit: Fit, step: Array, shift: Array) -> Fit | None:
    """The fit after a step, or None where no motion was found there."""
    return fit.fit_at(*fit.moved(fit.values, fit.starts, fit.sensitive, step, shift), fit.linear.jacobian)
