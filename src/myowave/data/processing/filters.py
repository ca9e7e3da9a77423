"""Butterworth filters whose corner is where it is said to be, forwards and backwards or in real time.

A filter that runs twice, forwards and backwards, has no lag, but it attenuates twice: at the corner 1/2 is left instead
of 1/sqrt(2). The corner is moved so that 1/sqrt(2) is left there in both cases (Winter 2009, Biomechanics and Motor
Control of Human Movement, Sec. 2.2.4.4), exactly, on the frequency axis of the bilinear transform.
"""

import math
from typing import Literal

import numpy as np
from scipy import signal as sp

from myowave.data.trials import Array

Phase = Literal["zero", "causal"]

BAND_ORDER = 4
ENVELOPE_ORDER = 2
NOTCH_QUALITY = 30.0  # frequency over width of the notch [-]
MEMORY = 2.0  # of a low-pass, in periods of its corner
HIGHEST = 0.45  # highest corner of a filter, as a fraction of the sampling rate


class Filter:
    """A filter of columns: of phase zero it takes the whole at once, a causal one remembers what came before.

    Args:
        sections: of second order, (n, 6).
        padding: how phase zero goes on beyond the ends, as in `scipy.signal.sosfiltfilt`.
    """

    def __init__(self, sections: Array, phase: Phase, padding: str = "odd") -> None:
        self._sections, self._phase, self._padding = sections, phase, padding
        self._state: Array | None = None

    def __call__(self, values: Array, before: Array | None = None) -> Array:
        """Filtered values (n, C).

        Args:
            values: (n, C), the next ones of a causal filter.
            before: (C,), what is taken to have gone on forever before the first; None takes that of the first sample.
        """
        if self._phase == "zero":
            return sp.sosfiltfilt(self._sections, values, axis=0, padtype=self._padding)
        if self._state is None:
            self._state = sp.sosfilt_zi(self._sections)[..., None] * (values[0] if before is None else before)
        filtered, self._state = sp.sosfilt(self._sections, values, axis=0, zi=self._state)
        return filtered


def band_pass(rate: float, band: tuple[float, float], phase: Phase) -> Filter:
    """What lies within a band [Hz], at whose ends 1/sqrt(2) of the amplitude is left; the upper one is lowered to 0.45
    of the rate [Hz] where it is above."""
    low, high = (math.tan(math.pi * f / rate) for f in (band[0], min(band[1], HIGHEST * rate)))
    width = (high - low) / _narrowing(BAND_ORDER, phase)
    centre = low * high
    low = math.hypot(width / 2, math.sqrt(centre)) - width / 2  # the band is widened about its own centre
    corners = [math.atan(x) / math.pi * rate for x in (low, low + width)]
    return Filter(sp.butter(BAND_ORDER, corners, "bandpass", fs=rate, output="sos"), phase)


def low_pass(rate: float, corner: float, phase: Phase, order: int = ENVELOPE_ORDER) -> Filter:
    """What lies below a corner [Hz], at which 1/sqrt(2) of the amplitude is left; see `band_pass`."""
    moved = math.atan(math.tan(math.pi * corner / rate) / _narrowing(order, phase)) / math.pi * rate
    return Filter(sp.butter(order, moved, fs=rate, output="sos"), phase, "even")


def before_low_pass(answers: Array, rate: float, corner: float) -> Array:
    """What 1 in each sample of white noise does that then passes a low-pass of phase zero, which leaves it a variance
    of 1.

    Args:
        answers: what 1 in each sample behind the low-pass does, (n, ...), at a rate [Hz].

    Returns:
        The same of the samples before it, (n + 2 m, ...): m earlier and m later ones are felt, too.
    """
    # Of phase zero it has no direction: the answer to what comes before it is the filtered answer to what comes behind.
    beyond = math.ceil(MEMORY * rate / corner)
    around = [(beyond, beyond)] + [(0, 0)] * (answers.ndim - 1)
    found = low_pass(rate, corner, "zero")(np.pad(answers, around))
    impulse = np.eye(1, 2 * beyond + 1, beyond)[0]
    return found / np.linalg.norm(low_pass(rate, corner, "zero")(impulse[:, None]))


def lag_s(corner: float) -> float:
    """Time [s] by which the causal low-pass of envelopes, of a corner [Hz], delays what changes slowly: the group delay
    at 0 Hz of an analog Butterworth filter; at 4 Hz it is 56 ms."""
    poles = [math.sin(math.pi * (2 * k + 1) / (2 * ENVELOPE_ORDER)) for k in range(ENVELOPE_ORDER)]
    return sum(poles) / (2 * math.pi * corner)


def notch(rate: float, frequency: float, phase: Phase) -> Filter:
    """All but mains hum at a frequency [Hz]."""
    return Filter(sp.tf2sos(*sp.iirnotch(frequency, NOTCH_QUALITY, fs=rate)), phase)


def _narrowing(order: int, phase: Phase) -> float:
    """How much narrower a filter's band becomes when it runs twice (1 where it does not)."""
    return (math.sqrt(2) - 1) ** (1 / (2 * order)) if phase == "zero" else 1.0
