"""Filters of residuals and derivatives: a random force's colour taken out, or only the band of the motion left.

Shapes: ... batch, T trials, N samples, K numbers of the state, C columns, W waves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

START_DEG, START_DEG_S = 5.0, 50.0  # how far the fitted start of a trial may be off


@dataclass(frozen=True)
class MotionBand:
    """Only what is slow counts: an angle that has passed a filter is changed above.

    Args:
        edge: up to here [1/sample].
        waves: half periods of a cosine in each trial, orthonormal, 0 where padded, (T, N, W).
        frequency: of each [1/sample], (T, W).
        weight: of their amplitudes, which makes white what noise and a random force make of them, (T, W, W); None where
            there is noise alone.
    """

    edge: float
    waves: Array
    frequency: Array
    weight: Array | None = None

    @classmethod
    def of(cls, valid: NDArray[np.bool_], edge: float) -> "MotionBand":
        """The band up to an edge [1/sample] in trials (T, N)."""
        lengths = valid.sum(1)
        samples = np.arange(valid.shape[1])[:, None]
        number = np.arange(int(2 * edge * lengths.max()) + 1)
        frequency = number / (2 * lengths[:, None])
        waves = np.cos(2 * np.pi * frequency[:, None] * (samples + 0.5)) * valid[..., None]
        waves = waves * (frequency <= edge)[:, None]
        return cls(edge, waves / np.sqrt((waves**2).sum(1, keepdims=True)).clip(1e-12), frequency)

    def amplitudes(self, columns: Array) -> Array:
        """Of the waves in columns (..., T, N, C), (..., T, W, C)."""
        return np.swapaxes(self.waves, -1, -2) @ columns

    def innovations(self, columns: Array) -> Array:
        """The part of columns (..., T, N, C) in the band."""
        found = self.amplitudes(columns)
        return self.waves @ (found if self.weight is None else self.weight @ found)

    def counted(self, samples: int) -> int:
        """The number of waves."""
        return int((self.waves != 0).any(1).sum())

    def given_force(self, force: Array, noise: float) -> "MotionBand":
        """The same band with a force in it.

        Args:
            force: covariance of what the force makes of the amplitudes [rad^2], (T, W, W).
            noise: standard deviation of the angle's noise [rad]: innovations are scaled to it.
        """
        values, vectors = np.linalg.eigh(force)
        share = noise / np.sqrt(values.clip(0.0) + noise**2)
        return replace(self, weight=(vectors * share[:, None]) @ np.swapaxes(vectors, -1, -2))

    def take(self, index: Sequence[int] | NDArray[np.intp], longest: int) -> "MotionBand":
        """That of some of the trials."""
        chosen = list(index)
        weight = None if self.weight is None else self.weight[chosen]
        waves, frequency = self.waves[chosen, :longest], self.frequency[chosen]
        return replace(self, waves=waves, frequency=frequency, weight=weight)


def let_through(frequency: Array, corner: float) -> Array:
    """Share of a wave's amplitude that a filter lets through."""
    # ASSUME: a Butterworth filter of second order forwards and backwards, as motion capture's (Winter 2009), which lets
    # the motion through.
    return np.asarray(1 / (1 + (frequency / corner) ** 4))


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

    def counted(self, samples: int) -> int:
        """All."""
        return samples

    def unlikely(self, residual: Array, valid: NDArray[np.bool_]) -> float:
        """Minus twice the logarithm of the likelihood of a residual (T, N), but for a constant."""
        new = self.innovations(residual[..., None])[..., 0] / self.noise
        return float((2 * np.log(self.size) + new**2)[valid].sum())

    def take(self, index: Sequence[int] | NDArray[np.intp], longest: int) -> "Whitener":
        """That of some of the trials."""
        chosen = list(index)
        parts = self.jacobian[chosen, : longest - 1], self.gain[chosen, :longest], self.size[chosen, :longest]
        return replace(self, jacobian=parts[0], gain=parts[1], size=parts[2])


Filter = MotionBand | Whitener
"""What makes of residuals and derivatives that by which a model is judged."""
