"""Normal equations of a fit: residuals and their derivatives, the starts of the trials eliminated, and bounded steps.

The angle and velocity at the start of each trial belong to one trial each, so they go trial by trial.

Shapes: B starts of the search, T trials, N samples, P free parameters, S numbers of a trial's start (1 or 2).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from myowave.identification.record import Record
from myowave.physics.trajectory import Sensitive

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Free:
    """A parameter to estimate: where it starts, its bounds, and a usual change of it (the scale of steps)."""

    name: str
    start: float
    low: float
    high: float
    scale: float
    spread: float = 0.0  # further starts are up to this fraction away


@dataclass(frozen=True)
class Normal:
    """Residuals and their derivatives, the starts of the trials eliminated; parameters in units of their scale.

    Args:
        residual: measured - simulated angle, 0 where padded, (..., T, N).
        slope: d angle / d parameter, (..., T, N, P), and `by_start` (..., T, N, S).
        matrix, vector: the normal equations without the starts, (..., P, P) and (..., P).
        rss: sum of squares of the residual (...).
    """

    residual: Array
    slope: Array
    by_start: Array
    matrix: Array
    vector: Array
    rss: Array

    def without_starts(self, columns: Array) -> Array:
        """The part of columns (..., T, N, C) that no change of the trials' starts can imitate."""
        return columns - self.by_start @ self._onto_starts(columns)

    def starts_after(self, step: Array) -> Array:
        """The best change of the trials' starts (..., T, S) beside a step of the parameters (..., P)."""
        left = self.residual[..., None] - self.slope @ step[..., None, :, None]
        return self._onto_starts(left)[..., 0]

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
        )

    def _onto_starts(self, columns: Array) -> Array:
        transposed = np.swapaxes(self.by_start, -1, -2)
        gram = transposed @ self.by_start
        return np.linalg.solve(gram + 1e-12 * np.eye(gram.shape[-1]), transposed @ columns)


def normal_equations(result: Sensitive, record: Record, free: Sequence[Free]) -> Normal:
    """Residuals of a motion and the normal equations, the starts of the trials eliminated."""
    valid = record.valid
    scale = np.array([p.scale for p in free])
    # A start from which the motion diverges must not spoil the others in the batch: its sums become infinite.
    residual = np.where(valid, np.nan_to_num(record.angle - result.motion.angle.numpy(), nan=1e6).clip(-1e6, 1e6), 0.0)
    slope, by_start = scaled_slope(result.by_parameter, scale, valid), scaled_slope(result.by_start, 1.0, valid)
    by_start = by_start[..., :1] if record.at_rest else by_start
    parts = Normal(residual, slope, by_start, slope, residual, (residual**2).sum((-1, -2)))
    projected = parts.without_starts(slope)
    matrix = np.einsum("...tnp,...tnq->...pq", projected, slope)
    vector = np.einsum("...tnp,...tn->...p", projected, residual)
    return replace(parts, matrix=matrix, vector=vector)


def bounded_step(normal: Normal, free: Sequence[Free], values: Array, damping: float) -> Array:
    """Damped step (..., P) in units of the scales that stays within the bounds.

    Parameters that a step would carry over a bound stop there, and the others move with that in mind.
    """
    scale, low, high = (np.array([getattr(p, n) for p in free]) for n in ("scale", "low", "high"))
    lowest, highest = (low - values) / scale, (high - values) / scale
    diagonal = np.einsum("...pp->...p", normal.matrix)
    ridge = damping * diagonal + 1e-14 * diagonal.max(-1, initial=0.0, keepdims=True) + 1e-12
    damped = normal.matrix + np.eye(len(free)) * ridge[..., None]
    step = np.linalg.solve(damped, normal.vector[..., None])[..., 0]
    for _ in free:
        fixed = (step <= lowest) | (step >= highest)
        if not fixed.any():
            break
        held = np.where(fixed, step.clip(lowest, highest), 0.0)
        loose = ~fixed
        reduced = np.where(loose[..., :, None] & loose[..., None, :], damped, np.eye(len(free)))
        right = np.where(loose, normal.vector - (damped @ held[..., None])[..., 0], held)
        new = np.linalg.solve(reduced, right[..., None])[..., 0]
        if np.allclose(new, step, rtol=0, atol=1e-12):
            break
        step = new
    return step.clip(lowest, highest)


def scaled_slope(derivatives: Tensor, scale: Array | float, valid: NDArray[np.bool_]) -> Array:
    """d angle / d parameter (P, ..., T, N) in units of the scales, (..., T, N, P); 0 where padded, never infinite."""
    slope = np.nan_to_num(np.moveaxis(derivatives.numpy(), 0, -1)).clip(-1e6, 1e6)
    return (slope * scale * valid[..., None]).clip(-1e6, 1e6)
