"""From raw EMG to excitation: offset removed, band-pass, notch where asked and needed, rectified, low-pass, divided.

A whole recording at once, or sample by sample as it comes. What a filter forwards in time cannot know is kept from the
training trials: the offset, whether there is hum to take out, and the envelope that counts as 1.

Shapes: C channels, n samples at a time.
"""

from dataclasses import replace

import numpy as np

from myowave.data.processing.filters import band_pass, lag_s, low_pass, notch
from myowave.data.processing.sampled import LINE_HEIGHT, Sampled
from myowave.data.trials import Array
from myowave.settings import Processing, Section


class Known(Section):
    """What is known of a channel before a recording begins."""

    form: str  # raw; envelope where it is already rectified and smoothed, fraction where it is also divided
    rate_hz: float
    unit: str  # uV, or au
    offset: float = 0.0  # of the amplifier, in `unit`; 0 for an envelope
    hum: bool = False  # whether mains hum is taken out
    gain: float = 1.0  # the envelope that counts as 1, in `unit`


class RealTime(Section):
    """How a dataset's EMG becomes excitation, as a checkpoint holds it."""

    processing: Processing
    channels: dict[str, Known]

    @property
    def rate(self) -> float:
        """Samples a second [Hz]; all channels have the same."""
        return next(iter(self.channels.values())).rate_hz


class Excitation:
    """Excitations from EMG: of phase zero from a whole recording, of a causal one from samples as they come.

    A causal low-pass starts as if the mean of its first lag had gone on forever before, so that the first answers come
    when that is over, 56 ms at 4 Hz; from then on there is one for each sample.
    """

    def __init__(self, real_time: RealTime) -> None:
        known, settings, rate = list(real_time.channels.values()), real_time.processing, real_time.rate
        self._raw = np.array([k.form == "raw" for k in known])
        self._offset, self._gain = np.array([k.offset for k in known]), np.array([k.gain for k in known])
        self._hum = np.array([k.hum for k in known])[self._raw]
        self._band = band_pass(rate, settings.band_pass_hz, settings.phase) if settings.band_pass_hz else None
        self._notch = notch(rate, settings.notch_hz, settings.phase) if settings.notch_hz and self._hum.any() else None
        self._low = low_pass(rate, settings.low_pass_hz, settings.phase)
        self._first = max(1, round(lag_s(settings.low_pass_hz) * rate))
        self._waiting = np.empty((0, len(known)))
        self._started = False

    def push(self, emg: Array) -> Array:
        """Excitations (m, C) that further samples of EMG (n, C) make known, the oldest first."""
        rectified = emg - self._offset
        raw = rectified[:, self._raw]
        raw = raw if self._band is None else self._band(raw)
        raw = raw if self._notch is None else np.where(self._hum, self._notch(raw), raw)
        rectified[:, self._raw] = np.abs(raw)
        self._waiting = np.concatenate([self._waiting, rectified])
        return self.finish() if self._started or len(self._waiting) >= self._first else rectified[:0]

    def finish(self) -> Array:
        """Excitations (m, C) of samples that still wait, where EMG ends before the first lag is over."""
        smooth, self._waiting = self._waiting, self._waiting[:0]
        if len(smooth):
            self._started = True
            raw = smooth[:, self._raw]
            smooth[:, self._raw] = self._low(raw, raw[: self._first].mean(0))
        return np.maximum(smooth, 0.0) / self._gain  # a filter of second order undershoots a little


def envelope(emg: Sampled, processing: Processing, known: Known) -> Sampled:
    """Envelope of a recording in the unit of its EMG, never below 0; EMG that is no raw EMG stays as it is.

    Args:
        known: of the channel before; where the filters see all of the recording, offset and hum are found in it.
    """
    if known.form != "raw":
        return emg
    if processing.phase == "zero":
        known = known_from([emg], processing)
    known = known.model_copy(update={"rate_hz": emg.rate})
    excitation = Excitation(RealTime(processing=processing, channels={"": known}))
    return replace(emg, values=np.concatenate([excitation.push(emg.values[:, None]), excitation.finish()])[:, 0])


def known_from(emg: list[Sampled], processing: Processing, form: str = "raw") -> Known:
    """What recordings of EMG tell of their channel, but for its gain: raw ones their offset, and whether they hum."""
    known = Known(form=form, rate_hz=emg[0].rate, unit=emg[0].unit)
    if form != "raw":
        return known
    offset = float(np.median(np.concatenate([one.values for one in emg])))
    mains = processing.notch_hz or 0.0
    hum = any(0 < mains < one.rate / 2 and one.line_height(mains) >= LINE_HEIGHT for one in emg)
    return known.model_copy(update={"offset": offset, "hum": hum})
