"""What the training trials covered, and where a prediction leaves it.

Nobody has tested a network where it was never trained, and its band (`band`) says nothing there.

Shapes: T trials, N samples, X inputs: EMG channels and what is known beside them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from myowave.data.trials import Trials
from myowave.learning.inputs import Known, given_inputs

MARGIN = 0.05
"""Share of a range by which it may be left before it counts as left."""


@dataclass(frozen=True)
class Seen:
    """Ranges of the training trials.

    Args:
        low, high: of each input, in its own unit, then of the angle [rad] and of the angular speed [rad/s].
    """

    low: tuple[float, ...]
    high: tuple[float, ...]

    @classmethod
    def of(cls, trials: Trials, known: Known) -> "Seen":
        """Of some trials, all of which count, and of what is known of them."""
        seen = [
            gather(inputs[:n], angle[:n], trials.dt)
            for inputs, angle, n in zip(given_inputs(trials, known), trials.angle, trials.lengths, strict=True)
        ]
        quantities = np.concatenate(seen)
        return cls(tuple(quantities.min(0).tolist()), tuple(quantities.max(0).tolist()))

    def outside(self, quantities: ArrayLike) -> NDArray[np.bool_]:
        """Whether each of the quantities (..., X + 2), see `gather`, is not within its range."""
        low, high = np.array(self.low), np.array(self.high)
        margin = MARGIN * (high - low) + 1e-9
        values = np.asarray(quantities)
        return ~((values >= low - margin) & (values <= high + margin))  # what is no number is outside as well


def gather(inputs: ArrayLike, angle: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
    """Inputs (N, X), angle (N,) [rad] and its speed [rad/s] side by side, (N, X + 2); the first speed is 0."""
    speed = np.diff(angle, prepend=angle[:1]) / dt
    return np.column_stack([inputs, angle, speed])
