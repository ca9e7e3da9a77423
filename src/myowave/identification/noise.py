"""Noise: the least there is, what a residual shows of it, and how many samples are worth an independent one.

Shapes: T trials, N samples.
"""

from collections.abc import Sequence

import numpy as np

from myowave.data.knots import knots_of, values_at
from myowave.data.trials import Array
from myowave.data.wavelets import FEWEST_OF_NOISE, estimate_noise

# ASSUME: no goniometer is better than this, and no model need be: structure below it is not chased.
SMALLEST_NOISE_DEG = 0.05
BOUND = 1.1  # times that: an estimate no larger is of noise less than half as strong, to which the smallest was added
# ASSUME: two programs that integrate and interpolate the same equations differ by about this much (0.001 to 0.003 deg
# on trials of another simulator), so no parameter is known better than a noise of this size allows.
SOLVERS_DEG = 0.005


def noise_of(angles: Sequence[Array], known_deg: float | None) -> float:
    """Standard deviation of the noise of measured angles, (N_i,) each [rad]: known, else what they show of it."""
    noise = roughness_of(angles) if known_deg is None else np.radians(known_deg)
    return max(float(noise), float(np.radians(SMALLEST_NOISE_DEG)))


def roughness_of(signals: Sequence[Array]) -> float:
    """Standard deviation of the noise that measured signals, (N_i,) each, show in their finest scales, resampled along
    straight lines from those of the values that were measured."""
    knots = knots_of(signals)
    if knots is not None and min(map(len, knots)) >= FEWEST_OF_NOISE + 2:
        signals = [values_at(at, x)[1:-1] for x, at in zip(signals, knots, strict=True)]
    return float(estimate_noise(*signals))


def correlation_time(residual: Array, samples: int) -> float:
    """How many samples of a residual (T, N), 0 where padded, are worth one independent sample; 1 for white noise.

    1 + 2 (sum of the autocorrelation up to its first value within the scatter of white noise).

    Args:
        samples: of it that count.
    """
    spectrum = np.fft.rfft(residual, 2 * residual.shape[-1], axis=-1)
    lags = np.fft.irfft(np.abs(spectrum) ** 2, axis=-1)[..., : residual.shape[-1]].sum(0)
    correlation = lags / max(lags[0], 1e-300)
    inside = np.flatnonzero(correlation < 2 / np.sqrt(samples))
    last = inside[0] if len(inside) else len(correlation)
    return float(1 + 2 * correlation[1:last].sum())
