"""Waves of the motion in each trial, and what a filter of residuals has to do.

Shapes: ... batch, T trials, N samples, C columns, W waves.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

START_DEG, START_DEG_S = 5.0, 50.0  # how far the fitted start of a trial may be off


@dataclass(frozen=True)
class MotionBand:
    """Half periods of a cosine in each trial.

    Args:
        waves: orthonormal, 0 where padded, (T, N, W).
        frequency: of each [1/sample], (T, W).
    """

    waves: Array
    frequency: Array

    @classmethod
    def of(cls, valid: NDArray[np.bool_], edge: float) -> "MotionBand":
        """The band up to an edge [1/sample] in trials (T, N)."""
        lengths = valid.sum(1)
        samples = np.arange(valid.shape[1])[:, None]
        number = np.arange(int(2 * edge * lengths.max()) + 1)
        frequency = number / (2 * lengths[:, None])
        waves = np.cos(2 * np.pi * frequency[:, None] * (samples + 0.5)) * valid[..., None]
        waves = waves * (frequency <= edge)[:, None]
        return cls(waves / np.sqrt((waves**2).sum(1, keepdims=True)).clip(1e-12), frequency)


class Filter(Protocol):
    """What makes of residuals and derivatives that by which a model is fitted; where their noise is known."""

    def innovations(self, columns: Array) -> Array:
        """Of columns (..., T, N, C), white where they are noise."""

    def counted(self, samples: int) -> int:
        """How many values of so many samples count."""

    def take(self, index: Sequence[int] | NDArray[np.intp], longest: int) -> "Filter":
        """That of some of the trials."""
