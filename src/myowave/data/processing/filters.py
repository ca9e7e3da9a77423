"""Butterworth filters whose corner is where it is said to be, forwards and backwards or in real time.

A filter that runs twice, forwards and backwards, has no lag, but it attenuates twice: at the corner 1/2 is left instead
of 1/sqrt(2). The corner is moved so that 1/sqrt(2) is left there in both cases (Winter 2009, Biomechanics and Motor
Control of Human Movement, Sec. 2.2.4.4), exactly, on the frequency axis of the bilinear transform.
"""

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import signal as sp

from myowave.data.processing.spectrum import LINE_HEIGHT, line_height

Phase = Literal["zero", "causal"]

BAND_ORDER = 4
ENVELOPE_ORDER = 2
NOTCH_QUALITY = 30.0
"""Frequency over width of the notch [-]."""
HIGHEST = 0.45
"""Highest corner of a filter, as a fraction of the sampling rate."""


def band_pass(values: NDArray[np.float64], rate: float, band: tuple[float, float], phase: Phase) -> NDArray[np.float64]:
    """What lies within a band; its upper end is lowered to 0.45 of the rate where it is above.

    Args:
        values: (N,), any unit.
        rate: samples a second [Hz].
        band: the two frequencies [Hz] at which 1/sqrt(2) of the amplitude is left.
        phase: zero, or causal.
    """
    return _apply(band_sections(rate, band, phase), values, phase)


def band_sections(rate: float, band: tuple[float, float], phase: Phase) -> NDArray[np.float64]:
    """Second-order sections (n, 6) of `band_pass`."""
    low, high = (math.tan(math.pi * f / rate) for f in upper_limited(band, rate))
    width = (high - low) / _narrowing(BAND_ORDER, phase)
    centre = low * high
    low = math.hypot(width / 2, math.sqrt(centre)) - width / 2  # the band is widened about its own centre
    corners = [math.atan(x) / math.pi * rate for x in (low, low + width)]
    return sp.butter(BAND_ORDER, corners, "bandpass", fs=rate, output="sos")


def upper_limited(band: tuple[float, float], rate: float) -> tuple[float, float]:
    """The band that can be had at a sampling rate [Hz]."""
    return band[0], min(band[1], HIGHEST * rate)


def low_pass(
    values: NDArray[np.float64], rate: float, corner: float, phase: Phase, order: int = ENVELOPE_ORDER
) -> NDArray[np.float64]:
    """What lies below a corner [Hz], at which 1/sqrt(2) of the amplitude is left; see `band_pass`.

    A causal filter starts as if the mean of its first lag had gone on forever before.
    """
    sections = low_sections(rate, corner, phase, order)
    if phase == "zero":
        return sp.sosfiltfilt(sections, values, padtype="even")
    first = values[: max(1, round(lag_s(corner, order) * rate))].mean()
    return _forwards(sections, values, first)


def low_sections(rate: float, corner: float, phase: Phase, order: int = ENVELOPE_ORDER) -> NDArray[np.float64]:
    """Second-order sections (n, 6) of `low_pass`."""
    moved = math.atan(math.tan(math.pi * corner / rate) / _narrowing(order, phase)) / math.pi * rate
    return sp.butter(order, moved, fs=rate, output="sos")


def lag_s(corner: float, order: int = ENVELOPE_ORDER) -> float:
    """Time [s] by which a causal low-pass of a corner [Hz] delays what changes slowly.

    The group delay at 0 Hz of an analog Butterworth filter; at order 2 and 4 Hz it is 56 ms.
    """
    poles = [math.sin(math.pi * (2 * k + 1) / (2 * order)) for k in range(order)]
    return sum(poles) / (2 * math.pi * corner)


def notch(
    values: NDArray[np.float64], rate: float, frequency: float, phase: Phase, hum: bool | None = None
) -> NDArray[np.float64]:
    """The signal without mains hum at `frequency` [Hz]; where there is no line to take out, as it is.

    Args:
        hum: whether there is a line; None looks for one in the whole signal.
    """
    there = has_hum(values, rate, frequency) if hum is None else hum
    return _apply(notch_sections(rate, frequency), values, phase) if there else values


def has_hum(values: NDArray[np.float64], rate: float, frequency: float) -> bool:
    """Whether mains hum at `frequency` [Hz] stands out."""
    return frequency < rate / 2 and line_height(values, rate, frequency) >= LINE_HEIGHT


def notch_sections(rate: float, frequency: float) -> NDArray[np.float64]:
    """Second-order sections (n, 6) of `notch`."""
    return sp.tf2sos(*sp.iirnotch(frequency, NOTCH_QUALITY, fs=rate))


def _apply(sections: NDArray[np.float64], values: NDArray[np.float64], phase: Phase) -> NDArray[np.float64]:
    return sp.sosfiltfilt(sections, values) if phase == "zero" else _forwards(sections, values, values[0])


def _forwards(sections: NDArray[np.float64], values: NDArray[np.float64], before: float) -> NDArray[np.float64]:
    """Filtered in real time, as if the value `before` had gone on forever until the start."""
    return sp.sosfilt(sections, values, zi=sp.sosfilt_zi(sections) * before)[0]


def _narrowing(order: int, phase: Phase) -> float:
    """How much narrower a filter's band becomes when it runs twice (1 where it does not)."""
    return (math.sqrt(2) - 1) ** (1 / (2 * order)) if phase == "zero" else 1.0
