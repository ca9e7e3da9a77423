"""How far a prediction may be off: a band that holds 90 % of the measured angles; `calibration` makes it.

Shapes: S seeds, N samples.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Band:
    """A band about the mean of all seeds.

    Args:
        factor: by which the scale of the error is multiplied [-].
        floor: error that is there even where all seeds agree [rad].
    """

    factor: float
    floor: float

    def half_width(self, spread: Array) -> Array:
        """Half of the band's width [rad] where the seeds have a standard deviation of `spread` [rad]."""
        return self.factor * np.hypot(spread, self.floor)


def band_about(predicted: Array, band: Band, given: int) -> tuple[Array, Array]:
    """Lower and upper end of the band [rad], (..., N), about predictions of all seeds (S, ..., N).

    Args:
        given: samples at the start whose angle is known; there the band has no width.
    """
    mean, half = predicted.mean(0), band.half_width(predicted.std(0))
    half[..., :given] = 0.0
    return mean - half, mean + half
