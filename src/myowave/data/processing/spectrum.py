"""Power of a signal by frequency: what filters and findings ask of it."""

import numpy as np
from numpy.typing import NDArray
from scipy import signal as sp

LINE_HEIGHT = 6.0
"""Power at a mains frequency over the median of its neighbourhood that counts as a line [-]."""
_SEGMENT_S = 2.0


def power(values: NDArray[np.float64], rate: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequencies [Hz] and power density, by Welch's method with segments of 2 s."""
    return sp.welch(values, fs=rate, nperseg=min(len(values), round(_SEGMENT_S * rate)))


def share_of_power(values: NDArray[np.float64], rate: float, low: float, high: float) -> float:
    """Share of the power from `low` up to `high` [Hz], offset left out; 0 for a signal without any."""
    frequency, density = power(values, rate)
    total = density[frequency > 0].sum()
    inside = density[(frequency > 0) & (frequency >= low) & (frequency < high)].sum()
    return float(inside / total) if total > 0 else 0.0


def line_height(values: NDArray[np.float64], rate: float, frequency: float) -> float:
    """Highest power within 0.5 Hz of a frequency over the median 2 to 10 Hz away from it [-]."""
    frequencies, density = power(values, rate)
    away = np.abs(frequencies - frequency)
    line, around = density[away <= 0.5], density[(away >= 2) & (away <= 10)]
    if not len(line) or not len(around) or np.median(around) == 0:
        return 0.0
    return float(line.max() / np.median(around))
