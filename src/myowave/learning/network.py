"""The recurrent network: cells of Eqs. 8-13 and 51-53, for all seeds at once.

A *history cell* sees EMG x_i and angle q_i of a past sample; the *current cell* sees x_n alone and predicts. Both
have the same weights. Every weight has a leading axis for seeds, so that one matrix product serves all of them.

Inputs and outputs are standardised with numbers of the training trials (`Scaling`). The output is the angle itself
(`absolute`, Eq. 13) or an increment on linear extrapolation, q_n = 2 q_(n-1) - q_(n-2) + net: then the network has to
learn a small, smooth acceleration only, and the history cell also sees the last step q_i - q_(i-1).

Shapes: S seeds, B windows, K samples of a window, X inputs, Q angle features, H hidden units, G = 3 H (GRU) or H (RNN).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from myowave.data.trials import Trials

Weights = Mapping[str, Tensor]


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

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


def initialise(architecture: Architecture, seeds: Sequence[int], device: torch.device) -> dict[str, Tensor]:
    """Fresh weights; those of a seed depend on that seed alone."""
    each = [_initialise_one(architecture, seed) for seed in seeds]
    return {name: torch.stack([weights[name] for weights in each]).to(device) for name in each[0]}


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


def encode_inputs(architecture: Architecture, scaling: Scaling, emg: Tensor, time: Tensor) -> Tensor:
    """Network inputs x_n = [e_n, t_n], standardised.

    Args:
        emg: (..., N, C) [-].
        time: (N,) [s].

    Returns:
        (..., N, X), float32.
    """
    mean, std = (torch.as_tensor(v, dtype=emg.dtype, device=emg.device) for v in (scaling.emg_mean, scaling.emg_std))
    x = (emg - mean) / std
    if architecture.time_input:
        fraction = (time / scaling.duration).unsqueeze(-1).expand(*emg.shape[:-1], 1)
        x = torch.cat([x, fraction], dim=-1)
    return x.float()


def encode_angle(scaling: Scaling, angle: Tensor) -> tuple[Tensor, Tensor]:
    """Standardised angle z and step v = q_n - q_(n-1) of sequences (..., N) [rad]; the first step counts as 0."""
    z = (angle - scaling.angle_mean) / scaling.angle_std
    v = torch.diff(angle, dim=-1, prepend=angle[..., :1]) / scaling.step_std
    return z.float(), v.float()


def angle_features(architecture: Architecture, z: Tensor, v: Tensor) -> Tensor:
    """What a history cell sees of the angle, (..., Q)."""
    return torch.stack((z, v), dim=-1) if architecture.increments else z.unsqueeze(-1)


def apply_cell(
    cell: str, weights: Weights, hidden: Tensor | None, driven: Tensor, recurrent: Tensor | None = None
) -> Tensor:
    """One cell: the next hidden state, Eqs. 8-9 and 11-12.

    Args:
        hidden: h_(i-1), (S, B, H); None where it is 0.
        driven: W_x x + b, and for a history cell + W_q q, (S, B, G).
        recurrent: W_h h_(i-1) where it is already known, (S, B, G).
    """
    if hidden is None:
        return _start_cell(cell, weights, driven)
    if recurrent is None:
        recurrent = torch.bmm(hidden, weights["hidden"])
    if cell == "rnn":
        return torch.tanh(recurrent + driven)
    h = hidden.shape[-1]
    # Split, not sliced: the gradient of a split is one copy, that of each slice fills an array of its own.
    (gates, held), (gates_driven, candidate_driven) = (x.split((2 * h, h), dim=-1) for x in (recurrent, driven))
    reset, update = torch.sigmoid(gates + gates_driven).split(h, dim=-1)
    candidate = torch.tanh(torch.addcmul(candidate_driven, reset, held))
    # Eq. 11 adds b_h to the new state itself, outside of the gates.
    return torch.lerp(candidate, hidden, update) + weights["state_bias"]


def _start_cell(cell: str, weights: Weights, driven: Tensor) -> Tensor:
    """The cell after a hidden state of 0, which needs no matrix product and no reset gate."""
    if cell == "rnn":
        return torch.tanh(driven)
    _, update, candidate = driven.chunk(3, dim=-1)
    return torch.sigmoid(-update) * torch.tanh(candidate) + weights["state_bias"]


def differentiate_cell(
    cell: str, weights: Weights, hidden: Tensor, driven: Tensor, slope: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """A cell's next hidden state and its first two derivatives as `driven` moves along `slope`, (S, B, H) each.

    Args:
        slope: (S, 1, G); the other arguments as for `apply_cell`.
    """
    recurrent = torch.bmm(hidden, weights["hidden"])
    if cell == "rnn":
        return _differentiate_tanh(recurrent + driven, slope, torch.zeros_like(slope))
    h = hidden.shape[-1]
    (gates, held), (gates_driven, candidate_driven), (gates_slope, candidate_slope) = (
        x.split((2 * h, h), dim=-1) for x in (recurrent, driven, slope)
    )
    gates = torch.sigmoid(gates + gates_driven)
    first = gates * (1 - gates) * gates_slope
    second = first * (1 - 2 * gates) * gates_slope
    (r, u), (r1, u1), (r2, u2) = (g.split(h, dim=-1) for g in (gates, first, second))
    c, c1, c2 = _differentiate_tanh(
        torch.addcmul(candidate_driven, r, held), torch.addcmul(candidate_slope, r1, held), r2 * held
    )
    gap = hidden - c
    new = torch.addcmul(c, u, gap) + weights["state_bias"]
    stay = 1 - u
    return new, torch.addcmul(u1 * gap, stay, c1), u2 * gap + torch.addcmul(stay * c2, u1, c1, value=-2)


def _differentiate_tanh(p: Tensor, p1: Tensor, p2: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """tanh(p) and its derivatives from those of p."""
    c = torch.tanh(p)
    slack = 1 - c * c
    return c, slack * p1, slack * (p2 - 2 * c * p1 * p1)


def read_out(weights: Weights, hidden: Tensor) -> Tensor:
    """The network's output from a current cell's state (S, ..., H): (S, ...), Eqs. 10 and 13."""
    flat = hidden.flatten(1, -2)
    return (torch.bmm(flat, weights["output"]) + weights["output_bias"]).reshape(hidden.shape[:-1])
