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
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt

from myowave.data.trials import Array

SHORTEST = 15  # samples that a filter forwards and backwards is longer than
STRAIGHT = 1e-8  # of the largest second difference: less is rounding
MOST_KINKS, WRONG_KINKS = 0.95, 0.05  # of second differences


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


def knots_of(angles: Sequence[Array]) -> float | None:
    """Samples between the values that were measured of angles (N_i,), where they run straight in between and kink at
    no other place; None where they do not."""
    bends = [np.abs(np.diff(angle, 2)) for angle in angles]
    kinked = [bend > STRAIGHT * bend.max(initial=0.0) for bend in bends]
    share = float(np.concatenate(kinked).mean()) if kinked else 1.0
    if not 0 < share < MOST_KINKS:
        return None
    tried = (2 / share) * np.linspace(0.95, 1.05, 2001)
    found = min(tried, key=lambda knots: sum(int((_kinks(len(k), knots) != k).sum()) for k in kinked))
    wrong = sum(int((_kinks(len(k), found) != k).sum()) for k in kinked) / sum(map(len, kinked))
    return float(found) if wrong < WRONG_KINKS else None


def _kinks(bends: int, knots: float) -> NDArray[np.bool_]:
    """At which of so many second differences lines through knots kink."""
    before = np.floor(np.arange(1, int((bends + 1) / knots) + 1) * knots + 1e-9).astype(int)
    found = np.zeros(bends + 2, bool)
    found[(before - 1).clip(0, bends)] = found[before.clip(0, bends)] = True
    return found[:bends]


def straight(samples: int, knots: float, *, at_knots: bool = False) -> Array:
    """What makes of values at knots all samples, straight between them, (samples, Q); or `at_knots` of a signal at all
    samples its values at the knots, (Q, samples), knots beyond the last sample at its value."""
    count = int(np.ceil((samples - 1) / knots - 1e-9)) + 1
    known = samples if at_knots else count
    place = np.minimum(np.arange(count) * knots, samples - 1) if at_knots else np.arange(samples) / knots
    return np.asarray(make_interp_spline(np.arange(known), np.eye(known), k=1)(place))
