"""The recurrent network: what it looks like, its weights for all seeds at once, and what it sees of EMG and angle.

Every weight has a leading axis for seeds, so that one matrix product serves all of them.

Inputs and outputs are standardised with numbers of the training trials (`Scaling`). The output is the angle itself
(`absolute`, Eq. 13) or an increment on linear extrapolation, q_n = 2 q_(n-1) - q_(n-2) + net: then the network has to
learn a small, smooth acceleration only, and the history cell also sees the last step q_i - q_(i-1).

Shapes: S seeds, B windows, N samples, C channels, X inputs, Q angle features, H hidden units, G = 3 H (GRU) or H (RNN).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import torch
from torch import Tensor

from myowave.data.trials import Trials

Weights = Mapping[str, Tensor]
Array = TypeVar("Array", Tensor, np.ndarray)


@dataclass(frozen=True)
class Architecture:
    """What the network looks like; see `settings.Recipe` for the meaning of each choice."""

    cell: str
    hidden: int
    channels: int
    increments: bool
    time_input: bool

    @property
    def inputs(self) -> int:
        """Number of inputs X: EMG channels, and time where it is one."""
        return self.channels + self.time_input

    @property
    def features(self) -> int:
        """Number of angle features Q of a history cell: the angle, and its last step."""
        return 2 if self.increments else 1

    @property
    def gates(self) -> int:
        """Width G of all gates together."""
        return self.hidden * (3 if self.cell == "gru" else 1)


@dataclass(frozen=True)
class Scaling:
    """Numbers that make inputs and outputs of order one, from the training trials at scale [0].

    Args:
        emg_mean, emg_std: of each channel [-].
        angle_mean, angle_std: [rad].
        step_std: of q_n - q_(n-1) [rad].
        bend_std: of q_n - 2 q_(n-1) + q_(n-2) [rad], what an increment network has to output.
        duration: of the longest trial [s]; time enters as a fraction of it.
    """

    emg_mean: tuple[float, ...]
    emg_std: tuple[float, ...]
    angle_mean: float
    angle_std: float
    step_std: float
    bend_std: float
    duration: float

    @classmethod
    def of(cls, trials: Trials) -> "Scaling":
        """Scaling of some trials, all of which count."""
        emg = np.concatenate([e[:n] for e, n in zip(trials.emg, trials.lengths, strict=True)])
        angle = [q[:n] for q, n in zip(trials.angle, trials.lengths, strict=True)]
        floor = 1e-6  # a signal that never changes must not be divided by zero
        return cls(
            emg_mean=tuple(emg.mean(0).tolist()),
            emg_std=tuple(np.maximum(emg.std(0), floor).tolist()),
            angle_mean=float(np.concatenate(angle).mean()),
            angle_std=float(max(np.concatenate(angle).std(), floor)),
            step_std=float(max(np.concatenate([np.diff(q) for q in angle]).std(), floor)),
            bend_std=float(max(np.concatenate([np.diff(q, n=2) for q in angle]).std(), floor)),
            duration=float(max(trials.lengths) * trials.dt),
        )

    @property
    def bend(self) -> float:
        """How far an output of 1 moves the standardised step of an increment network [-]."""
        return self.bend_std / self.step_std

    @property
    def step(self) -> float:
        """How far a standardised step of 1 moves the standardised angle [-]."""
        return self.step_std / self.angle_std


@dataclass(frozen=True)
class Network:
    """A network and how it is used.

    Args:
        hidden_state: `carried` from sample to sample, or `windowed`: it starts at 0 for every prediction.
        history: samples with a known angle before the first prediction.
    """

    architecture: Architecture
    scaling: Scaling
    weights: Weights
    hidden_state: str
    history: int

    @property
    def seeds(self) -> int:
        """Number of seeds S."""
        return self.weights["hidden"].shape[0]

    @property
    def device(self) -> torch.device:
        return self.weights["hidden"].device

    def to(self, device: torch.device) -> "Network":
        """The same on another device."""
        return replace(self, weights={name: value.to(device) for name, value in self.weights.items()})

    def trainable(self) -> "Network":
        """A copy whose weights take gradients."""
        return replace(self, weights={name: w.detach().clone().requires_grad_() for name, w in self.weights.items()})

    def encode_emg(self, emg: Tensor, dt: float) -> Tensor:
        """Inputs x_n = [e_n, t_n], standardised, (T, N, X), float32, from EMG (T, N, C) [-] `dt` apart [s]."""
        scaling = self.scaling
        mean, std = (
            torch.as_tensor(v, dtype=emg.dtype, device=emg.device) for v in (scaling.emg_mean, scaling.emg_std)
        )
        x = (emg - mean) / std
        if self.architecture.time_input:
            time = torch.arange(emg.shape[-2], dtype=emg.dtype, device=emg.device) * dt
            fraction = (time / scaling.duration).unsqueeze(-1).expand(*emg.shape[:-1], 1)
            x = torch.cat([x, fraction], dim=-1)
        return x.float()

    def encode_angle(self, angle: Tensor) -> tuple[Tensor, Tensor]:
        """Standardised angle z and step v = q_n - q_(n-1), float32, of sequences (..., N) [rad]; the first v is 0."""
        z = (angle - self.scaling.angle_mean) / self.scaling.angle_std
        v = torch.diff(angle, dim=-1, prepend=angle[..., :1]) / self.scaling.step_std
        return z.float(), v.float()

    def to_rad(self, z: Tensor) -> Tensor:
        """Angle [rad], float64, from standardised predictions."""
        return z.double() * self.scaling.angle_std + self.scaling.angle_mean

    def move(self, output: Array, z: Array, v: Array) -> tuple[Array, Array]:
        """Standardised angle and step of a sample from the network's output and those of the sample before."""
        if self.architecture.increments:
            v = v + self.scaling.bend * output
            return z + self.scaling.step * v, v
        return output, (output - z) / self.scaling.step


def initialise(architecture: Architecture, seeds: Sequence[int]) -> dict[str, Tensor]:
    """Fresh weights; those of a seed depend on that seed only."""
    each = [_initialise_one(architecture, seed) for seed in seeds]
    return {name: torch.stack([weights[name] for weights in each]) for name in each[0]}


def _initialise_one(architecture: Architecture, seed: int) -> dict[str, Tensor]:
    random = torch.Generator().manual_seed(seed)
    h, g = architecture.hidden, architecture.gates

    def uniform(rows: int, columns: int) -> Tensor:
        return (2 * torch.rand(rows, columns, generator=random) - 1) / math.sqrt(h)

    weights = {
        "hidden": uniform(h, g),
        "input": uniform(architecture.inputs, g),
        "angle": uniform(architecture.features, g),
        "bias": torch.zeros(1, g),
        "output": uniform(h, 1),
        "output_bias": torch.zeros(1, 1),
    }
    return weights if architecture.cell == "rnn" else {**weights, "state_bias": torch.zeros(1, h)}
