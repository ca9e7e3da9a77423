"""Signals sampled at one rate, each with a clock of its own, and how they come onto one grid of times."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.signal import welch

from myowave.data.processing.filters import low_pass
from myowave.data.trials import Array

LINE_HEIGHT = 6.0  # power at a mains frequency over the median of its neighbourhood that counts as a line [-]
_SEGMENT_S = 2.0
_ANTI_ALIAS_ORDER = 8
ANTI_ALIAS = 0.4  # corner of the filter before a signal is sampled more coarsely, as a fraction of the new rate


@dataclass(frozen=True, eq=False)
class Sampled:
    """One signal."""

    values: Array  # (N,), in `unit`
    rate: float  # samples a second [Hz]
    start: float  # time of the first sample [s]
    unit: str  # such as uV, rad, or au for a fraction
    written: str = ""  # unit in the file that it is from

    @property
    def time(self) -> Array:
        """Time of each sample [s], (N,)."""
        return self.start + np.arange(len(self.values)) / self.rate

    @property
    def end(self) -> float:
        return self.start + (len(self.values) - 1) / self.rate

    def between(self, start: float, end: float) -> "Sampled":
        """What was sampled from a time to another [s]."""
        inside = (self.time >= start) & (self.time <= end)
        return replace(self, values=self.values[inside], start=float(self.time[inside.argmax()]))

    @cached_property
    def power(self) -> tuple[Array, Array]:
        """Frequencies [Hz] and power density, by Welch's method with segments of 2 s."""
        return welch(self.values, fs=self.rate, nperseg=min(len(self.values), round(_SEGMENT_S * self.rate)))

    def share_of_power(self, low: float, high: float) -> float:
        """Share of the power from `low` up to `high` [Hz], offset left out; 0 for a signal without any."""
        frequency, density = self.power
        total = density[frequency > 0].sum()
        inside = density[(frequency > 0) & (frequency >= low) & (frequency < high)].sum()
        return float(inside / total) if total > 0 else 0.0

    def line_height(self, frequency: float) -> float:
        """Highest power within 0.5 Hz of a frequency over the median 2 to 10 Hz away from it [-]."""
        frequencies, density = self.power
        away = np.abs(frequencies - frequency)
        line, around = density[away <= 0.5], density[(away >= 2) & (away <= 10)]
        if not len(line) or not len(around) or np.median(around) == 0:
            return 0.0
        return float(line.max() / np.median(around))


def runs_of(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """(start, length) of each stretch of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return [(int(start), int(end - start)) for start, end in zip(edges[::2], edges[1::2], strict=True)]


def common_grid(
    signals: Sequence[Sampled], clock: Sampled, rate: float | None, cut: tuple[float, float] | None
) -> Array:
    """Times [s] of a trial: where all signals were recorded, within the cut.

    Args:
        clock: whose samples are taken where `rate` is None.
        rate: samples a second [Hz].
        cut: from and to, times like those of the signals [s]; None takes all.

    Returns:
        (N,), evenly spaced; empty where the signals have no time in common.
    """
    start, end = max(s.start for s in signals), min(s.end for s in signals)
    if cut is not None:
        start, end = max(start, cut[0]), min(end, cut[1])
    rate = rate or clock.rate
    # A whole number of steps after the clock's first sample, so that at the clock's rate its own samples are taken.
    first = np.ceil((start - clock.start) * rate - 1e-6)
    last = np.floor((end - clock.start) * rate + 1e-6)
    return clock.start + np.arange(first, last + 1) / rate


def sample_at(signal: Sampled, time: Array) -> Array:
    """A signal of 4 samples or more at other times [s], (N,), evenly spaced and within it, by cubic splines; before a
    coarser grid it is low-passed without lag."""
    values, rate = signal.values, (len(time) - 1) / (time[-1] - time[0])
    if rate < 0.99 * signal.rate:
        values = low_pass(signal.rate, ANTI_ALIAS * rate, "zero", _ANTI_ALIAS_ORDER)(values)
    elif np.abs((time - signal.start) * signal.rate % 1 - 0.5).min() > 0.5 - 1e-6:
        return values[np.round((time - signal.start) * signal.rate).astype(int)]  # its own samples
    return make_interp_spline(signal.time, values, k=3)(time)
