"""Derivatives of a prediction by the input t_n, as the text below Eq. 18 takes them.

Only the current cell sees t_n: EMG and history stay, so this is not the derivative of the motion.

Shapes: S seeds, T trials, N samples, X inputs, B cells, H hidden units, G gates.
"""

import torch
from torch import Tensor

from myowave.learning.cells import recur
from myowave.learning.methods.paper.windowed import states_before
from myowave.learning.network import Network


def predict_with_time_derivatives(network: Network, x: Tensor, angle: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Teacher-forced prediction and its first two derivatives by t_n, (S, T, N) each [rad, rad/s, rad/s^2].

    The first samples are those given, with derivatives 0.

    Args:
        x: network inputs, (T, N, X).
        angle: [rad], (T, N) or (S, T, N), float64.
    """
    angle = angle.expand(network.seeds, *angle.shape[-2:])
    hidden, driven = states_before(network, x, angle)
    slope = network.weights["input"][:, -1:]  # of `driven` by t_n, the last input
    cells = differentiate_cell(network, hidden, driven, slope)
    value, first, second = (
        torch.bmm(cell, network.weights["output"]).unflatten(1, (x.shape[0], -1)).squeeze(-1) for cell in cells
    )
    value = network.to_rad(value + network.weights["output_bias"])
    std, duration = network.scaling.angle_std, network.scaling.duration
    given = angle[..., : network.history]
    still = torch.zeros_like(given)
    return (
        torch.cat((given, value), dim=-1),
        torch.cat((still, first.double() * std / duration), dim=-1),
        torch.cat((still, second.double() * std / duration**2), dim=-1),
    )


def differentiate_cell(
    network: Network, hidden: Tensor, driven: Tensor, slope: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """A cell's next hidden state and its first two derivatives as `driven` moves along `slope`, (S, B, H) each.

    Args:
        hidden: (S, B, H).
        driven: (S, B, G).
        slope: (S, 1, G).
    """
    recurrent = recur(network, hidden)
    h = hidden.shape[-1]
    (gates, candidate), (gates_driven, candidate_driven), (gates_slope, candidate_slope) = (
        x.split((2 * h, h), dim=-1) for x in (recurrent, driven, slope)
    )
    gates = torch.sigmoid(gates + gates_driven)
    first = gates * (1 - gates) * gates_slope
    second = first * (1 - 2 * gates) * gates_slope
    (r, u), (r1, u1), (r2, u2) = (g.split(h, dim=-1) for g in (gates, first, second))
    c, c1, c2 = _differentiate_tanh(
        torch.addcmul(candidate_driven, r, candidate), torch.addcmul(candidate_slope, r1, candidate), r2 * candidate
    )
    gap = hidden - c
    new = torch.addcmul(c, u, gap) + network.weights["state_bias"]
    stay = 1 - u
    return new, torch.addcmul(u1 * gap, stay, c1), u2 * gap + torch.addcmul(stay * c2, u1, c1, value=-2)


def _differentiate_tanh(p: Tensor, p1: Tensor, p2: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """tanh(p) and its derivatives from those of p."""
    c = torch.tanh(p)
    slack = 1 - c * c
    return c, slack * p1, slack * (p2 - 2 * c * p1 * p1)
