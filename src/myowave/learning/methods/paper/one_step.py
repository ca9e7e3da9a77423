"""Predictions of one step, from a hidden state that starts at 0 `history` samples before, Eq. 15: all angles are given
(teacher forced, Fig. 4a), so that every sample of a trial is predicted at once. `prediction` runs free.

Shapes: S seeds, T trials, N samples of which m are history, X inputs, G gates, H hidden units.
"""

import torch
import torch.nn.functional as F
from torch import Tensor

from myowave.learning.network import Network
from myowave.learning.prediction import apply_cell, drive, read_out, see


def predict_teacher_forced(network: Network, x: Tensor, angle: Tensor) -> Tensor:
    """Every sample predicted from network inputs x (T, N, X) and the given angles before it, (T, N) or (S, T, N);
    (S, T, N) [rad], float64; the first are those given."""
    return _predict(network, x, angle, *_states_before(network, x, angle))


def predict_with_time_derivatives(network: Network, x: Tensor, angle: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """`predict_teacher_forced` and its first two derivatives by the input t_n, as the text below Eq. 18 takes them,
    (S, T, N) each [rad, rad/s, rad/s^2], 0 of the first samples.

    Only the current cell sees t_n: EMG and history stay, so this is not the derivative of the motion.
    """
    hidden, driven = _states_before(network, x, angle)
    time = driven.new_zeros(*driven.shape[:2], 1, requires_grad=True)  # beside t_n, of each prediction its own
    slope = network.weights["input"][:, -1:]  # of `driven` by t_n, the last input
    value = _predict(network, x, angle, hidden, driven + time * slope)
    derivatives, along = [], value
    for _ in range(2):
        (along,) = torch.autograd.grad(along.sum(), time, create_graph=True)
        along = along / network.scaling.duration  # as time enters as a fraction of it
        derivatives.append(F.pad(along.double().squeeze(-1).unflatten(1, (x.shape[0], -1)), (network.history, 0)))
    first, second = derivatives
    return value, first, second


def _predict(network: Network, x: Tensor, angle: Tensor, hidden: Tensor, driven: Tensor) -> Tensor:
    """What current cells give from the states before them, after the angles that are given, (S, T, N) [rad]."""
    output = read_out(network, apply_cell(network, hidden, driven)).unflatten(1, (x.shape[0], -1)).double()
    given = angle[..., : network.history].expand(*output.shape[:2], -1)
    return torch.cat([given, network.to_rad(output)], dim=-1)


def _states_before(network: Network, x: Tensor, angle: Tensor) -> tuple[Tensor, Tensor]:
    """What the current cells of all predicted samples start from where all angles are given: hidden states
    (S, T (N - m), H) and what drives the current cells (S, T (N - m), G)."""
    driven, m = drive(network, x), network.history
    angle = angle.expand(network.seeds, *angle.shape[-2:])
    seen, count = see(network, driven, *network.encode_angle(angle)), x.shape[1] - m
    steps = [seen[:, :, i : i + count].flatten(1, 2) for i in range(m)]
    # The cell after a hidden state of 0 needs no matrix product and no reset gate.
    _, update, candidate = steps[0].chunk(3, dim=-1)
    hidden = torch.sigmoid(-update) * torch.tanh(candidate) + network.weights["state_bias"]
    for step in steps[1:]:
        hidden = apply_cell(network, hidden, step)
    return hidden, driven[:, :, m:].flatten(1, 2)
