"""Signals with clocks and rates of their own, brought onto one grid of times."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from myowave.data.processing.filters import low_pass
from myowave.data.processing.sampled import Sampled

_ANTI_ALIAS_ORDER = 8
ANTI_ALIAS = 0.4
"""Corner of the filter before a signal is sampled more coarsely, as a fraction of the new rate."""


def common_grid(
    signals: Sequence[Sampled], clock: Sampled, rate: float | None, cut: tuple[float, float] | None
) -> NDArray[np.float64]:
    """Times [s] of a trial: where all signals were recorded, within the cut.

    Args:
        signals: all of them.
        clock: the one whose times are taken where `rate` is None, and whose start the cut counts from.
        rate: samples a second [Hz]; None takes those of the clock.
        cut: from and to [s] after the start of the clock; None takes all.

    Returns:
        (N,), evenly spaced; empty where the signals have no time in common.
    """
    start, end = max(s.start for s in signals), min(s.end for s in signals)
    if cut is not None:
        start, end = max(start, clock.start + cut[0]), min(end, clock.start + cut[1])
    rate = rate or clock.rate
    # A whole number of steps after the clock's first sample, so that at the clock's rate its own samples are taken.
    first = np.ceil((start - clock.start) * rate - 1e-6)
    last = np.floor((end - clock.start) * rate + 1e-6)
    return clock.start + np.arange(first, last + 1) / rate


def sample_as_it_comes(signal: Sampled, time: NDArray[np.float64]) -> NDArray[np.float64]:
    """A signal at other times [s], (N,), on straight lines between its samples, so that only the next one is needed."""
    # ASSUME: the low-pass of the envelope is all that a coarser grid needs; a filter without lag would look ahead.
    return np.interp(time, signal.time, signal.values)


def sample_at(signal: Sampled, time: NDArray[np.float64]) -> NDArray[np.float64]:
    """A signal at other times [s], by cubic splines; before a coarser grid it is low-passed without lag.

    Args:
        signal: longer than 3 samples.
        time: (N,), evenly spaced, within the signal.
    """
    values, rate = signal.values, (len(time) - 1) / (time[-1] - time[0])
    if rate < 0.99 * signal.rate:
        values = low_pass(values, signal.rate, ANTI_ALIAS * rate, "zero", _ANTI_ALIAS_ORDER)
    elif np.abs((time - signal.start) * signal.rate % 1 - 0.5).min() > 0.5 - 1e-6:
        return values[np.round((time - signal.start) * signal.rate).astype(int)]  # its own samples
    return make_interp_spline(signal.time, values, k=3)(time)
