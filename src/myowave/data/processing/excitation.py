"""From raw EMG to the envelope whose fraction of a maximum is a muscle's excitation.

Offset removed, band-pass, notch where asked and needed, rectified, low-pass. Processed with the settings of a dataset.
"""

import numpy as np

from myowave.data.processing.filters import (
    BAND_ORDER,
    ENVELOPE_ORDER,
    band_pass,
    lag_s,
    low_pass,
    notch,
    upper_limited,
)
from myowave.data.processing.sampled import Sampled
from myowave.settings import Processing


def envelope(raw: Sampled, settings: Processing, offset: float | None = None, hum: bool | None = None) -> Sampled:
    """Envelope of raw EMG, never below 0.

    Args:
        raw: surface EMG as the electrodes saw it; any unit.
        settings: the corners, and whether the filters may look ahead.
        offset: of the amplifier, in the same unit; None takes the median of the whole.
        hum: whether there is mains hum; None looks for it in the whole.
    """
    values = raw.values - (np.median(raw.values) if offset is None else offset)
    if settings.band_pass_hz is not None:
        values = band_pass(values, raw.rate, settings.band_pass_hz, settings.phase)
    if settings.notch_hz is not None:
        values = notch(values, raw.rate, settings.notch_hz, settings.phase, hum)
    smooth = low_pass(np.abs(values), raw.rate, settings.low_pass_hz, settings.phase)
    return raw.with_values(np.maximum(smooth, 0.0))  # a filter of second order undershoots a little


def describe(settings: Processing, rate: float) -> str:
    """What `envelope` does, in words, for EMG at a rate [Hz]."""
    how = "forwards and backwards" if settings.phase == "zero" else "causal"
    steps = ["offset removed"]
    if settings.band_pass_hz is not None:
        low, high = upper_limited(settings.band_pass_hz, rate)
        steps.append(f"band-pass {low:g} to {high:g} Hz (Butterworth, order {BAND_ORDER}, {how})")
    if settings.notch_hz is not None:
        steps.append(f"notch at {settings.notch_hz:g} Hz where a line is found")
    steps += ["rectified", f"low-pass {settings.low_pass_hz:g} Hz (Butterworth, order {ENVELOPE_ORDER}, {how})"]
    return ", ".join(steps)


def lag_of(settings: Processing) -> float:
    """Time [s] by which the envelope comes after the EMG: 0 without lag."""
    return 0.0 if settings.phase == "zero" else lag_s(settings.low_pass_hz)
