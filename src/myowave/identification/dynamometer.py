"""Torque that a dynamometer measured, as further residuals of a fit to motion.

Torque along the measured motion depends on the parameters alone, not on where a simulated motion has got to. It is what
tells forces from masses: a motion stays the same if both grow by one factor, a torque does not.

Shapes: ... starts of the search, R residuals, P free parameters.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from myowave.identification.descent import linearise
from myowave.identification.free_parameters import Free, bind_values
from myowave.identification.least_squares import Normal
from myowave.identification.record import Record
from myowave.identification.torque import LARGEST, TorqueBalance, effects_unseen_by_angle
from myowave.physics.model import Model

Array = NDArray[np.float64]

# ASSUME: dynamometer, lever and the muscles' model together are as good as this share of the torque they measure.
ACCURACY = 0.05


def with_torque(normal: Normal, model: Model, record: Record, free: Sequence[Free], values: Array) -> Normal:
    """Normal equations with the measured torque as further residuals, in the units of the angle's noise; unchanged
    where none was measured, or where torque hangs on states that no angle shows.

    Args:
        values: of the parameters, (..., P).
    """
    if record.torque is None or record.pieces is not None or effects_unseen_by_angle(model):
        return normal
    balance = TorqueBalance.of(model, record)
    seen = balance.seen
    if balance.measured is None or not seen.any():
        return normal
    measured = balance.measured[seen]
    weight = record.noise / (ACCURACY * np.sqrt((measured**2).mean()))

    def left(values: Array) -> Array:
        given = balance.torques(bind_values(free, values)).given
        return np.nan_to_num((measured - given[..., seen]) * weight, nan=LARGEST).clip(-LARGEST, LARGEST)

    residual, change = linearise(left, free, values)
    slope = -change
    return replace(
        normal,
        matrix=normal.matrix + np.swapaxes(slope, -1, -2) @ slope,
        vector=normal.vector + (np.swapaxes(slope, -1, -2) @ residual[..., None])[..., 0],
        torque=residual,
        torque_slope=slope,
    )
