"""Rollouts: the network fed by its own predictions, with the hidden state carried along (Fig. 4b, Fig. 5).

A window has `history` samples where the angle is given, then samples where it is predicted. The hidden state starts at
0 and is carried from sample to sample: the history cell and the current cell of a sample share W_h h_(n-1) and W_x x_n
and differ only by W_q q_n, so a step costs one product with W_h instead of one for each sample of history.

This is the definition, in plain torch; `fast` is the same map with a backward pass by hand.

Shapes: S seeds, B windows, K samples of a window of which m are history, X inputs.
"""

import torch
from torch import Tensor

from myowave.learning.cells import apply_cell, drive, read_out, recur, see, warm_up
from myowave.learning.network import Network


def roll_out(network: Network, x: Tensor, z: Tensor, v: Tensor) -> Tensor:
    """Standardised predictions (S, B, K - m) of windows from the inputs of all samples, (B, K, X) or (S, B, K, X), and
    the standardised angle and step of the history, (S, B, m)."""
    history, driven = z.shape[-1], drive(network, x)
    hidden = warm_up(network, driven[:, :, :history], z, v)
    z, v = z[..., -1], v[..., -1]
    predicted = []
    for driven_n in driven[:, :, history:].unbind(2):
        recurrent = recur(network, hidden)
        current = apply_cell(network, hidden, driven_n, recurrent)
        z, v = network.move(read_out(network, current), z, v)
        hidden = apply_cell(network, hidden, see(network, driven_n, z, v), recurrent)
        predicted.append(z)
    return torch.stack(predicted, dim=-1)
