"""Motion in real time: one sample of EMG in, one angle out, with nothing but what is past.

A step is done in numpy, because it is two dozen products of small matrices: torch would spend more time on calling them
than on computing them.

Shapes: S seeds, C channels, K known inputs, X inputs, H hidden units, G gates, as in `network`.
"""

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
import torch

from myowave.data.checks.values import UNSEEN_LIMIT
from myowave.learning.checkpoint import Checkpoint


class Predictor:
    """Motion from a stream of EMG, for all seeds or those of these numbers; equal to `prediction.predict_free_running`
    on the same samples. A ValueError for a seed that the checkpoint does not have."""

    def __init__(self, checkpoint: Checkpoint, seeds: Sequence[int] | None = None) -> None:
        network, dt = checkpoint.network, checkpoint.dt
        seeds = checkpoint.seeds if seeds is None else seeds
        if unknown := sorted(set(seeds) - set(checkpoint.seeds)):
            raise ValueError(f"no seed {unknown} in the checkpoint; it has {list(checkpoint.seeds)}.")
        chosen = [checkpoint.seeds.index(seed) for seed in seeds]
        # Float64, and inputs rounded to float32 as everywhere: then any order of summation gives the batch's numbers.
        self._weights = {name: value[chosen].double().cpu().numpy() for name, value in network.weights.items()}
        self._network, self._channels, self._dt, self._count = network, checkpoint.channels, dt, 0
        self._mean, self._std = np.array(network.scaling.input_mean), np.array(network.scaling.input_std)
        self._z, self._v = np.zeros((2, len(chosen), 1, 1))
        self._angles: list[float] = []  # the last two of the history
        self._hidden = self._start = np.zeros((len(chosen), 1, network.architecture.hidden))
        longest = max(network.architecture.delays, default=0.0)
        self._inputs: deque[np.ndarray] = deque(maxlen=math.ceil(longest / dt) + 2)
        self._past: deque[np.ndarray] = deque(maxlen=network.history)  # what drove the last history cells

    def step(
        self, emg: Sequence[float], known: Sequence[float] = (), angle: float = math.nan, where: str = ""
    ) -> np.ndarray:
        """The angle [rad] at the next sample for every seed, (S,), from its EMG (one number per channel).

        Args:
            known: inputs beside EMG, in the order of its architecture's `known`, SI units.
            angle: known angle [rad] of a sample of the history; of later ones it does not count.
            where: what messages call the sample; its number by default.

        Raises:
            ValueError: for another number of channels, or EMG that is not normalised; the sample then does not count.
        """
        n, weights, scaling = self._count, self._weights, self._network.scaling
        self._check(emg, where or f"sample {n + 1}")
        driven = self._encode(np.array([*emg, *known], dtype=np.float64)) @ weights["input"] + weights["bias"]
        recurrent = self._remember() @ weights["hidden"]
        given = n < self._network.history
        if given:
            self._angles = [*self._angles[-1:], angle]
            encoded = self._network.encode_angle(torch.tensor(self._angles, dtype=torch.float64))
            self._z, self._v = (np.full_like(self._z, float(values[-1])) for values in encoded)
        else:
            output = self._cell(driven, recurrent) @ weights["output"] + weights["output_bias"]
            self._z, self._v = self._network.move(output, self._z, self._v)
        features = np.concatenate((self._z, self._v), axis=-1)[..., : self._network.architecture.features]
        seen = driven + features @ weights["angle"]
        self._past.append(seen)
        self._hidden = self._cell(seen, recurrent)
        self._count += 1
        if given:
            return np.full(len(self._z), angle)
        return self._z[:, 0, 0] * scaling.angle_std + scaling.angle_mean

    def _encode(self, inputs: np.ndarray) -> np.ndarray:
        """As `Network.encode_inputs`, of EMG and known inputs of one sample: (1, X)."""
        architecture = self._network.architecture
        self._inputs.append(architecture.given.see(inputs))
        x = self._inputs[-1].copy()
        sample = np.arange(self._count + 1 - len(self._inputs), self._count + 1)
        for c, delay in enumerate(architecture.delays):  # as `network.delayed`
            at = max(self._count - delay / self._dt, 0.0)
            x[c] = np.interp(at, sample, [seen[c] for seen in self._inputs])
        x = (x - self._mean) / self._std
        if not architecture.increments:
            x = np.append(x, self._count * self._dt / self._network.scaling.duration)
        return x.astype(np.float32).astype(np.float64)[None]

    def _remember(self) -> np.ndarray:
        """h_(n-1), (S, 1, H); where the state is not handed on, after going through the history again."""
        if not self._network.architecture.increments:
            self._hidden = self._start
            for seen in self._past:
                self._hidden = self._cell(seen, self._hidden @ self._weights["hidden"])
        return self._hidden

    def _cell(self, driven: np.ndarray, recurrent: np.ndarray) -> np.ndarray:
        """As `prediction.apply_cell`."""
        h = self._network.architecture.hidden
        gates = 0.5 + 0.5 * np.tanh(0.5 * (recurrent[..., : 2 * h] + driven[..., : 2 * h]))
        candidate = np.tanh(driven[..., 2 * h :] + gates[..., :h] * recurrent[..., 2 * h :])
        return candidate + gates[..., h:] * (self._hidden - candidate) + self._weights["state_bias"]

    def _check(self, emg: Sequence[float], where: str) -> None:
        for name, value in zip(self._channels, emg, strict=True):
            if not 0 <= value <= UNSEEN_LIMIT:
                raise ValueError(
                    f"{where}: {name} is {value:g}, expected 0 to {UNSEEN_LIMIT:g}. Rectify and smooth the EMG, and "
                    "divide it by its value at maximum voluntary contraction, as was done for the training."
                )
