"""Units in which recorders write, and the ones everything else uses."""

import math

import numpy as np
from numpy.typing import NDArray

TO_RADIANS = {"rad": 1.0, "deg": math.pi / 180}
"""Factor of each unit of angle."""


def to_radians(angle: NDArray[np.float64], unit: str) -> NDArray[np.float64]:
    """An angle [rad]; `unit` is one of `TO_RADIANS`."""
    return angle * TO_RADIANS[unit]
