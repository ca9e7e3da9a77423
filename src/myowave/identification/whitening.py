"""Filters of residuals and derivatives: a random force's colour taken out, or only the band of the motion left.

Shapes: ... batch, T trials, N samples, K numbers of the state, C columns.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

START_DEG, START_DEG_S = 5.0, 50.0  # how far the fitted start of a trial may be off


class Filter(Protocol):
    """What makes of residuals and derivatives that by which a model is judged."""

    def innovations(self, columns: Array) -> Array:
        """What counts of columns (..., T, N, C) in the units of the angle."""

    def take(self, index: Sequence[int] | NDArray[np.intp], longest: int) -> "Filter":
        """That of some of the trials."""


@dataclass(frozen=True)
class Band:
    """Only what is slow counts: an angle that has passed a filter is changed above.

    Args:
        edge: up to here [1/sample].
    """

    edge: float

    def innovations(self, columns: Array) -> Array:
        """The part of columns (..., T, N, C) in the band."""
        samples = columns.shape[-2]
        spectrum = np.fft.rfft(columns, axis=-2)
        spectrum[..., np.fft.rfftfreq(samples) > self.edge, :] = 0.0
        return np.fft.irfft(spectrum, samples, axis=-2)

    def take(self, index: Sequence[int] | NDArray[np.intp], longest: int) -> "Band":
        """The same: it knows no trials."""
        return self


@dataclass(frozen=True)
class Whitener:
    """The Kalman filter of trials whose motion a random force disturbs.

    Args:
        jacobian: of the step from each sample to the next, (T, N - 1, K, K).
        gain: by how much a sample that is missed moves the state, (T, N, K).
        size: standard deviation of what is missed of each sample [rad], (T, N).
        noise: of the angle [rad]: innovations are scaled to it.
    """

    jacobian: Array
    gain: Array
    size: Array
    noise: float

    @classmethod
    def of(cls, jacobian: Array, added: Array, noise: float) -> "Whitener":
        """The filter for a random force.

        Args:
            jacobian: (T, N - 1, K, K).
            added: covariance of what the force adds to the state within each step, (T, N - 1, K, K).
            noise: standard deviation of the angle's noise [rad].
        """
        trials, steps, states, _ = jacobian.shape
        spread = np.zeros((trials, states, states))
        spread[:, 0, 0], spread[:, 1, 1] = np.radians(START_DEG) ** 2, np.radians(START_DEG_S) ** 2
        gain, size = np.empty((trials, steps + 1, states)), np.empty((trials, steps + 1))
        for n in range(steps + 1):
            variance = spread[:, 0, 0] + noise**2
            gain[:, n], size[:, n] = spread[:, :, 0] / variance[:, None], np.sqrt(variance)
            spread = spread - gain[:, n, :, None] * spread[:, None, 0, :]
            if n < steps:
                step = jacobian[:, n]
                spread = step @ spread @ np.swapaxes(step, -1, -2) + added[:, n]
        return cls(jacobian, gain, size, noise)

    def innovations(self, columns: Array) -> Array:
        """What of each sample is new, of columns (..., T, N, C) in the units of the angle: white noise of variance
        `noise`^2 where they are a residual and the noise is all there is."""
        found = np.empty_like(columns)
        state = np.zeros((*columns.shape[:-2], self.gain.shape[-1], columns.shape[-1]))
        for n in range(columns.shape[-2]):
            missed = columns[..., n, :] - state[..., 0, :]
            found[..., n, :] = missed * (self.noise / self.size[:, n])[:, None]
            state = state + self.gain[:, n, :, None] * missed[..., None, :]
            if n < self.jacobian.shape[1]:
                state = self.jacobian[:, n] @ state
        return found

    def unlikely(self, residual: Array, valid: NDArray[np.bool_]) -> float:
        """Minus twice the logarithm of the likelihood of a residual (T, N), but for a constant."""
        new = self.innovations(residual[..., None])[..., 0] / self.noise
        return float((2 * np.log(self.size) + new**2)[valid].sum())

    def take(self, index: Sequence[int] | NDArray[np.intp], longest: int) -> "Whitener":
        """That of some of the trials."""
        chosen = list(index)
        parts = self.jacobian[chosen, : longest - 1], self.gain[chosen, :longest], self.size[chosen, :longest]
        return replace(self, jacobian=parts[0], gain=parts[1], size=parts[2])
