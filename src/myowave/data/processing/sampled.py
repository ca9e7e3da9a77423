"""A signal sampled at one rate, with a clock of its own."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Sampled:
    """One signal.

    Args:
        values: (N,), in `unit`.
        rate: samples a second [Hz].
        start: time of the first sample [s].
        unit: such as uV, rad, or - for a fraction.
    """

    values: NDArray[np.float64]
    rate: float
    start: float
    unit: str

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each sample [s], (N,)."""
        return self.start + np.arange(len(self.values)) / self.rate

    @property
    def end(self) -> float:
        """Time of the last sample [s]."""
        return self.start + (len(self.values) - 1) / self.rate

    def within(self, start: float, end: float) -> NDArray[np.float64]:
        """Values at times from `start` to `end` [s]."""
        time = self.time
        return self.values[(time >= start) & (time <= end)]

    def with_values(self, values: NDArray[np.float64], unit: str | None = None) -> "Sampled":
        """Other values at the same times."""
        return replace(self, values=values, unit=self.unit if unit is None else unit)
