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
from myowave.identification.record import Record

Array = NDArray[np.float64]

# ASSUME: two programs that integrate and interpolate the same equations differ by about this much (0.001 to 0.003 deg
# on trials of another simulator), so no parameter is known better than a noise of this size allows.
SOLVERS_DEG = 0.005


def covariance(normal: Normal, record: Record, free: Sequence[Free]) -> Array:
    """Covariance of the free parameters (P, P), SI units: that for white noise times the correlation time, less what is
    known beforehand."""
    unit = np.outer(scales(free), scales(free))
    variance = max(residual_variance(normal, record), np.radians(SOLVERS_DEG) ** 2)
    variance *= correlation_time(normal.residual, record)
    beforehand = np.diag(expected(free)[1])
    return pseudo_inverse(normal.data / variance + beforehand) * unit


def residual_variance(normal: Normal, record: Record) -> float:
    """Variance of the noise that a residual shows, the parameters and starts fitted to it counted off [rad^2]."""
    fitted = normal.slope.shape[-1] + normal.by_start.shape[-1] * len(record.names)
    return float(normal.rss) / (record.samples - fitted)


def correlations(covariance: Array) -> Array:
    """Correlations of estimates from their covariance, (P, P); 0 for those that data say nothing about."""
    size = np.sqrt(np.diag(covariance)).clip(1e-150)  # whose square is still above 0
    return covariance / np.outer(size, size)


def correlation_time(residual: Array, record: Record) -> float:
    """How many samples of a residual (T, N) are worth one independent sample; 1 for white noise.

    1 + 2 (sum of the autocorrelation up to its first value within the scatter of white noise).
    """
    return samples_for_one(residual, record.samples)


def samples_for_one(residual: Array, n: int) -> float:
    """The same for a residual (T, N), 0 where padded, of n samples."""
    spectrum = np.fft.rfft(residual, 2 * residual.shape[-1], axis=-1)
    lags = np.fft.irfft(np.abs(spectrum) ** 2, axis=-1)[..., : residual.shape[-1]].sum(0)
    correlation = lags / max(lags[0], 1e-300)
    inside = np.flatnonzero(correlation < 2 / np.sqrt(n))
    last = inside[0] if len(inside) else len(correlation)
    return float(1 + 2 * correlation[1:last].sum())
