"""Motion in real time: one sample of EMG in, one angle out, with nothing but what is past."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch

from myowave.data.checks.values import UNSEEN_LIMIT, has_sign
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.prediction import FreeRun, drive


class Predictor:
    """Motion from a stream of EMG, for all seeds or those of these numbers; equal to `prediction.predict_free_running`
    on the same samples. A ValueError for a seed that the checkpoint does not have."""

    def __init__(self, checkpoint: Checkpoint, seeds: Sequence[int] | None = None) -> None:
        network, self.checkpoint = checkpoint.network, checkpoint
        seeds = checkpoint.seeds if seeds is None else seeds
        if unknown := sorted(set(seeds) - set(checkpoint.seeds)):
            raise ValueError(f"no seed {unknown} in the checkpoint; it has {list(checkpoint.seeds)}.")
        chosen = [checkpoint.seeds.index(seed) for seed in seeds]
        weights = {name: value[chosen].double().cpu() for name, value in network.weights.items()}
        self._network, self._count = replace(network, weights=weights), 0
        self._run = FreeRun(self._network)
        self._angles: list[float] = []  # the last two of the history
        longest = max(network.architecture.delays, default=0.0)
        self._inputs: deque[list[float]] = deque(maxlen=math.ceil(longest / checkpoint.dt) + 2)

    @torch.inference_mode()
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
        network = self._network
        self._check(emg, where or f"sample {self._count + 1}")
        self._inputs.append([*(max(value, 0.0) for value in emg), *known])  # as the import has it
        self._count += 1
        inputs = torch.tensor([[*self._inputs]], dtype=torch.float64)
        x = network.encode_inputs(inputs, self.checkpoint.dt, self._count - len(self._inputs))[:, -1:]
        driven = drive(network, x.double())[:, :, 0]
        if self._count > network.history:
            return network.to_rad(self._run.step(driven))[:, 0].numpy()
        self._angles = [*self._angles[-1:], angle]
        encoded = network.encode_angle(torch.tensor(self._angles, dtype=torch.float64))
        z, v = (values[-1].double().expand(network.seeds, 1) for values in encoded)
        self._run.past.append((driven, z, v))
        return np.full(network.seeds, angle)

    def _check(self, emg: Sequence[float], where: str) -> None:
        largest = self.checkpoint.seen.high[: len(self.checkpoint.channels)]
        for name, value, high in zip(self.checkpoint.channels, emg, largest, strict=True):
            if has_sign(value, high) or not value <= UNSEEN_LIMIT:
                raise ValueError(
                    f"{where}: {name} is {value:g}, expected 0 to {UNSEEN_LIMIT:g}. Rectify and smooth the EMG, and "
                    "divide it by its value at maximum voluntary contraction, as was done for the training."
                )
