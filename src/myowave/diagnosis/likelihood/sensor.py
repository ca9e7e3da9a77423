"""The sensor of the angle, as waves see it: what it does to a motion, and to its own noise.

A filter of the angle passes the motion as well as the noise, so a model's motion and all its derivatives go through it
before they are set beside what was measured. All this is linear: instead of every signal the waves themselves go
through the sensor, backwards.

Shapes: N samples of a trial, W waves.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfilt, sosfilt_zi

from myowave.data.knots import straight
from myowave.data.trials import Array


@dataclass(frozen=True)
class Sensor:
    """How an angle came to be recorded."""

    corner_hz: float | None = None  # of the low-pass that it has passed, as programs name it; None: none
    order: int = 2  # of that low-pass, of which a high one passes what an interpolation of measured values does
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
            measured = _transposed_low_pass(measured, 2 * self.corner_hz * dt * self.step, self.order)
        return measured if knots is None else straight(samples, knots, at_knots=True).T @ measured, measured


def _transposed_low_pass(waves: Array, corner: float, order: int) -> Array:
    """By which signals before a filter are to be multiplied, as they are by waves (N, W) behind it; its corner in units
    of the highest frequency."""
    # ASSUME: a Butterworth filter forwards and backwards, as motion capture's of second order (Winter 2009).
    edge = 3 * (order + 1)  # samples by which it goes on beyond both ends, as `scipy.signal.sosfiltfilt` does
    if len(waves) <= edge or corner >= 1:
        return waves
    sos = butter(order, corner, output="sos")
    resting, _ = sosfilt(sos, np.zeros(len(waves) + 2 * edge), zi=sosfilt_zi(sos))  # begun at rest at 1

    def once(later: Array) -> Array:
        """The same of one of its two passes, which begins at rest at the first value."""
        back = sosfilt(sos, later[::-1], axis=0)[::-1]
        return np.concatenate([back[:1] + resting @ later, back[1:]])

    # Before the filter a signal goes on beyond both ends, turned about each.
    beyond = once(once(np.pad(waves, ((edge, edge), (0, 0)))[::-1])[::-1])
    found = beyond[edge:-edge].copy()
    for inwards, turned in ((found, beyond[:edge][::-1]), (found[::-1], beyond[-edge:])):
        inwards[0] += 2 * turned.sum(0)
        inwards[1 : edge + 1] -= turned
    return found
