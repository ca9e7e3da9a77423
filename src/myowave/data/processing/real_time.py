"""EMG to excitation sample by sample, as `excitation.envelope` does it with causal filters on a whole recording.

What a filter forwards in time cannot know is kept from the preparation of the training trials: the offset, whether
there is hum to take out, and the envelope that counts as 1.

Shapes: C channels, n samples at a time.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import signal as sp

from myowave.data.processing.filters import band_sections, lag_s, low_sections, notch_sections
from myowave.settings import Processing

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Known:
    """What is known of a channel before a recording begins.

    Args:
        form: `raw`, or `envelope` where it is already rectified and smoothed.
        rate_hz: samples a second [Hz].
        unit: uV, or au.
        offset: of the amplifier, in `unit`; 0 for an envelope.
        hum: whether mains hum is taken out.
        gain: the envelope that counts as 1, in `unit`.
    """

    form: str
    rate_hz: float
    unit: str
    offset: float
    hum: bool
    gain: float


@dataclass(frozen=True)
class RealTime:
    """How a dataset's EMG becomes excitation.

    Args:
        processing: its settings.
        channels: what is known of each channel.
    """

    processing: Processing
    channels: Mapping[str, Known]

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> "RealTime":
        """From plain data, as `plain` gives it."""
        channels = {name: Known(**known) for name, known in content["channels"].items()}
        return cls(Processing.model_validate(content["processing"]), channels)

    def plain(self) -> dict[str, Any]:
        """As plain data, which JSON can hold."""
        channels = {name: dict(vars(known)) for name, known in self.channels.items()}
        return {"processing": self.processing.model_dump(mode="json"), "channels": channels}

    @property
    def rate(self) -> float:
        """Samples a second [Hz]; all channels have the same."""
        return next(iter(self.channels.values())).rate_hz


class Excitation:
    """Excitations from raw EMG as it comes.

    The low-pass starts from the mean of its first lag (see `filters.low_pass`), so that the first answers come when
    that is over, 56 ms at 4 Hz; from then on there is one for each sample.
    """

    def __init__(self, real_time: RealTime) -> None:
        known, settings, rate = list(real_time.channels.values()), real_time.processing, real_time.rate
        self._raw = np.array([k.form == "raw" for k in known])
        self._offset, self._gain = np.array([k.offset for k in known]), np.array([k.gain for k in known])
        hum = settings.notch_hz is not None
        self._first = [_Filter(band_sections(rate, settings.band_pass_hz, "causal"))] if settings.band_pass_hz else []
        self._notch = _Filter(notch_sections(rate, settings.notch_hz)) if hum and settings.notch_hz else None
        self._hum = np.array([k.hum for k in known])[self._raw]
        self._low = _Filter(low_sections(rate, settings.low_pass_hz, "causal"))
        self._lag = max(1, round(lag_s(settings.low_pass_hz) * rate))
        self._waiting: list[Array] | None = []

    def push(self, emg: Array) -> Array:
        """Excitations (n, C) that the next sample of EMG (C,) makes known, the oldest first."""
        rectified = (emg - self._offset)[None]
        raw = rectified[:, self._raw]
        for each in self._first:
            raw = each.run(raw, raw[0])
        if self._notch is not None and self._hum.any():
            raw = np.where(self._hum, self._notch.run(raw, raw[0]), raw)
        rectified[:, self._raw] = np.abs(raw)
        if self._waiting is None:
            return self._smooth(rectified)
        self._waiting.append(rectified[0])
        return self.finish() if len(self._waiting) == self._lag else rectified[:0]

    def finish(self) -> Array:
        """Excitations (n, C) of samples that still wait, where EMG ends before the first lag is over."""
        waiting, self._waiting = self._waiting, None
        return self._smooth(np.array(waiting)) if waiting else np.empty((0, len(self._raw)))

    def _smooth(self, rectified: Array) -> Array:
        """Excitations of rectified samples (n, C)."""
        raw = rectified[:, self._raw]
        smooth = rectified.copy()
        smooth[:, self._raw] = self._low.run(raw, raw.mean(0))
        return np.maximum(smooth, 0.0) / self._gain


class _Filter:
    """A causal filter that remembers; it starts as if one value had gone on forever before."""

    def __init__(self, sections: Array) -> None:
        self._sections, self._state = sections, None

    def run(self, values: Array, before: Array) -> Array:
        """Filtered values (n, C); `before` (C,) counts in the first call only."""
        if self._state is None:
            self._state = sp.sosfilt_zi(self._sections)[..., None] * before
        filtered, self._state = sp.sosfilt(self._sections, values, axis=0, zi=self._state)
        return filtered
