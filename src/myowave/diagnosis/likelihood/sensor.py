"""The sensor of the angle, as waves see it: what it does to a motion, and to its own noise.

A filter of the angle passes the motion as well as the noise, so a model's motion and all its derivatives go through it
before they are set beside what was measured. All this is linear: instead of every signal the waves themselves go
through the sensor, backwards.

Shapes: N samples of a trial, W waves.
"""

from collections.abc import Sequence
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
    # places in each trial [samples] at which the angle was measured, and between which it runs straight; None: at all
    knots: Sequence[Array] | None = None

    @property
    def step(self) -> float:
        """Samples from one measured value to the next."""
        return 1.0 if self.knots is None else float(self.knots[0][1] - self.knots[0][0])

    def seen(self, trial: int, waves: Array, dt: float) -> tuple[Array, Array]:
        """By which signals waves (N, W) of what is recorded are to be multiplied: the motion (N, W), and white noise of
        what was measured (any number, W)."""
        samples, knots = len(waves), None if self.knots is None else self.knots[trial]
        measured = waves if knots is None else straight(samples, knots).T @ waves
        if self.corner_hz is not None:
            measured = _low_pass(len(measured), 2 * self.corner_hz * dt * self.step).T @ measured
        return measured if knots is None else straight(samples, knots, at_knots=True).T @ measured, measured


@lru_cache(maxsize=4)
def _low_pass(samples: int, corner: float) -> Array:
    """What a filter makes of signals of so many samples, (samples, samples); its corner in units of the highest
    frequency."""
    # ASSUME: a Butterworth filter of second order forwards and backwards, as motion capture's (Winter 2009).
    if samples <= SHORTEST or corner >= 1:
        return np.eye(samples)
    return np.asarray(sosfiltfilt(butter(2, corner, output="sos"), np.eye(samples), axis=0))
