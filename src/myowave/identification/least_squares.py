"""Linear least squares of a fit: the starts of the trials eliminated, and damped Gauss-Newton steps within bounds.

The angle and velocity at the start of each trial belong to one trial each, so they are eliminated trial by trial.

Shapes: ... batch (starts of the search), T trials, N samples, C columns, P free parameters, S numbers of a trial's
start (1 or 2).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from torch import Tensor

from myowave.identification.free_parameters import Free, bounds, expected, scales
from myowave.identification.noise import residual_variance
from myowave.identification.record import Record
from myowave.physics.trajectory import Sensitive

Array = NDArray[np.float64]

LARGEST = 1e6  # of residuals [rad] and slopes: where a motion diverges, its sums are large and not infinite
UNSEEN = 1e-12  # the same, of what imitates an effect
NEGLIGIBLE = 1e-14  # eigenvalues below this share of the largest are rounding


@dataclass(frozen=True)
class Gain:
    """What further parameters promise, to first order.

    Args:
        estimate: their best values, (E,).
        fall: of the objective that they promise, at least 0.
        freedom: what it would fall by for noise of variance 1, on average; the number of parameters where nothing is
            known of them and all are seen.
    """

    estimate: Array
    fall: float
    freedom: float


def gain_of(
    information: Array, product: Array, prior: float = 0.0, low: Array | float = -np.inf, high: Array | float = np.inf
) -> Gain:
    """What parameters gain that act on a residual by a signal, (R, E).

    Args:
        information, product: signal^T signal (E, E) and signal^T residual (E,).
        prior: variance of the residual over that of each parameter, which is expected at 0; 0 where nothing is known.
        low, high: bounds of the parameters, () or (E,).
    """
    least = 1e-9 * np.trace(information) + 1e-300  # where columns are alike none of them is to be large
    matrix = information + (prior or least) * np.eye(len(product))
    estimate = minimise_within(matrix, product, np.asarray(low), np.asarray(high))
    fall = 2 * estimate @ product - estimate @ information @ estimate - prior * (estimate**2).sum()
    return Gain(estimate, max(float(fall), 0.0), float(np.trace(pseudo_inverse(matrix) @ information)))


@dataclass(frozen=True)
class Normal:
    """Residuals and their derivatives, the starts of the trials eliminated; parameters in units of their scale.

    Args:
        residual: measured - simulated angle, 0 where padded, (..., T, N); innovations of it, and of the derivatives,
            as the filter of the record gives them.
        slope: d angle / d parameter, (..., T, N, P), and `by_start` (..., T, N, S).
        matrix, vector: the normal equations without the starts, with what is known beforehand, (..., P, P), (..., P).
        rss: sum of squares of the residual (...) [rad^2].
        torque, torque_slope: further residuals that no start of a trial changes, and their derivatives, as a
            dynamometer gives them, (..., R) and (..., R, P) [rad].
        weight: of what is known of each parameter beforehand, (P,) [rad^2], and how far each is `off` from there,
            expected - value, (..., P).
    """

    residual: Array
    slope: Array
    by_start: Array
    matrix: Array
    vector: Array
    rss: Array
    weight: Array
    off: Array
    torque: Array = field(default_factory=lambda: np.zeros(0))
    torque_slope: Array | None = None

    @property
    def objective(self) -> Array:
        """What a fit lowers, (...) [rad^2]: the sum of squares, and how far parameters are from where they are
        expected, weighed as if the expectations were further samples."""
        return self.rss + (self.torque**2).sum(-1) + (self.weight * self.off**2).sum(-1)

    @property
    def data(self) -> Array:
        """The matrix without what is known beforehand, (..., P, P)."""
        return self.matrix - np.eye(len(self.weight)) * self.weight

    @property
    def fitted(self) -> float:
        """How many independent values of the residual were fitted: one by each number of a start, and the less by a
        parameter the better it is known beforehand (the trace of the hat matrix)."""
        trials, _, numbers = self.by_start.shape[-3:]
        return trials * numbers + float(np.trace(pseudo_inverse(self.matrix) @ self.data))

    def variance(self, samples: int) -> float:
        """Variance of the noise that the residual of so many samples shows [rad^2]."""
        trials, _, numbers = self.by_start.shape[-3:]
        return residual_variance(float(self.rss), samples, self.slope.shape[-1] + trials * numbers)

    def without_starts(self, columns: Array) -> Array:
        """The part of columns (..., T, N, C) that no change of the trials' starts can imitate."""
        return without_starts(self.by_start, columns)

    def starts_after(self, step: Array) -> Array:
        """The best change of the trials' starts (..., T, S) given a step of the parameters (..., P)."""
        left = self.residual[..., None] - self.slope @ step[..., None, :, None]
        return onto_starts(self.by_start, left)[..., 0]

    def beyond(self, columns: Array) -> tuple[Array, Array]:
        """What only further parameters can do, given those fitted and the starts of the trials.

        Args:
            columns: derivatives of the angle by them, (T, N, E).

        Returns:
            Their part that nothing else imitates, (R, E), at the T N samples and P expectations one below the other,
            as `left` has what it may explain; and the imitation by the fitted parameters, (P, E).
        """
        cross = np.einsum("tnp,tne->pe", self.slope, self.without_starts(columns))
        imitation = pseudo_inverse(self.matrix, UNSEEN) @ cross
        samples = self.without_starts(columns - self.slope @ imitation)
        return _stacked(samples, -np.sqrt(self.weight)[:, None] * imitation), imitation

    @property
    def left(self) -> Array:
        """Residual and, below it, how far parameters are from where they are expected, weighed as samples, (R,)."""
        return _stacked(self.residual, np.sqrt(self.weight) * self.off)

    def extended(self, columns: Array) -> "Normal":
        """The normal equations with more parameters, from their derivatives in units of their scale, (T, N, E)."""
        projected = self.without_starts(columns)
        cross = np.einsum("tnp,tne->pe", self.slope, projected)
        own = np.einsum("tne,tnf->ef", columns, projected)
        return replace(
            self,
            slope=np.concatenate([self.slope, columns], -1),
            matrix=np.block([[self.matrix, cross], [cross.T, own]]),
            vector=np.concatenate([self.vector, np.einsum("tne,tn->e", projected, self.residual)]),
            weight=np.concatenate([self.weight, np.zeros(len(own))]),
            off=np.concatenate([self.off, np.zeros(len(own))]),
        )


def _stacked(samples: Array, expectations: Array) -> Array:
    """Samples (T, N, ...) and expectations (P, ...) one below the other, (R, ...)."""
    flat = samples.reshape(samples.shape[0] * samples.shape[1], *samples.shape[2:])  # there may be no columns
    return np.concatenate([flat, expectations])


def onto_starts(by_start: Array, columns: Array) -> Array:
    """Changes of the trials' starts (..., T, S, C) that come nearest to columns (..., T, N, C)."""
    transposed = np.swapaxes(by_start, -1, -2)
    return pseudo_inverse(transposed @ by_start) @ (transposed @ columns)


def without_starts(by_start: Array, columns: Array) -> Array:
    """The part of columns (..., T, N, C) that no change of the trials' starts can imitate.

    Args:
        by_start: d angle / d (angle, velocity) at each trial's start, (..., T, N, S).
    """
    return columns - by_start @ onto_starts(by_start, columns)


def normal_equations(result: Sensitive, record: Record, free: Sequence[Free], values: Array) -> Normal:
    """Residuals of a motion and the normal equations, the starts of the trials eliminated.

    Args:
        values: of the parameters, (..., P).
    """
    valid = record.valid
    # A start from which the motion diverges must not spoil the others in the batch.
    missed = np.nan_to_num(record.angle - result.motion.angle.numpy(), nan=LARGEST).clip(-LARGEST, LARGEST)
    residual = record.white(np.where(valid, missed, 0.0)[..., None])[..., 0]
    slope = record.white(scaled_slope(result.by_parameter, scales(free), valid))
    by_start = record.white(scaled_slope(result.by_start, 1.0, valid)[..., : 1 if record.at_rest else 2])
    usual, weight = expected(free)
    return gather(residual, slope, by_start, weight * record.noise**2, (usual - values) / scales(free))


def gather(residual: Array, slope: Array, by_start: Array, weight: Array, off: Array) -> Normal:
    """The normal equations of residuals, derivatives and expectations, see `Normal`."""
    projected = without_starts(by_start, slope)
    matrix = np.einsum("...tnp,...tnq->...pq", projected, slope)
    vector = np.einsum("...tnp,...tn->...p", projected, residual)
    matrix, vector = matrix + np.eye(len(weight)) * weight, vector + weight * off
    return Normal(residual, slope, by_start, matrix, vector, (residual**2).sum((-1, -2)), weight, off)


def scaled_slope(derivatives: Tensor, scale: Array | float, valid: NDArray[np.bool_]) -> Array:
    """d angle / d parameter (P, ..., T, N) in units of the scales, (..., T, N, P); 0 where padded, never infinite."""
    slope = np.nan_to_num(np.moveaxis(derivatives.numpy(), 0, -1)).clip(-LARGEST, LARGEST)
    return (slope * scale * valid[..., None]).clip(-LARGEST, LARGEST)


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
    if outside.any():
        lowest, highest = np.broadcast_to(lowest, found.shape), np.broadcast_to(highest, found.shape)
        for i in map(tuple, np.argwhere(outside)):
            found[i] = _minimise_one(matrix[i], vector[i], lowest[i], highest[i])
    return found.clip(lowest, highest)


def _minimise_one(matrix: Array, vector: Array, lowest: Array, highest: Array) -> Array:
    """One problem whose minimum without bounds is outside, as a small least-squares problem with the same normal
    equations."""
    values, vectors = np.linalg.eigh(matrix)
    root = np.sqrt(values.clip(NEGLIGIBLE * max(values[-1], 1e-300)))
    return lsq_linear(root[:, None] * vectors.T, vectors.T @ vector / root, (lowest, highest), method="bvls").x


def pseudo_inverse(matrix: Array, negligible: float = NEGLIGIBLE) -> Array:
    """Inverse of symmetric positive semidefinite matrices (..., P, P), 0 in the directions that they say nothing about:
    those with eigenvalues below a `negligible` share of the largest."""
    values, vectors = np.linalg.eigh(matrix)
    sound = values > negligible * values[..., -1:]
    inverse = np.where(sound, 1 / np.where(sound, values, 1.0), 0.0)
    return (vectors * inverse[..., None, :]) @ np.swapaxes(vectors, -1, -2)
