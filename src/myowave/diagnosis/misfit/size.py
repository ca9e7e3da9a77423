"""How much is missing? The residual within the band of the motion, beside the noise just above that band.

Noise of a sensor is as strong where the arm moves as just above, whatever filter the angle has passed since: a filter
that lets the motion through lets that band through. What physics misses is slow, as the motion is. So the noise is not
taken from the finest scales, which a filter empties, and white noise is the special case of a band that goes on.

Shapes: T trials, N samples, F frequencies.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import periodogram
from scipy.stats import f as f_distribution

from myowave.identification.noise import SMALLEST_NOISE_DEG
from myowave.identification.output_error import Fit
from myowave.identification.record import Record

Array = NDArray[np.float64]

ABOVE = (1.5, 3.0)  # just above the band of the motion, in units of its edge
MOTION = 0.99  # share of the motion's power that lies in its band
SIGNIFICANCE = 1e-3
LEAST_RATIO = 1.25  # of powers: what is less is said to be nothing, however many samples there are


@dataclass(frozen=True)
class Size:
    """How large the misfit of a fit is.

    Args:
        noise: of the angle within the band of the motion, as if it were white [rad].
        missing: root mean square of what is slow and not noise [rad]; 0 where there is less than noise would make.
        ratio: of the residual's power density in the band of the motion to that just above [-].
        critical: what this ratio exceeds by chance in 1 of 1000 recordings [-].
        edge_hz: where the band of the motion ends.
        independent: number of independent values in that band, those fitted counted off.
    """

    noise: float
    missing: float
    ratio: float
    critical: float
    edge_hz: float
    independent: float

    @property
    def excess(self) -> float:
        """What is slow and not noise, in variances of independent values [-]."""
        return self.independent * max(self.ratio - 1.0, 0.0)

    @property
    def certain(self) -> float:
        """The same less a standard deviation of what noise gives."""
        return max(self.excess - float(np.sqrt(2 * self.independent)), 0.0)

    @property
    def significant(self) -> bool:
        """Whether something is missing."""
        return self.ratio > max(self.critical, LEAST_RATIO)


def size_of_misfit(fit: Fit) -> Size:
    """Compare the residual of a fit with the noise of the angle."""
    return size_of(fit.residual, fit.angle, fit.record, fit.normal.fitted)


def size_of(residual: Array, motion: Array, record: Record, fitted: float = 0.0, known: float | None = None) -> Size:
    """Compare a residual, or what a filter has made of it, with the noise of the angle.

    Args:
        residual, motion: of every sample (T, N) [rad].
        fitted: number of independent values that were fitted to the residual.
        known: the noise [rad], where the residual holds nothing above that band.
    """
    edge = _edge([*record.joined(motion).values()], record.dt)
    frequency, power = spectrum(residual, record)
    within = power[(frequency > 0) & (frequency <= edge)]
    above = (frequency > ABOVE[0] * edge) & (frequency <= ABOVE[1] * edge)
    beside = power[above]
    floor = np.radians(SMALLEST_NOISE_DEG) ** 2
    free = max(2.0, 2.0 * len(within) - fitted)
    density = within.sum() * 2 / free + floor
    if known is None:
        known = float(np.sqrt(beside.mean())) if len(beside) else 0.0
    noise = known**2 + floor
    critical = float(f_distribution.isf(SIGNIFICANCE, free, max(2.0, 2.0 * len(beside))))
    share = 2 * edge * record.dt  # of all frequencies
    missing = float(np.sqrt(max(density - noise, 0.0) * share))
    return Size(float(np.sqrt(noise)), missing, float(density / noise), critical, edge, free)


def spectrum(values: Array, record: Record) -> tuple[Array, Array]:
    """The frequencies [Hz] of every trial, one trial after the other, and the power of values (T, N) [rad] there, as
    the variance of white noise as strong [rad^2], (F,) each."""
    found = [periodogram(joined, 1 / record.dt, detrend=False) for joined in record.joined(values).values()]
    frequency, power = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return frequency, power / (2 * record.dt)


def _edge(motions: list[Array], dt: float) -> float:
    """Frequency [Hz] below which nearly all of the motion's power is, over all trials."""
    found = []
    for motion in motions:
        frequency, power = periodogram(motion, 1 / dt, window="hann", detrend="linear")
        share = np.cumsum(power) / max(power.sum(), 1e-300)
        found.append(frequency[np.searchsorted(share, MOTION)])
    nyquist = 0.5 / dt
    return float(min(np.mean(found), nyquist / ABOVE[1]))
