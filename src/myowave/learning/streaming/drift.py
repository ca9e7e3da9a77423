"""Whether a running prediction leaves what its network was trained on."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from myowave.learning.checkpoint import Checkpoint
from myowave.learning.inputs import unit_of


class Drift:
    """Watches a prediction, and says once of each quantity that it has left the range of the training trials.

    Args:
        warn: what to say it with; None watches nothing.
    """

    def __init__(self, checkpoint: Checkpoint, warn: Callable[[str], None] | None) -> None:
        self._seen, self._dt, self._warn = checkpoint.seen, checkpoint.dt, warn
        known, turn = checkpoint.architecture.known, math.degrees(1)
        self._quantities = [  # name, unit, and what a value in SI units is multiplied with
            *((name, "", 1.0) for name in checkpoint.channels),
            *((name, f" {unit_of(name)}", 1.0) for name in known),
            ("the predicted angle", " deg", turn),
            ("the predicted speed", " deg/s", turn),
        ]
        self._said: set[int] = set()
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
        values = [*inputs, angle, (angle - before) / self._dt]
        for i in np.flatnonzero(self._seen.outside(values)).tolist():
            if i not in self._said:
                self._said.add(i)
                name, unit, factor = self._quantities[i]
                value, low, high = (factor * v for v in (values[i], self._seen.low[i], self._seen.high[i]))
                self._warn(
                    f"{where}: {name} is {value:.4g}{unit}; in the training trials it went from {low:.4g} to "
                    f"{high:.4g}. From here on the prediction may be off by more than its band. (Said once.)"
                )
