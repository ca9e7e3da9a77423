"""What a fit sees of the trials: tensors for the model, weights, known constants, the noise.

Shapes: T trials, N samples of the longest, M muscles.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.signal import savgol_filter
from torch import Tensor

from myowave.data.trials import Trials
from myowave.data.wavelets import estimate_noise
from myowave.physics.drive import channels_of
from myowave.physics.model import Model, Params
from myowave.physics.simulation import Simulation

# ASSUME: no goniometer is better than this, and no model need be: structure below it is not chased.
SMALLEST_NOISE_DEG = 0.05
SMOOTHING_S = 0.35
"""Window of the local cubics that give a first guess of the motion; the fit corrects what they get wrong."""


@dataclass(frozen=True)
class Record:
    """Trials of one subject as tensors.

    Args:
        names: of the trials.
        emg: one channel a muscle, (T, N, M).
        angle: measured [rad], (T, N).
        valid: False where a shorter trial is padded, (T, N).
        training: which trials may be fitted, (T,).
        known: constants that are known, each (T,): the conditions of the trials.
        noise: standard deviation of the noise of the angle [rad].
        at_rest: whether every trial is known to start at rest.
    """

    names: tuple[str, ...]
    dt: float
    emg: Tensor
    angle: NDArray[np.float64]
    valid: NDArray[np.bool_]
    training: NDArray[np.bool_]
    known: dict[str, Tensor]
    noise: float
    at_rest: bool = False

    @property
    def samples(self) -> int:
        """Number of measured samples."""
        return int(self.valid.sum())

    def take(self, index: Sequence[int] | NDArray[np.intp]) -> "Record":
        """Some of the trials; padding that all of them have is cut."""
        index = list(index)
        longest = int(self.valid[index].sum(axis=1).max())
        return replace(
            self,
            names=tuple(self.names[i] for i in index),
            emg=self.emg[index, :longest],
            angle=self.angle[index, :longest],
            valid=self.valid[index, :longest],
            training=self.training[index],
            known={name: values[index] for name, values in self.known.items()},
        )

    @property
    def lengths(self) -> NDArray[np.int64]:
        """Measured samples of each trial, (T,)."""
        return self.valid.sum(1)

    @property
    def train(self) -> "Record":
        return self.take(np.flatnonzero(self.training))

    def starts_of(self, guess: Tensor) -> NDArray[np.float64]:
        """Angle and velocity at the first sample of a guess of the state (..., T, N, K): (..., T, 2)."""
        starts = guess[..., 0, :2].numpy().copy()
        if self.at_rest:
            starts[..., 1] = 0.0
        return starts

    def simulation(self, model: Model, params: Params) -> Simulation:
        """What simulates these trials with a model: their EMG, the constants that are known, and other parameters."""
        return Simulation(model, {**self.known, **params}, self.emg, self.dt)

    def first_guess(self) -> Tensor:
        """State (q, qdot) of the measured motion, smoothed, (T, N, 2)."""
        window = 2 * max(2, round(SMOOTHING_S / self.dt / 2)) + 1
        q, qdot = np.empty_like(self.angle), np.empty_like(self.angle)
        for i, valid in enumerate(self.valid):
            length = int(valid.sum())
            for order, target in ((0, q), (1, qdot)):
                smooth = savgol_filter(self.angle[i, :length], window, 3, deriv=order, delta=self.dt, mode="interp")
                target[i] = np.pad(smooth, (0, len(valid) - length), mode="edge")
        return torch.from_numpy(np.stack([q, qdot], -1))


def make_record(trials: Trials, model: Model, noise_deg: float | None = None, at_rest: bool = False) -> Record:
    """Tensors of all trials of a dataset.

    Args:
        model: whose muscles say which channels are needed.
        noise_deg: standard deviation of the noise of the angle; None estimates it from the training trials.
        at_rest: whether every trial is known to start at rest.
    """
    recorded = [trials.angle[i, : trials.lengths[i]] for i in trials.index(trials.train)]
    noise = estimate_noise(*recorded) if noise_deg is None else np.radians(noise_deg)
    return Record(
        names=trials.names,
        dt=trials.dt,
        emg=channels_of(model, trials.channels, torch.from_numpy(trials.emg)),
        angle=trials.angle,
        valid=trials.valid,
        training=np.array([name not in trials.test for name in trials.names]),
        known={name: torch.from_numpy(values) for name, values in trials.known(model.defaults).items()},
        noise=max(float(noise), np.radians(SMALLEST_NOISE_DEG)),
        at_rest=at_rest,
    )
