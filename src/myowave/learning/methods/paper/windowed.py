"""Predictions whose hidden state starts at 0 `history` samples before each of them, Eq. 15.

*Teacher forced* (Fig. 4a): all angles are given, so that every sample of a trial is predicted at once. *Free running*
(Fig. 4b): the network is fed by its own predictions, one after the other.

Shapes: S seeds, T trials, N samples, B windows, K samples of a window of which m are history, X inputs, G gates, H
hidden units.
"""

import torch
from torch import Tensor

from myowave.learning.cells import apply_cell, drive, read_out, see, warm_up
from myowave.learning.network import Network


def run_windowed(network: Network, x: Tensor, z: Tensor, v: Tensor) -> Tensor:
    """Predict windows from their history, free running.

    Args:
        x: inputs of all samples, (B, K, X).
        z, v: standardised angle and step of the history, (S, B, m).

    Returns:
        Standardised predictions, (S, B, K - m).
    """
    m, driven = network.history, drive(network, x)
    z, v = list(z.unbind(-1)), list(v.unbind(-1))
    for n in range(m, x.shape[1]):
        past = torch.stack(z[n - m : n], -1), torch.stack(v[n - m : n], -1)
        hidden = warm_up(network, driven[:, :, n - m : n], *past)
        output = read_out(network, apply_cell(network, hidden, driven[:, :, n]))
        for values, value in zip((z, v), network.move(output, z[-1], v[-1]), strict=True):
            values.append(value)
    return torch.stack(z[m:], dim=-1)


def predict_teacher_forced(network: Network, x: Tensor, angle: Tensor) -> Tensor:
    """Predict every sample from the given angles before it; differentiable in the weights.

    Args:
        x: network inputs, (T, N, X).
        angle: [rad], (T, N) or (S, T, N), float64.

    Returns:
        (S, T, N) [rad], float64; the first `network.history` samples are those given.
    """
    angle = angle.expand(network.seeds, *angle.shape[-2:])
    hidden, driven = states_before(network, x, angle)
    output = read_out(network, apply_cell(network, hidden, driven)).unflatten(1, (x.shape[0], -1)).double()
    return torch.cat([angle[..., : network.history], network.to_rad(output)], dim=-1)


def states_before(network: Network, x: Tensor, angle: Tensor) -> tuple[Tensor, Tensor]:
    """What the current cells of all predicted samples start from where all angles are given.

    Args:
        x: network inputs, (T, N, X).
        angle: [rad], (S, T, N).

    Returns:
        Hidden states (S, T (N - m), H) and what drives the current cells (S, T (N - m), G).
    """
    driven, m = drive(network, x), network.history
    seen, count = see(network, driven, *network.encode_angle(angle)), x.shape[1] - m
    steps = [seen[:, :, i : i + count].flatten(1, 2) for i in range(m)]
    hidden = _start(network, steps[0])
    for step in steps[1:]:
        hidden = apply_cell(network, hidden, step)
    return hidden, driven[:, :, m:].flatten(1, 2)


def _start(network: Network, driven: Tensor) -> Tensor:
    """The cell after a hidden state of 0, which needs no matrix product and no reset gate."""
    _, update, candidate = driven.chunk(3, dim=-1)
    return torch.sigmoid(-update) * torch.tanh(candidate) + network.weights["state_bias"]
