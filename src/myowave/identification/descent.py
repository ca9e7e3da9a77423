"""Damped Gauss-Newton steps (Levenberg-Marquardt) within bounds, for residuals whose derivatives are differences.

Shapes: B starts of the search, R residuals, P free parameters.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from myowave.identification.free_parameters import Free, expected, moved, scales
from myowave.identification.least_squares import bounded_step

Array = NDArray[np.float64]
Residual = Callable[[Array], Array]  # of parameters (..., P), (..., R)

NUDGE = 1e-5  # in units of the scales, for differences
DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-9, 1e9  # relative to the diagonal of the normal matrix


def linearise(residual: Residual, free: Sequence[Free], values: Array) -> tuple[Array, Array]:
    """Residual (..., R) at values (..., P) and its derivatives (..., R, P) by parameters in units of their scales."""
    bumps = np.concatenate([np.zeros((1, len(free))), NUDGE * np.diag(scales(free))])
    found = residual(values + bumps.reshape(-1, *(1,) * (values.ndim - 1), len(free)))
    return found[0], np.moveaxis((found[1:] - found[0]) / NUDGE, 0, -1)


def descend(residual: Residual, free: Sequence[Free], values: Array) -> Iterator[tuple[Array, Array]]:
    """Steps of searches side by side, each taken where it lowers the objective: the sum of squares, with what is known
    beforehand of parameters as further samples of variance 1.

    Args:
        values: where searches start, (B, P).

    Yields:
        After each step the values (B, P), and by how much the objective fell, 0 where no step was taken, (B,).
    """
    usual, weight = expected(free)
    damping = np.full(len(values), DAMPING)
    now, slope = linearise(residual, free, values)
    while (damping < MOST_DAMPING).any():
        transposed, off = np.swapaxes(slope, -1, -2), (usual - values) / scales(free)
        vector = weight * off - (transposed @ now[..., None])[..., 0]
        step = bounded_step(transposed @ slope + np.diag(weight), vector, free, values, damping)
        proposed = moved(free, values, step)
        nearer = (weight * (off**2 - ((usual - proposed) / scales(free)) ** 2)).sum(-1)
        gained = (now**2).sum(-1) - (residual(proposed) ** 2).sum(-1) + nearer
        better = gained > 0
        damping = np.where(better, damping / 10, damping * 10).clip(LEAST_DAMPING, MOST_DAMPING)
        values = np.where(better[:, None], proposed, values)
        yield values, np.where(better, gained, 0.0)
        if better.any():
            now, slope = linearise(residual, free, values)
