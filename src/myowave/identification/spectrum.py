"""Spectra of what a fit leaves, next to those of a filter, of white noise and of a random force.

Noise of a sensor is as dense at all frequencies, until a filter takes it away; what a random force does falls off as an
arm is slow. So their spectra tell them apart, where in time one may imitate the other: a force explains any smooth
residual. Source: Whittle 1953, Estimation and information in stationary time series.

Shapes: T trials, N samples, K numbers of the state, M muscles, W waves.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from myowave.identification.noise import SMALLEST_NOISE_DEG
from myowave.identification.output_error import Fit
from myowave.identification.whitening import MotionBand, let_through

Array = NDArray[np.float64]

ABOVE = (1.5, 3.0)  # just above the band of the motion, in units of its edge
# Where what is likely is sought, first at so many values of each: noise of the angle, in units of what is just above
# that band; noise of the EMG [-]; the corner of a filter that lets the motion through, in units of the edge.
NOISES, EMG, CORNERS, POINTS = (1e-3, 2.0), (1e-3, 1.0), (3.0, 20.0), 9
SMALLEST = 1e-9  # rad: of no residual at all
PLAIN = 0.25  # of what is just above the band is noise at least where a filter is to be seen by it
EFFORT = {"xatol": 0.02, "fatol": 0.1, "maxiter": 200}


@dataclass(frozen=True)
class Guess:
    """What makes spectra likely.

    Args:
        noise: standard deviation of the angle's noise before a filter [rad].
        emg: of the noise of every channel of the EMG [-]; 0 without a force.
        corner: of a filter that the angle has passed [1/sample]; infinite without one.
        unlikely: minus twice the logarithm of the likelihood, but for a constant.
    """

    noise: float
    emg: float = 0.0
    corner: float = np.inf
    unlikely: float = np.inf


@dataclass(frozen=True)
class Spectra:
    """Amplitudes of the waves of each trial, (T, W) each.

    Args:
        waves: which they are.
        edge: where the band of the motion ends [1/sample].
        residual: measured - simulated angle [rad].
        force: variance of what a noise of 1 of every channel of the EMG does to the angle [rad^2].
    """

    waves: MotionBand
    edge: float
    residual: Array
    force: Array

    @classmethod
    def of(cls, fit: Fit, forcing: Array, edge: float, reach: float) -> "Spectra":
        """Spectra of a fit.

        Args:
            forcing: what 1 more in each muscle's excitation adds to the state within a step, (T, N - 1, K, M).
            edge: where the band of the motion ends [1/sample].
            reach: how far to look, in units of the edge.
        """
        waves = MotionBand.of(fit.record.valid, min(reach * edge, 0.5))
        force = sum((each**2).sum(1) for each in answers(fit.linear.jacobian.numpy(), forcing, waves.waves))
        return cls(waves, edge, waves.amplitudes(fit.residual[..., None])[..., 0], np.asarray(force))

    def unlikely(self, guess: Guess) -> float:
        """See `Guess`."""
        # ASSUME: waves are independent. Noise of the EMG drives the simulated arm, so no filter of the measured angle
        # takes what it does; and what programs leave of an angle is as dense everywhere.
        passed = (let_through(self.waves.frequency, guess.corner) * guess.noise) ** 2
        made = passed + guess.emg**2 * self.force + np.radians(SMALLEST_NOISE_DEG) ** 2
        counts = (self.waves.frequency > 0) & (self.waves.frequency <= self.waves.edge)
        return float((np.log(made) + self.residual**2 / made)[counts].sum())

    def most_likely(self, *, forced: bool, filtered: bool) -> Guess:
        """The guess that makes them most likely.

        Args:
            forced, filtered: whether with a random force, and with a filter.
        """
        above, below = (self.waves.frequency > times * self.edge for times in ABOVE)
        seen = max(float(np.sqrt((self.residual[above & ~below] ** 2).mean())), SMALLEST)
        ranges = {"noise": seen * np.array([PLAIN if filtered else NOISES[0], NOISES[1]])}
        ranges |= {"emg": np.array(EMG)} if forced else {}
        ranges |= {"corner": np.array(CORNERS) * self.edge} if filtered else {}
        bounds = np.log([*ranges.values()])

        def guess(logs: Array) -> Guess:
            return Guess(**dict(zip(ranges, np.exp(logs).tolist(), strict=True)))

        def unlikely(logs: Array) -> float:
            return self.unlikely(guess(logs))

        grid = itertools.product(*(np.linspace(low, high, POINTS) for low, high in bounds))
        start = min(map(np.array, grid), key=unlikely)
        found = minimize(unlikely, start, method="Nelder-Mead", bounds=bounds, options=EFFORT)
        return replace(guess(found.x), unlikely=float(found.fun))


def answers(jacobian: Array, forcing: Array, waves: Array) -> Iterator[Array]:
    """Amplitudes of waves (T, N, W) in the angle's answer to 1 more in each muscle's excitation within one step,
    (T, M, W), for each step from the last to the first.

    Args:
        jacobian, forcing: of the steps, (T, N - 1, K, K) and (T, N - 1, K, M).
    """
    by_state = np.zeros((len(waves), jacobian.shape[-1], waves.shape[-1]))  # of what comes after, by the state now
    for n in reversed(range(jacobian.shape[1])):
        by_state[:, 0] += waves[:, n + 1]
        yield np.swapaxes(forcing[:, n], -1, -2) @ by_state
        by_state = np.swapaxes(jacobian[:, n], -1, -2) @ by_state


def covariance(jacobian: Array, forcing: Array, waves: Array) -> Array:
    """Of the amplitudes that noise of 1 of every channel of the EMG makes, (T, W, W) [rad^2]; see `answers`."""
    return np.asarray(sum(np.swapaxes(each, -1, -2) @ each for each in answers(jacobian, forcing, waves)))
