"""From EMG to motion with a trained network.

*Free running* (Fig. 4b): the first `history` angles are given, all others are the network's own. *Teacher forced*:
every angle before the predicted one is given. `streaming` runs free on one sample of EMG at a time.

Shapes: S seeds, T trials, N samples, C channels, H hidden units.
"""

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.network import (
    Architecture,
    Scaling,
    Weights,
    angle_features,
    apply_cell,
    encode_angle,
    encode_inputs,
    read_out,
)
from myowave.learning.rollout import Units, drive, roll_out, warm_up


@dataclass(frozen=True)
class Network:
    """A network and how it is to be used.

    Args:
        carried: the hidden state is handed on from sample to sample; else it starts at 0 for every prediction.
        history: samples with a known angle before the first prediction.
    """

    architecture: Architecture
    scaling: Scaling
    weights: Weights
    carried: bool
    history: int

    @classmethod
    def of(cls, checkpoint: Checkpoint) -> "Network":
        recipe = checkpoint.recipe
        return cls(
            checkpoint.architecture,
            checkpoint.scaling,
            checkpoint.weights,
            recipe["hidden_state"] == "carried",
            recipe["history_steps"],
        )

    @property
    def units(self) -> Units:
        return Units.of(self.scaling)

    def encode(self, emg: Tensor, dt: float) -> Tensor:
        """Network inputs (T, N, X) from EMG (T, N, C)."""
        time = torch.arange(emg.shape[-2], dtype=emg.dtype, device=emg.device) * dt
        return encode_inputs(self.architecture, self.scaling, emg, time)

    def to_rad(self, z: Tensor) -> Tensor:
        """Angle [rad] from standardised predictions, float64."""
        return z.double() * self.scaling.angle_std + self.scaling.angle_mean


@torch.no_grad()
def predict_free_running(network: Network, emg: Tensor, angle: Tensor, dt: float) -> Tensor:
    """Predict trials from EMG and the first `network.history` angles.

    Args:
        emg: (T, N, C) [-].
        angle: [rad], (T, n) with n at least `network.history`; what comes after is not read.

    Returns:
        (S, T, N) [rad]; the first `network.history` samples are those given.
    """
    m = network.history
    seeds = network.weights["hidden"].shape[0]
    given = angle[:, :m].double().expand(seeds, -1, -1)
    x, (z, v) = network.encode(emg, dt), encode_angle(network.scaling, given)
    # In float64, a trial of thousands of samples comes out the same in any order of summation, as `streaming` needs.
    weights = {name: value.double() for name, value in network.weights.items()}
    free = run_free(replace(network, weights=weights), x.double(), z.double(), v.double())
    return torch.cat([given, network.to_rad(free)], dim=-1)


def run_free(network: Network, x: Tensor, z: Tensor, v: Tensor) -> Tensor:
    """Free run of windows: inputs (B, K, X), standardised history (S, B, m); standardised predictions (S, B, K - m)."""
    if network.carried:
        return roll_out(network.architecture, network.units, network.weights, x, z, v)
    return _run_windowed(network, x, z, v)


def _run_windowed(network: Network, x: Tensor, z: Tensor, v: Tensor) -> Tensor:
    """Free run with a fresh hidden state for every sample: (S, T, N - m), standardised."""
    m, driven = network.history, drive(network.weights, x)
    z, v = list(z.unbind(-1)), list(v.unbind(-1))
    for n in range(m, x.shape[1]):
        past = torch.stack(z[n - m : n], -1), torch.stack(v[n - m : n], -1)
        hidden = warm_up(network.architecture, network.weights, driven[:, :, n - m : n], *past)
        hidden = apply_cell(network.architecture.cell, network.weights, hidden, driven[:, :, n])
        output = read_out(network.weights, hidden)
        zn, vn = step_angle(network, output, z[-1], v[-1])
        z.append(zn)
        v.append(vn)
    return torch.stack(z[m:], dim=-1)


def step_angle(network: Network, output: Tensor, z: Tensor, v: Tensor) -> tuple[Tensor, Tensor]:
    """Standardised angle and step of a sample from the network's output and those of the sample before."""
    if network.architecture.increments:
        v = v + network.units.bend * output
        return z + network.units.step * v, v
    return output, (output - z) / network.units.step


def predict_teacher_forced(network: Network, x: Tensor, angle: Tensor) -> Tensor:
    """Predict every sample from the given angles before it; differentiable in the weights.

    Args:
        x: network inputs, (T, N, X).
        angle: [rad], (T, N) or (S, T, N), float64.

    Returns:
        (S, T, N) [rad], float64; the first `network.history` samples (at least 2 for increments) are those given.
    """
    architecture, scaling, weights = network.architecture, network.scaling, network.weights
    angle = angle.expand(weights["hidden"].shape[0], *angle.shape[-2:])
    driven, states = follow(network, x, angle)
    first = x.shape[1] - states.shape[2]
    current = driven[:, :, first:]
    hidden = apply_cell(architecture.cell, weights, states.flatten(1, 2), current.flatten(1, 2))
    output = read_out(weights, hidden).unflatten(1, current.shape[1:3]).double()
    if architecture.increments:
        line = 2 * angle[..., first - 1 : -1] - angle[..., first - 2 : -2]
        predicted = line + scaling.bend_std * output
    else:
        predicted = network.to_rad(output)
    return torch.cat([angle[..., :first], predicted], dim=-1)


def follow(network: Network, x: Tensor, angle: Tensor) -> tuple[Tensor, Tensor]:
    """Hidden state before every predicted sample where all angles are given.

    Args:
        x, angle: as for `predict_teacher_forced`, angle (S, T, N).

    Returns:
        `drive` of all samples (S, T, N, G), and states (S, T, N - first, H).
    """
    driven = drive(network.weights, x)
    features = angle_features(network.architecture, *encode_angle(network.scaling, angle))
    seen = driven + torch.matmul(features, network.weights["angle"].unsqueeze(1))
    first = max(network.history, network.architecture.features)
    return driven, _carry(network, seen, first) if network.carried else _window(network, seen, first)


def _carry(network: Network, seen: Tensor, first: int) -> Tensor:
    """Hidden state before every predicted sample, carried through the trial: (S, T, N - first, H)."""
    hidden = seen.new_zeros(*seen.shape[:2], network.architecture.hidden)
    states = []
    for n, seen_n in enumerate(seen[:, :, :-1].unbind(2)):
        hidden = apply_cell(network.architecture.cell, network.weights, hidden, seen_n)
        if n >= first - 1:
            states.append(hidden)
    return torch.stack(states, dim=2)


def _window(network: Network, seen: Tensor, first: int) -> Tensor:
    """Hidden state before every predicted sample from its own history, all at once: (S, T, N - first, H)."""
    m, count = network.history, seen.shape[2] - first
    hidden = None
    for i in range(first - m, first):
        hidden = apply_cell(network.architecture.cell, network.weights, hidden, seen[:, :, i : i + count].flatten(1, 2))
    return hidden.unflatten(1, (seen.shape[1], count))


def to_tensors(trials: Trials, device: torch.device) -> tuple[Tensor, Tensor]:
    """EMG (T, N, C) and angle (T, N) [rad] of trials, float64; copies, so that trials stay as they are."""
    return torch.tensor(trials.emg, device=device), torch.tensor(trials.angle, device=device)
