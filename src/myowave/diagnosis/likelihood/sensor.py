"""The sensor of the angle, as waves see it: what it does to a motion, and to its own noise.

A filter of the angle passes the motion as well as the noise, so a model's motion and all its derivatives go through it
before they are set beside what was measured. All this is linear: instead of every signal the waves themselves go
through the sensor, backwards.

Shapes: N samples of a trial, W waves.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.signal import butter, sosfiltfilt

from myowave.data.knots import straight
from myowave.data.trials import Array

SHORTEST = 15  # samples that a filter forwards and backwards is longer than


@dataclass(frozen=True)
class Sensor:
    """How an angle came to be recorded."""

    corner_hz: float | None = None  # of the low-pass that it has passed, as programs name it; None: none
    # samples from one measured value to the next, between which the angle runs straight; None: all are measured
    knots: float | None = None

    def seen(self, waves: Array, dt: float) -> tuple[Array, Array]:
        """By which signals waves (N, W) of what is recorded are to be multiplied: the motion (N, W), and white noise of
        what was measured (any number, W)."""
        samples, step = len(waves), 1.0 if self.knots is None else self.knots
        measured = waves if self.knots is None else straight(samples, step).T @ waves
        if self.corner_hz is not None:
            measured = _low_pass(len(measured), 2 * self.corner_hz * dt * step).T @ measured
        return measured if self.knots is None else straight(samples, step, at_knots=True).T @ measured, measured


@lru_cache(maxsize=4)
def _low_pass(samples: int, corner: float) -> Array:
    """What a filter makes of signals of so many samples, (samples, samples); its corner in units of the highest
    frequency."""
    # ASSUME: a Butterworth filter of second order forwards and backwards, as motion capture's (Winter 2009).
    if samples <= SHORTEST or corner >= 1:
        return np.eye(samples)
    return np.asarray(sosfiltfilt(butter(2, corner, output="sos"), np.eye(samples), axis=0))
