"""From EMG to motion with a trained network, free running (Fig. 4b): the first `history` angles are given, all others
are the network's own. `streaming` does the same on one sample of EMG at a time.

Shapes: S seeds, T trials, N samples, C channels, X inputs, B windows, K samples of a window of which m are history.
"""

from dataclasses import replace

import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.learning.cells import apply_cell, drive, read_out, recur, see, warm_up
from myowave.learning.inputs import to_tensors
from myowave.learning.network import Network


def predict_motion(network: Network, trials: Trials) -> Tensor:
    """Free-running prediction of trials from their EMG and known inputs, (S, T, N) [rad], on the CPU."""
    inputs, angle = to_tensors(trials, network.device, network.architecture.known)
    return predict_free_running(network, inputs, angle, trials.dt).cpu()


@torch.no_grad()
def predict_free_running(network: Network, inputs: Tensor, angle: Tensor, dt: float) -> Tensor:
    """Predict trials, (S, T, N) [rad], from inputs (T, N, C + K), see `given_inputs`, and the first `network.history`
    angles [rad], which are those of the prediction; later ones are not read."""
    given = angle[:, : network.history].double().expand(network.seeds, -1, -1)
    x, (z, v) = network.encode_inputs(inputs, dt), network.encode_angle(given)
    # In float64, a trial of thousands of samples comes out the same in any order of summation, as `streaming` needs.
    weights = {name: value.double() for name, value in network.weights.items()}
    free = run_free(replace(network, weights=weights), x.double(), z.double(), v.double())
    return torch.cat([given, network.to_rad(free)], dim=-1)


def run_free(network: Network, x: Tensor, z: Tensor, v: Tensor) -> Tensor:
    """Standardised predictions (S, B, K - m) of windows from the inputs of all samples, (B, K, X) or (S, B, K, X), and
    the standardised angle and step of the history, (S, B, m).

    A network of increments hands its hidden state on from sample to sample: the history cell and the current cell of a
    sample share W_h h_(n-1) and W_x x_n and differ only by W_q q_n, so a step costs one product with W_h instead of one
    for each sample of history. That of the paper goes through the history anew for each prediction, Eq. 15.
    """
    hidden, driven, hands_on = None, drive(network, x), network.architecture.increments
    m, z, v = z.shape[-1], list(z.unbind(-1)), list(v.unbind(-1))
    for n in range(m, x.shape[-2]):
        if hidden is None or not hands_on:
            hidden = warm_up(network, driven[:, :, n - m : n], torch.stack(z[-m:], -1), torch.stack(v[-m:], -1))
        recurrent = recur(network, hidden)
        current = apply_cell(network, hidden, driven[:, :, n], recurrent)
        for values, value in zip((z, v), network.move(read_out(network, current), z[-1], v[-1]), strict=True):
            values.append(value)
        if hands_on:
            hidden = apply_cell(network, hidden, see(network, driven[:, :, n], z[-1], v[-1]), recurrent)
    return torch.stack(z[m:], dim=-1)
