"""How sure a fit is of its parameters: standard errors that hold for errors of any colour.

The residual of a fit is slow where noise is coloured or the physics misses something; many of its samples then say no
more than one. The covariance for white noise is therefore taken times the residual's correlation time.

Coverage of nominal 95 % intervals, white noise and first-order autoregressions with coefficients 0.5, 0.9, 0.95 and
0.98, four muscle parameters: with 4 trials of 500 samples 0.95, 0.96, 0.98, 1.00, 1.00; with 3 of 200 samples 0.95,
0.92, 0.93, 0.94, 0.97. A sandwich over blocks of 1 s has too few blocks: 0.93, 0.94, 0.89, 0.91, 0.88 and 0.88, 0.86,
0.84, 0.81, 0.81. One with the residual's autocovariance is closer in the long trials (0.95, 0.96, 0.92, 0.94, 0.94)
and too sure in the short ones (0.95, 0.92, 0.90, 0.88, 0.87).

Shapes: T trials, N samples, P free parameters.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from myowave.identification.free_parameters import Free, expected, scales
from myowave.identification.least_squares import Normal, pseudo_inverse
from myowave.identification.noise import SOLVERS_DEG, correlation_time
from myowave.identification.record import Record

Array = NDArray[np.float64]


def covariance(normal: Normal, record: Record, free: Sequence[Free]) -> Array:
    """Covariance of the free parameters (P, P), SI units: that for white noise times the correlation time, less what is
    known beforehand."""
    unit = np.outer(scales(free), scales(free))
    variance = max(normal.variance(record.samples), np.radians(SOLVERS_DEG) ** 2)
    variance *= correlation_time(normal.residual, record.samples)
    beforehand = np.diag(expected(free)[1])
    return pseudo_inverse(normal.data / variance + beforehand) * unit


def correlations(covariance: Array) -> Array:
    """Correlations of estimates from their covariance, (P, P); 0 for those that data say nothing about."""
    size = np.sqrt(np.diag(covariance)).clip(1e-150)  # whose square is still above 0
    return covariance / np.outer(size, size)
