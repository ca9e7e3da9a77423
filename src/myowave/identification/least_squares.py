"""Linear least squares of a fit, and the loop of damped steps within bounds.

The angle and velocity at the start of each trial belong to one trial each, so they are eliminated trial by trial.

Shapes: ... batch (starts of the search), T trials, N samples, C columns, P free parameters, S = 2 numbers of a trial's
start, F further residuals, R residuals in all.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from torch import Tensor

from myowave.data.trials import Array
from myowave.identification.free_parameters import Free, bounds, expected, moved, scales
from myowave.identification.record import Record
from myowave.physics.trajectory import Sensitive

Point = TypeVar("Point")
Residual = Callable[[Array], Array]  # of parameters (..., P), (..., R)


class FitError(ValueError):
    """There is no fit: no motion is found, nothing tells what is fitted, or sums are not finite."""


LARGEST = 1e6  # of residuals [rad] and slopes: where a motion diverges, its sums are large and not infinite
NEGLIGIBLE = 1e-14  # eigenvalues below this share of the largest are rounding
UNSEEN = 1e-12  # the same, of what imitates an effect
NUDGE = 1e-5  # in units of the scales, for differences
LITTLE = 0.3  # nats: about what a step has to gain for another to be tried after it
TRIES = 5  # of a step and those along its bend
LENGTHS, SHORTER = np.geomspace(0.03, 0.7, 40), 0.25  # beside the one before; and where nothing is known of the bend
DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-9, 1e9  # relative to the diagonal of the normal matrix


def gain_of(
    information: Array, product: Array, low: Array | float = -np.inf, high: Array | float = np.inf
) -> tuple[Array, float]:
    """The best values (E,) of parameters that act on a residual by a signal (R, E), and by how much they lower its sum
    of squares, at least 0.

    Args:
        information, product: signal^T signal (E, E) and signal^T residual (E,).
        low, high: bounds of the parameters, () or (E,).
    """
    least = 1e-9 * np.trace(information) + 1e-300  # where columns are alike none of them is to be large
    estimate = minimise_within(information + least * np.eye(len(product)), product, np.asarray(low), np.asarray(high))
    return estimate, max(float(2 * estimate @ product - estimate @ information @ estimate), 0.0)


@dataclass(frozen=True)
class Normal:
    """Residuals and their derivatives, parameters in units of their scale, and the normal equations of these."""

    residual: Array  # measured - simulated angle, 0 where padded, (..., T, N)
    slope: Array  # d angle / d parameter, (..., T, N, P), and `by_start` (..., T, N, S)
    by_start: Array
    # further, further_slope: residuals that no start changes, (..., F) and (..., F, P) [rad]: torque that a dynamometer
    # measured, and how far each parameter is from where it is expected, weighed as a sample
    further: Array
    further_slope: Array
    # how far each number of a start is from where it was measured, (..., T, S), and what that weighs, (T, S)
    start_left: Array
    start_weight: Array

    @cached_property
    def matrix(self) -> Array:
        """That of the normal equations, the starts eliminated, (..., P, P)."""
        # By einsum, whose sums are the same with any number of threads.
        unmatched = _stacked(self.without_starts(self.slope), self.further_slope)
        return np.einsum("...rp,...rq->...pq", unmatched, _stacked(self.slope, self.further_slope))

    @cached_property
    def vector(self) -> Array:
        """Their right side, (..., P)."""
        shift = self.starts_after(np.zeros(self.slope.shape[-1]))
        unmatched = self.residual[..., None] - self.by_start @ shift[..., None]
        left = _stacked(unmatched, self.further[..., None])[..., 0]
        return np.einsum("...rp,...r->...p", _stacked(self.slope, self.further_slope), left)

    @cached_property
    def rss(self) -> Array:
        """Sum of squares of the residual (...) [rad^2]."""
        return np.asarray((self.residual**2).sum((-1, -2)))

    @property
    def objective(self) -> Array:
        """What a fit lowers, (...) [rad^2]: the sum of squares of all residuals."""
        return self.rss + (self.further**2).sum(-1) + (self.start_weight * self.start_left**2).sum((-1, -2))

    def variance(self, samples: int) -> float:
        """Variance of the noise that the residual of so many samples shows [rad^2]; what was fitted is counted off, of
        each parameter the share that comes from the residual and not from what else is known of it."""
        of_residual = self.matrix - self.further_slope.T @ self.further_slope
        of_starts = onto_starts(self.by_start, self.by_start, self.start_weight).trace(axis1=-1, axis2=-2).sum()
        fitted = float(np.trace(pseudo_inverse(self.matrix) @ of_residual) + of_starts)
        return float(self.rss) / max(samples - fitted, 1.0)

    def without_starts(self, columns: Array) -> Array:
        """The part of columns (..., T, N, C) that no change of the trials' starts can imitate."""
        return columns - self.by_start @ onto_starts(self.by_start, columns, self.start_weight)

    def starts_after(self, step: Array) -> Array:
        """The best change of the trials' starts (..., T, S) given a step of the parameters (..., P)."""
        left = self.residual[..., None] - self.slope @ step[..., None, :, None]
        return onto_starts(self.by_start, left, self.start_weight, self.start_left[..., None])[..., 0]

    def damped(self, damping: float) -> tuple[Array, Array]:
        """`matrix` and `vector` where the changes of the starts are damped like the parameters, between those with the
        starts eliminated and those with the starts held."""
        share = damping / (1 + damping)
        slope = _stacked(self.slope, self.further_slope)
        left = _stacked(self.residual[..., None], self.further[..., None])[..., 0]
        matrix, vector = slope.T @ slope, slope.T @ left
        return self.matrix + share * (matrix - self.matrix), self.vector + share * (vector - self.vector)

    def gain(self, step: Array, shift: Array) -> float:
        """How much a step of the parameters (P,) and a shift of the starts (T, S) would lower the objective, to first
        order."""
        left = self.residual - self.slope @ step - (self.by_start @ shift[..., None])[..., 0]
        further = self.further - self.further_slope @ step
        starts = self.start_weight * (self.start_left - shift) ** 2
        return float(self.objective - (left**2).sum() - (further**2).sum() - starts.sum())

    def beyond(self, columns: Array) -> tuple[Array, Array]:
        """What only further parameters can do, given those fitted and the starts of the trials.

        Args:
            columns: derivatives of the angle by them, (T, N, E).

        Returns:
            Their part that nothing else imitates, (R, E), at the T N samples, the F further residuals and the numbers
            of starts one below the other, as `left` has what it may explain; and the imitation by the fitted
            parameters, (P, E).
        """
        cross = np.einsum("tnp,tne->pe", self.slope, self.without_starts(columns))
        imitation = pseudo_inverse(self.matrix, UNSEEN) @ cross
        beside = columns - self.slope @ imitation
        starts = -np.sqrt(self.start_weight)[..., None] * onto_starts(self.by_start, beside, self.start_weight)
        further = np.concatenate([-self.further_slope @ imitation, starts.reshape(-1, columns.shape[-1])])
        return _stacked(self.without_starts(beside), further), imitation

    @property
    def left(self) -> Array:
        """All residuals one below the other, (R,)."""
        starts = np.sqrt(self.start_weight) * self.start_left
        return np.concatenate([self.residual.ravel(), self.further, starts.ravel()])

    def extended(self, columns: Array) -> "Normal":
        """The same with more parameters, from their derivatives in units of their scale, (T, N, E)."""
        more = columns.shape[-1]
        return replace(
            self,
            slope=np.concatenate([self.slope, columns], -1),
            further_slope=np.pad(self.further_slope, ((0, 0), (0, more))),
        )


def _stacked(samples: Array, further: Array) -> Array:
    """Rows (..., R, C) of samples (..., T, N, C), one trial below the other, and of further residuals (..., F, C)."""
    *batch, trials, each, columns = samples.shape
    return np.concatenate([samples.reshape(*batch, trials * each, columns), further], -2)


def onto_starts(by_start: Array, columns: Array, weight: Array, measured: Array | float = 0.0) -> Array:
    """Changes of the trials' starts (..., T, S, C) that come nearest to columns (..., T, N, C).

    Args:
        by_start: d angle / d (angle, velocity) at each trial's start, (..., T, N, S).
        weight: of what was measured of them, (T, S), and the changes that lead there, `measured` (..., T, S, C).
    """
    transposed, known = np.swapaxes(by_start, -1, -2), weight[..., None]
    matrix = transposed @ by_start + known * np.eye(by_start.shape[-1])
    return pseudo_inverse(matrix) @ (transposed @ columns + known * measured)


def normal_equations(
    result: Sensitive,
    record: Record,
    free: Sequence[Free],
    values: Array,
    measured: tuple[Array, Array] | None = None,
) -> Normal:
    """Residuals of a motion and the normal equations.

    Args:
        values: of the parameters, (..., P).
        measured: what else was measured: residuals (..., F) and derivatives of what is modelled (..., F, P), in units
            of its error.
    """
    # A start from which the motion diverges must not spoil the others in the batch.
    residual = np.where(record.valid, limited(record.angle - result.motion.angle.numpy()), 0.0)
    slope = scaled_slope(result.by_parameter, scales(free), record.valid)
    by_start = scaled_slope(result.by_start, 1.0, record.valid)
    usual, weight = expected(free)
    weight = weight * record.misfit**2
    further = np.sqrt(weight) * (usual - values) / scales(free)
    further_slope = np.broadcast_to(np.diag(np.sqrt(weight)), (*further.shape, len(free)))
    if measured is not None:
        further = np.concatenate([measured[0] * record.misfit, further], -1)
        further_slope = np.concatenate([measured[1] * record.misfit, further_slope], -2)
    started = record.motion[:, 0].numpy() - result.motion.state[..., 0, :2].numpy()
    of_start = (record.misfit / record.start_error) ** 2
    return Normal(residual, slope, by_start, further, further_slope, started, of_start)


def limited(values: Array) -> Array:
    """Values no larger than `LARGEST`, which stands for what is no number any more."""
    return np.nan_to_num(values, nan=LARGEST).clip(-LARGEST, LARGEST)


def scaled_slope(derivatives: Tensor, scale: Array | float, valid: NDArray[np.bool_]) -> Array:
    """d angle / d parameter (P, ..., T, N) in units of the scales, (..., T, N, P); 0 where padded, never infinite."""
    slope = np.nan_to_num(np.moveaxis(derivatives.numpy(), 0, -1)).clip(-LARGEST, LARGEST)
    return (slope * scale * valid[..., None]).clip(-LARGEST, LARGEST)


def correlations(covariance: Array) -> Array:
    """Correlations of estimates from their covariance, (P, P); 0 for those without any."""
    size = np.sqrt(np.diag(covariance)).clip(1e-150)  # whose square is still above 0
    return covariance / np.outer(size, size)


def linearise(residual: Residual, free: Sequence[Free], values: Array) -> tuple[Array, Array]:
    """Residual (..., R) at values (..., P) and its derivatives (..., R, P) by parameters in units of their scales."""
    bumps = np.concatenate([np.zeros((1, len(free))), NUDGE * np.diag(scales(free))])
    found = residual(values + bumps.reshape(-1, *(1,) * (values.ndim - 1), len(free)))
    return found[0], np.moveaxis((found[1:] - found[0]) / NUDGE, 0, -1)


def descend(
    begin: Point,
    objective: Callable[[Point], float],
    attempts: Callable[[Point], Iterable[Point | None]],
    steps: int,
    little: float = 0.0,
    arrive: Callable[[Point], Point] = lambda point: point,
) -> Iterator[Point]:
    """The loop of every fit: of what is tried from a point, the first that lowers the objective is the next point.

    Args:
        attempts: from a point, one after the other, each with a shorter step; None where it leads nowhere.
        steps: that are taken at most; one that lowers the objective by less than `little` is the last.
        arrive: what a point becomes before steps are taken from it, with another objective.

    Yields:
        Where it begins, and after each attempt where it stands.
    """
    point = arrive(begin)
    yield point
    for _ in range(steps):
        gained, now = 0.0, objective(point)
        for tried in attempts(point):
            if tried is not None and (then := objective(tried)) < now:
                gained, point = now - then, arrive(tried)
            yield point
            if gained:
                break
        if gained <= little:
            return


def along_bend(
    straight: Array,
    take: Callable[[Array], Point | None],
    bend: Callable[[Point, Array], tuple[Array, Array]],
) -> Iterator[Point | None]:
    """Where a step leads and, should that not do, where shorter ones lead along the curve that it should have followed.

    What a step leaves beside its promise tells how the motion bends along it, and so which way to lean and how far to
    go, to second order. The floor of a narrow, curved valley is followed in this way in few long steps.

    Args:
        straight: the step to first order, (C,).
        take: the point that a step leads to; None where it leads nowhere.
        bend: of a point and the step that led there: the step (C,) that meets what came out beside the promise, and
            the inner products (3, 3) of the residuals before, what `straight` takes from them, and what no step meets.

    Source: geodesic acceleration, Transtrum & Sethna 2012, arXiv:1201.5885; here from points that were tried anyway.
    """
    length, step = 1.0, straight
    for _ in range(TRIES):
        tried = take(step)
        yield tried
        share, lean = SHORTER, 0.0 * straight
        if tried is not None:
            aside, products = bend(tried, step)
            parts = np.stack([LENGTHS**0, -length * LENGTHS, LENGTHS**2])
            squares = np.einsum("it,ij,jt->t", parts, products, parts)
            if squares.min() < products[0, 0]:
                share, lean = float(LENGTHS[squares.argmin()]), aside
        length, step = length * share, length * share * straight + share**2 * lean


def search(residual: Residual, free: Sequence[Free], values: Array, steps: int, little: float = 0.0) -> Iterator[Array]:
    """Levenberg-Marquardt steps of B searches side by side, each taken where it lowers its sum of squares.

    Args:
        values: where the searches start, (B, P).
        steps, little: see `descend`, of all sums of squares together.

    Yields:
        After each attempt, (B, P).
    """
    damping = np.full(len(values), DAMPING)

    def attempts(at: tuple[Array, Array]) -> Iterator[tuple[Array, Array]]:
        nonlocal damping
        values, squares = at
        now, slope = linearise(residual, free, values)
        transposed = np.swapaxes(slope, -1, -2)
        vector = -(transposed @ now[..., None])[..., 0]
        while (damping < MOST_DAMPING).any():
            proposed = moved(free, values, bounded_step(transposed @ slope, vector, free, values, damping))
            found = (residual(proposed) ** 2).sum(-1)
            better = found < squares
            damping = np.where(better, damping / 10, damping * 10).clip(LEAST_DAMPING, MOST_DAMPING)
            yield np.where(better[:, None], proposed, values), np.where(better, found, squares)

    begin = values, (residual(values) ** 2).sum(-1)
    descent = descend(begin, lambda at: float(at[1].sum()), attempts, steps, little)
    return (values for values, _ in islice(descent, 1, None))


def bounded_step(matrix: Array, vector: Array, free: Sequence[Free], values: Array, damping: Array | float) -> Array:
    """Damped Gauss-Newton (Levenberg-Marquardt) step (..., P) in units of the scales, within the bounds.

    Args:
        matrix, vector: the normal equations in units of the scales, (..., P, P) and (..., P).
        values: where the step starts, (..., P).
        damping: relative to the diagonal of the matrix, () or (...).
    """
    low, high = bounds(free)
    diagonal = np.einsum("...pp->...p", matrix)
    ridge = np.asarray(damping)[..., None] * diagonal + 1e-14 * diagonal.max(-1, initial=0.0, keepdims=True) + 1e-12
    damped = matrix + np.eye(len(free)) * ridge[..., None]
    return minimise_within(damped, vector, (low - values) / scales(free), (high - values) / scales(free))


def minimise_within(matrix: Array, vector: Array, lowest: Array, highest: Array) -> Array:
    """The x (..., P) between two bounds (..., P) that minimises x^T matrix x / 2 - vector^T x.

    Args:
        matrix: symmetric, positive semidefinite, (..., P, P); it may be singular.
        vector: (..., P).
    """
    found = (pseudo_inverse(matrix) @ vector[..., None])[..., 0]
    outside = ((found < lowest) | (found > highest)).any(-1)
    lowest, highest = np.broadcast_to(lowest, found.shape), np.broadcast_to(highest, found.shape)
    for i in map(tuple, np.argwhere(outside)):
        # As a small least-squares problem with the same normal equations.
        values, vectors = np.linalg.eigh(matrix[i])
        root = np.sqrt(values.clip(NEGLIGIBLE * max(values[-1], 1e-300)))
        within = (lowest[i], highest[i])
        found[i] = lsq_linear(root[:, None] * vectors.T, vectors.T @ vector[i] / root, within, method="bvls").x
    return found.clip(lowest, highest)


def covariance_of(information: Array) -> Array:
    """Covariance of values of which so much is known, (P, P). What nothing is said about is not known at all: a
    pseudo-inverse would give it no error."""
    values, vectors = np.linalg.eigh(information)
    return np.asarray((vectors / values.clip(NEGLIGIBLE * values.max(initial=1.0))) @ vectors.T)


def pseudo_inverse(matrix: Array, negligible: float = NEGLIGIBLE) -> Array:
    """Inverse of symmetric positive semidefinite matrices (..., P, P), 0 in the directions that they say nothing about:
    those with eigenvalues below a `negligible` share of the largest."""
    values, vectors = np.linalg.eigh(matrix)
    sound = values > negligible * values[..., -1:]
    inverse = np.where(sound, 1 / np.where(sound, values, 1.0), 0.0)
    return (vectors * inverse[..., None, :]) @ np.swapaxes(vectors, -1, -2)
