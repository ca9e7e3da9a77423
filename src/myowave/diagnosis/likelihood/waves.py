"""A residual in cosine waves: white noise stays white, and what physics misses is in the slow ones.

Waves well above the motion are counted one by one; they tell how strong the noise is, and whether a filter has taken
it.

Shapes: T trials (or pieces), N samples, W waves in the band of the motion, H of those above it, each of one trial.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.signal import lfilter, periodogram
from torch import Tensor

from myowave.data.trials import Array
from myowave.diagnosis.likelihood.sensor import Sensor
from myowave.identification.output_error import Fit

MOTION = 0.99  # share of the motion's power that lies in its band
NOISE_ABOVE = 3.0  # in units of the band's edge, below which there must be room for noise
# How far waves are dense, in units of the motion's edge: an arm follows nothing much faster; and how far at least, in a
# trial so long that this takes more than `MOST` waves: what the band leaves out of a motion looks like noise.
REACH, AT_LEAST = 3.0, 2.0
MOST, MOST_ABOVE = 110, 250  # waves of a trial in the band and above: more tell nothing of what is slow
STOPPED = 0.01  # of the power of noise: where a sensor passes less, what it adds itself counts
PERFECT = Sensor()
MEMORIES_S = (0.05, 0.1, 0.2, 0.4, 0.8)  # of the sensor's noise, which are tried


@dataclass(frozen=True)
class Waves:
    """Some orthonormal waves of each trial, 0 where padded, as they are and as a sensor sees them."""

    waves: Tensor  # (T, N, W), which of them there are (T, W), and the frequency of each (T, W) [Hz]
    there: Tensor
    frequency: Array
    motion: Tensor  # signals that a simulated motion is to be multiplied by, (T, N, W)
    noise: Tensor  # the same of white noise of what was measured, (T, Q, W)

    @classmethod
    def of(cls, lengths: NDArray[np.int64], numbers: list[NDArray[np.int64]], dt: float) -> "Waves":
        """Half periods of a cosine by their numbers, in trials of so many samples, as a perfect sensor sees them."""
        most, samples = max(len(n) for n in numbers), np.arange(lengths.max())[:, None]
        waves = np.zeros((len(lengths), len(samples), most))
        there, frequency = np.zeros((len(lengths), most), bool), np.zeros((len(lengths), most))
        for t, (length, number) in enumerate(zip(lengths, numbers, strict=True)):
            own = np.cos(np.pi * number * (samples[:length] + 0.5) / length)
            waves[t, :length, : len(number)] = own / np.sqrt((own**2).sum(0))
            there[t, : len(number)] = True
            frequency[t, : len(number)] = number / (2 * length * dt)
        seen = torch.from_numpy(waves)
        return cls(seen, torch.from_numpy(there), frequency, seen, seen)

    @property
    def none(self) -> "Waves":
        """No wave of them."""
        none, noise = self.waves[..., :0], self.noise[..., :0]
        return Waves(none, self.there[:, :0], self.frequency[:, :0], none, noise)

    def only(self, kept: Tensor) -> "Waves":
        """Those that are kept (T, W); the others are 0."""
        waves, motion, noise = (wave * kept[:, None] for wave in (self.waves, self.motion, self.noise))
        return Waves(waves, self.there & kept, self.frequency, motion, noise)

    def through(self, sensor: Sensor, lengths: NDArray[np.int64], dt: float) -> "Waves":
        """The same waves as a sensor sees them."""
        seen = [sensor.seen(t, self.waves[t, :n].numpy(), dt) for t, n in enumerate(lengths)]
        motion, noise = (
            torch.nn.utils.rnn.pad_sequence([torch.from_numpy(s) for s in some], batch_first=True)
            for some in zip(*seen, strict=True)
        )
        return replace(self, motion=motion, noise=noise)


@dataclass(frozen=True)
class View:
    """How trials are looked at."""

    lengths: NDArray[np.int64]
    dt: float
    # band, above: waves in the band of the motion, and of those above it
    band: Waves
    above: Waves
    edge_hz: float  # where the band of the motion ends
    sensor: Sensor = PERFECT
    memory_s: float = MEMORIES_S[2]  # of the noise that the sensor may have beside the white one

    @classmethod
    def of(cls, fit: Fit, sensor: Sensor = PERFECT) -> "View":
        """That of a fit's trials."""
        lengths, dt = fit.record.lengths, fit.record.dt
        edge, short = edge_of(fit), fit.record.pieces is not None
        reach = REACH * NOISE_ABOVE if short else REACH
        few = max(MOST / (2 * int(lengths.max())), AT_LEAST * edge * dt)
        top = min(max(reach * edge, 1.0) * dt, few, 0.5)
        inside, beyond = [], []
        for n in lengths:
            first = int(2 * top * n) + 1
            inside.append(np.arange(min(first, n)))
            # In pieces what is slow leaks into waves above the band, where they are no longer independent.
            beyond.append(np.arange(first, first if short else n, max(1, -(-(n - first) // MOST_ABOVE))))
        return cls(lengths, dt, Waves.of(lengths, inside, dt), Waves.of(lengths, beyond, dt), edge).through(sensor)

    def through(self, sensor: Sensor) -> "View":
        """The same through another sensor."""
        band, above = (band.through(sensor, self.lengths, self.dt) for band in (self.band, self.above))
        return replace(self, sensor=sensor, band=band, above=above)

    @property
    def above_alone(self) -> "View":
        """The same without the waves in the band of the motion."""
        return replace(self, band=self.band.none)

    @property
    def passed(self) -> "View":
        """The same without the waves above the band that the sensor stops: it passed no noise that is there."""
        return replace(self, above=self.above.only((self.above.noise**2).sum(1) > STOPPED))

    @property
    def sizes(self) -> list[int]:
        """How many waves there are in the band and above, W and H."""
        return [self.band.there.shape[1], self.above.there.shape[1]]

    @property
    def there(self) -> Tensor:
        """Which waves there are, (T, W + H)."""
        return torch.cat([self.band.there, self.above.there], 1)

    @cached_property
    def motion(self) -> Tensor:
        """Signals that a simulated motion is to be multiplied by, (T, N, W + H)."""
        return torch.cat([self.band.motion, self.above.motion], -1)

    @cached_property
    def waves(self) -> Tensor:
        """Signals that a measured one is to be multiplied by, (T, N, W + H)."""
        return torch.cat([self.band.waves, self.above.waves], -1)

    def amplitudes(self, columns: Array) -> Tensor:
        """Of the waves in simulated columns (T, N, C) as the sensor sees them, (T, W + H, C)."""
        return self.motion.mT @ torch.from_numpy(np.ascontiguousarray(columns))

    def left(self, fit: Fit) -> Tensor:
        """Measured less simulated angle in the waves, (T, W + H)."""
        measured, simulated = (torch.from_numpy(x * fit.record.valid)[..., None] for x in (fit.record.angle, fit.angle))
        return (self.waves.mT @ measured - self.motion.mT @ simulated)[..., 0]

    def with_memory(self, memory_s: float) -> tuple[Tensor, Tensor]:
        """Covariance of the waves (T, W, W), and variances above the band (T, H), of noise with a memory."""
        band, above = (_remembered(b.motion, memory_s / self.dt) for b in (self.band, self.above))
        return self.band.motion.mT @ band, (self.above.motion * above).sum(1)


def _remembered(waves: Tensor, memory: float) -> Tensor:
    """The correlation of noise that falls by a factor of e over so many samples, times waves (T, N, W)."""
    fall = [1.0], [1.0, -np.exp(-1 / memory)]
    before = torch.from_numpy(lfilter(*fall, waves, axis=1))
    after = torch.from_numpy(lfilter(*fall, waves.flip(1), axis=1)).flip(1)
    return before + after - waves


def edge_of(fit: Fit) -> float:
    """Frequency below which nearly all of the simulated motion's power is, of pieces that of the measured one, which
    does not begin anew in each [Hz]."""
    found, dt, whole = [], fit.record.dt, fit.record.whole
    moved = fit.angle if fit.record.pieces is None else whole.motion[..., 0].numpy()
    for motion in whole.joined(moved).values():
        frequency, power = periodogram(motion, 1 / dt, window="hann", detrend="linear")
        share = np.cumsum(power) / max(power.sum(), 1e-300)
        found.append(frequency[min(np.searchsorted(share, MOTION), len(share) - 1)])  # at rest there is no power
    return float(min(np.mean(found), 0.5 / dt / NOISE_ABOVE))
