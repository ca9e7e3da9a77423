"""What does a fit to pieces of trials leave: noise or more? So short they tell no cause of noise from another."""

from dataclasses import dataclass

import numpy as np

from myowave.diagnosis.misfit.repeated import Repeated, repeated_misfit
from myowave.diagnosis.misfit.size import Size, size_of_misfit
from myowave.identification.noise import SMALLEST_NOISE_DEG
from myowave.identification.output_error import Fit

NOTHING = 0.3  # of the noise: less raises the error by less than 5 %, and is nothing


@dataclass(frozen=True)
class Left:
    """What a fit leaves.

    Args:
        size: of its misfit.
        repeated: see `misfit.repeated`.
        only_noise: whether it is noise.
    """

    size: Size
    repeated: Repeated
    only_noise: bool = True

    @property
    def certain(self) -> float:
        """What is certainly left, slow or repeated in all trials, in variances of independent samples."""
        return max(self.repeated.certain, self.size.certain)

    def missing(self, fit: Fit) -> float:
        """Root mean square of it [rad]."""
        return max(self.size.missing, self.repeated.size(fit))


def what_is_left(fit: Fit, *, has_effects: bool) -> Left:
    """What a fit leaves.

    Args:
        has_effects: whether it has effects that were found. Whatever is left beside one counts against it; a model
            without any may leave next to nothing.
    """
    size = size_of_misfit(fit)
    repeated = repeated_misfit(fit, size)
    noise = min(size.noise, max(fit.rmse(), np.radians(SMALLEST_NOISE_DEG)))
    nothing = 0.0 if has_effects else NOTHING * noise
    repeats = repeated.significant and repeated.size(fit) > nothing
    return Left(size, repeated, only_noise=not repeats and not (size.significant and size.missing > nothing))
