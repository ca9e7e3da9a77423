"""The recurrent network: what it looks like, its weights for all seeds at once, and what it sees of EMG and angle.

Every weight has a leading axis for seeds, so that one matrix product serves all of them. Inputs and outputs are
standardised with numbers of the training trials (`Scaling`). The output of the paper's network is the angle itself
(Eq. 13), and it sees the time t_n. That of a rollout is an increment on linear extrapolation, q_n = 2 q_(n-1) - q_(n-2)
+ net: then the network has to learn a small, smooth acceleration only, and the history cell also sees the last step.

Shapes: S seeds, B windows, N samples, C channels, K known inputs, X inputs, Q angle features, H hidden units, G = 3 H.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
import torch
from pydantic import Field
from torch import Tensor

from myowave.data.trials import Trials
from myowave.learning.inputs import Given, Known, given_inputs, unit_of
from myowave.physics.simulation import between_samples

Weights = Mapping[str, Tensor]
# What the numbers of a network can be; `checkpoint` refuses others.
Finite = Annotated[float, Field(allow_inf_nan=False)]
Size = Annotated[float, Field(gt=1e-12, allow_inf_nan=False)]


@dataclass(frozen=True)
class Architecture:
    """What the network looks like."""

    method: str  # that trains it, see `methods`
    # hidden, channels: number of units H and of EMG channels C
    hidden: int
    channels: int
    history: Annotated[int, Field(ge=1, le=1000)]  # samples with a known angle before the first prediction
    given: Given = field(default_factory=Given)  # what it is given beside EMG, see `inputs`
    # [s] after which it sees the channels; () where it sees them at once
    delays: tuple[Annotated[float, Field(ge=0, le=1)], ...] = ()

    @property
    def known(self) -> Known:
        return self.given.known

    @property
    def increments(self) -> bool:
        """Whether it gives increments and hands its state on from sample to sample; else, as the paper prints it, it
        gives angles, sees the time, and its state starts at 0 for every prediction."""
        return self.method != "paper"

    @property
    def inputs(self) -> int:
        """Number of inputs X: EMG channels, what is told beside them, and time where it is one."""
        return self.channels + len(self.given.told) + (not self.increments)

    @property
    def features(self) -> int:
        """Number of angle features Q of a history cell: the angle, and its last step."""
        return 2 if self.increments else 1

    @property
    def shapes(self) -> dict[str, tuple[int, int]]:
        """Shapes of the weights of one seed, by name."""
        h, gates = self.hidden, 3 * self.hidden
        return {
            "hidden": (h, gates),
            "input": (self.inputs, gates),
            "angle": (self.features, gates),
            "bias": (1, gates),
            "output": (h, 1),
            "output_bias": (1, 1),
            "state_bias": (1, h),
        }


@dataclass(frozen=True)
class Scaling:
    """Numbers that make inputs and outputs of order one, from the training trials at scale [0]."""

    # input_mean, input_std: of each EMG channel [-], or [1/(N m)] where it counts over a torque, then of each input
    # that is told beside it in its own unit; angles count in units of the elbow's where they move less
    input_mean: tuple[Finite, ...]
    input_std: tuple[Size, ...]
    # angle_mean, angle_std: [rad]
    angle_mean: Finite
    angle_std: Size
    step_std: Size  # of q_n - q_(n-1) [rad]
    bend_std: Size  # of q_n - 2 q_(n-1) + q_(n-2) [rad], what an increment network has to output
    duration: Size  # of the longest trial [s]; time enters as a fraction of it

    @classmethod
    def of(cls, trials: Trials, given: Given | None = None) -> "Scaling":
        """Scaling of some trials, all of which count, and of what is given of them."""
        given, valid = given or Given(), trials.valid
        inputs, angle = given.see(given_inputs(trials, given.known))[valid], trials.angle[valid]
        floor = 1e-6  # a signal that never changes must not be divided by zero
        input_std, angle_std = np.maximum(inputs.std(0), floor), float(max(angle.std(), floor))
        # A posture that hardly changes would tell the network which trial it sees, were it blown up to order one.
        for i, name in enumerate(given.told, start=len(trials.channels)):
            input_std[i] = max(input_std[i], angle_std) if unit_of(name) == "rad" else input_std[i]
        return cls(
            input_mean=tuple(inputs.mean(0).tolist()),
            input_std=tuple(input_std.tolist()),
            angle_mean=float(angle.mean()),
            angle_std=angle_std,
            step_std=float(max(np.diff(trials.angle)[valid[:, 1:]].std(), floor)),
            bend_std=float(max(np.diff(trials.angle, n=2)[valid[:, 2:]].std(), floor)),
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
    """A network: what it looks like, its scaling and its weights."""

    architecture: Architecture
    scaling: Scaling
    weights: Weights

    @property
    def history(self) -> int:
        return self.architecture.history

    @property
    def seeds(self) -> int:
        return self.weights["hidden"].shape[0]

    @property
    def device(self) -> torch.device:
        return self.weights["hidden"].device

    def trainable(self, device: torch.device | None = None) -> "Network":
        """A copy, on another device where one is named, whose weights take gradients."""
        weights = {name: w.detach().clone().to(device).requires_grad_() for name, w in self.weights.items()}
        return replace(self, weights=weights)

    def encode_inputs(self, inputs: Tensor, dt: float, first: int = 0) -> Tensor:
        """Inputs x_n = [e_n, told, t_n], standardised, (T, N, X), float32, from `given_inputs` `dt` apart [s], which
        begin with the sample of the number `first` of their trial."""
        scaling, inputs = self.scaling, self.architecture.given.see(inputs)
        if delays := self.architecture.delays:
            at_once = [0.0] * (inputs.shape[-1] - len(delays))
            inputs = delayed(inputs, [*(d / dt for d in delays), *at_once])
        x = (inputs - inputs.new_tensor(scaling.input_mean)) / inputs.new_tensor(scaling.input_std)
        if not self.architecture.increments:
            time = torch.arange(x.shape[-2], dtype=x.dtype, device=x.device).add(first) * dt
            x = torch.cat([x, (time / scaling.duration).unsqueeze(-1).expand(*x.shape[:-1], 1)], dim=-1)
        return x.float()

    def encode_angle(self, angle: Tensor) -> tuple[Tensor, Tensor]:
        """Standardised angle z and step v = q_n - q_(n-1), float32, of sequences (..., N) [rad]; the first v is 0."""
        z = (angle - self.scaling.angle_mean) / self.scaling.angle_std
        v = torch.diff(angle, dim=-1, prepend=angle[..., :1]) / self.scaling.step_std
        return z.float(), v.float()

    def to_rad(self, z: Tensor) -> Tensor:
        """Angle [rad], float64, from standardised predictions."""
        return z.double() * self.scaling.angle_std + self.scaling.angle_mean

    def move(self, output: Tensor, z: Tensor, v: Tensor) -> tuple[Tensor, Tensor]:
        """Standardised angle and step of a sample from the network's output and those of the sample before."""
        if self.architecture.increments:
            v = v + self.scaling.bend * output
            return z + self.scaling.step * v, v
        return output, (output - z) / self.scaling.step


def delayed(inputs: Tensor, samples: Sequence[float]) -> Tensor:
    """Inputs (..., N, C) as they were some samples before, each by its own: linear between samples, and as the first
    before them."""
    place = torch.arange(inputs.shape[-2], dtype=inputs.dtype, device=inputs.device)
    return between_samples(inputs, place[:, None, None] - inputs.new_tensor(samples)).squeeze(-2)


def initialise(architecture: Architecture, seeds: Sequence[int]) -> dict[str, Tensor]:
    """Fresh weights; those of a seed depend on that seed only."""
    randoms, weights = [torch.Generator().manual_seed(seed) for seed in seeds], {}
    for name, shape in architecture.shapes.items():
        if name.endswith("bias"):
            weights[name] = torch.zeros(len(seeds), *shape)
        else:
            drawn = torch.stack([torch.rand(shape, generator=random) for random in randoms])
            weights[name] = (2 * drawn - 1) / math.sqrt(architecture.hidden)
    return weights
