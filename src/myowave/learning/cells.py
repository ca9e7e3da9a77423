"""The cells of the network, GRUs, Eqs. 11-13 and 51-53, for all seeds at once.

A *history cell* sees EMG x_i and angle q_i of a past sample; the *current cell* sees only x_n, and its state gives the
output. Both have the same weights:

    driven     W_x x_i + b, and for a history cell + W_q q_i
    recurrent  W_h h_(i-1)
    new state  h_i = cell(recurrent, driven, h_(i-1))

Shapes: S seeds, B windows, K samples of a window of which m are history, X inputs, H hidden units, G gates.
"""

import torch
from torch import Tensor

from myowave.learning.network import Network


def apply_cell(network: Network, hidden: Tensor, driven: Tensor, recurrent: Tensor | None = None) -> Tensor:
    """The next hidden state (S, B, H): between the old one and a candidate, as the update gate says; `driven` is
    (S, B, G), and `recurrent` (S, B, G) where it is already known."""
    h, recurrent = hidden.shape[-1], recur(network, hidden) if recurrent is None else recurrent
    # Split, not sliced: the gradient of a split is one copy, that of each slice fills an array of its own.
    (gates, candidate), (gates_driven, candidate_driven) = (x.split((2 * h, h), dim=-1) for x in (recurrent, driven))
    reset, update = torch.sigmoid(gates + gates_driven).split(h, dim=-1)
    candidate = torch.tanh(torch.addcmul(candidate_driven, reset, candidate))
    # Eq. 11 adds b_h to the new state itself, outside of the gates.
    return torch.lerp(candidate, hidden, update) + network.weights["state_bias"]


def recur(network: Network, hidden: Tensor) -> Tensor:
    """W_h h of states (S, B, H): (S, B, G)."""
    return torch.bmm(hidden, network.weights["hidden"])


def drive(network: Network, x: Tensor) -> Tensor:
    """W_x x + b for every sample, (S, B, K, G), from inputs (B, K, X) or (S, B, K, X)."""
    flat, weights = x.flatten(-3, -2), network.weights
    flat = flat.expand(network.seeds, *flat.shape[-2:])
    return torch.baddbmm(weights["bias"], flat, weights["input"]).unflatten(1, x.shape[-3:-1])


def see(network: Network, driven: Tensor, z: Tensor, v: Tensor) -> Tensor:
    """What drives history cells: W_q q added to `driven` (S, B, G) or (S, B, K, G) of samples with angles z, v."""
    features = torch.stack((z, v), dim=-1) if network.architecture.increments else z.unsqueeze(-1)
    weight = network.weights["angle"]
    return driven + torch.matmul(features, weight if driven.dim() == 3 else weight.unsqueeze(1))


def warm_up(network: Network, driven: Tensor, z: Tensor, v: Tensor) -> Tensor:
    """Hidden state (S, B, H) after history cells, from 0, driven (S, B, m, G), of samples whose standardised angle and
    step are known (S, B, m)."""
    hidden = driven.new_zeros(*driven.shape[:2], network.architecture.hidden)
    for driven_i in see(network, driven, z, v).unbind(2):
        hidden = apply_cell(network, hidden, driven_i)
    return hidden


def read_out(network: Network, hidden: Tensor) -> Tensor:
    """The network's output (S, B) from the state of a current cell (S, B, H), Eq. 13."""
    return (torch.bmm(hidden, network.weights["output"]) + network.weights["output_bias"]).squeeze(-1)
