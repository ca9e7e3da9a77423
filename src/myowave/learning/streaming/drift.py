"""Whether a running prediction leaves what its network was trained on."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from myowave.learning.checkpoint import Checkpoint
from myowave.learning.inputs import unit_of
from myowave.learning.seen import gather, quantity_names

_MOTION = {"angle": ("the predicted angle", "deg"), "speed": ("the predicted speed", "deg/s")}


class Drift:
    """Watches a prediction, and says once of each quantity that it has left the range of the training trials.

    Args:
        warn: what to say it with; None watches nothing.
    """

    def __init__(self, checkpoint: Checkpoint, warn: Callable[[str], None] | None) -> None:
        self._seen, self._dt, self._warn = checkpoint.seen, checkpoint.dt, warn
        self._channels = checkpoint.channels
        self._names = quantity_names(checkpoint.channels, tuple(checkpoint.architecture.known))
        self._told: set[str] = set()
        self._before: float | None = None

    def watch(self, inputs: Sequence[float], angle: float, where: str) -> None:
        """Look at the next sample.

        Args:
            inputs: EMG and known inputs.
            angle: predicted [rad].
            where: what messages call the sample.
        """
        if self._warn is None:
            return
        before, self._before = angle if self._before is None else self._before, angle
        quantities = gather([inputs, inputs], np.array([before, angle]), self._dt)[1]
        for i in np.flatnonzero(self._seen.outside(quantities)).tolist():
            if self._names[i] not in self._told:
                self._told.add(self._names[i])
                self._warn(f"{where}: {self._tell(i, float(quantities[i]))}")

    def _tell(self, i: int, value: float) -> str:
        name = self._names[i]
        what, unit = _MOTION.get(name, (name, "" if name in self._channels else unit_of(name)))
        factor = math.degrees(1) if name in _MOTION else 1.0
        low, high = (factor * end for end in (self._seen.low[i], self._seen.high[i]))
        return (
            f"{what} is {factor * value:.4g}{f' {unit}' if unit else ''}; in the training trials it went from "
            f"{low:.4g} to {high:.4g}. From here on the prediction may be off by more than its band. (Said once.)"
        )
