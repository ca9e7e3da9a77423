"""The joint's angle from the measured one, where a model has effects on the sensor.

Shapes: T trials, N samples.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

Array = NDArray[np.float64]
Sensor = Callable[[Array, Array], Array]
Smoother = Callable[[Array], tuple[Array, Array]]

CORRECTIONS = 3


def unobserve(sensor: Sensor, smooth: Smoother, angle: Array, lengths: NDArray[np.int64], dt: float) -> Array:
    """The motion that a sensor reports as the measured angle.

    To first order a sensor is an offset, a factor and a delay; what it does to an arm at rest and to a steady motion
    tells these three. They are inverted, and what is left, small if a sensor is not too bent, is corrected for.

    Args:
        sensor: angle and velocity of the joint to the measured angle, (T, N) each.
        smooth: an angle (T, N) to the smoothed one and its velocity.
        angle: measured [rad], (T, N).
        lengths: recorded samples of each trial.

    Returns:
        Angle of the joint [rad], (T, N), a straight line where the sensor has not seen it yet or no more; the measured
        angle as it is if the sensor has no inverse.
    """
    zero, one = np.zeros_like(angle), np.ones_like(angle)
    time = np.broadcast_to(np.arange(angle.shape[1]) * dt, angle.shape)
    offset = sensor(zero, zero)
    factor = sensor(one, zero) - offset
    if not (np.abs(factor) > 0).all():
        return angle
    ahead = time - (sensor(time, one) - offset) / factor
    joint = _later((angle - offset) / factor, ahead, smooth, lengths, dt)
    seen_smooth = smooth(angle)[0]
    for _ in range(CORRECTIONS):
        left = seen_smooth - sensor(*smooth(joint))
        joint = joint + _later(left / factor, ahead, smooth, lengths, dt)
    return joint if np.isfinite(joint).all() else angle


def _later(values: Array, ahead: Array, smooth: Smoother, lengths: NDArray[np.int64], dt: float) -> Array:
    """values(t + ahead), cubic between samples, straight beyond the ends of a trial."""
    if not ahead.any():
        return values
    moved, slope = values.copy(), smooth(values)[1]
    for i, length in enumerate(lengths):
        time = np.arange(length) * dt
        at = time + ahead[i, :length]
        inside = at.clip(0.0, time[-1])
        edge = np.where(at < inside, slope[i, 0], slope[i, length - 1])
        moved[i, :length] = make_interp_spline(time, values[i, :length], k=3)(inside) + (at - inside) * edge
        moved[i, length:] = moved[i, length - 1]
    return moved
