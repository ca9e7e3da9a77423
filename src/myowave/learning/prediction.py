"""The cells of the network, and its prediction of motion from EMG, free running (Fig. 4b): the first `history` angles
are given, all others are the network's own. `streaming` does the same on one sample of EMG at a time.

The cells are GRUs, Eqs. 11-13 and 51-53, for all seeds at once. A *history cell* sees EMG x_i and angle q_i of a past
sample; the *current cell* sees only x_n, and its state gives the output. Both have the same weights:

    driven     W_x x_i + b, and for a history cell + W_q q_i
    recurrent  W_h h_(i-1)
    new state  h_i = cell(recurrent, driven, h_(i-1))

Shapes: S seeds, T trials, N samples, C channels, X inputs, B windows, K samples of a window of which m are history,
H hidden units, G gates.
"""

from collections import deque
from dataclasses import replace

import torch
from torch import Tensor

from myowave.data.trials import Trials
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
    the standardised angle and step of the history, (S, B, m)."""
    run, driven, m = FreeRun(network), drive(network, x).unbind(2), z.shape[-1]
    run.past.extend(zip(driven[:m], z.unbind(-1), v.unbind(-1), strict=True))
    return torch.stack([run.step(sample) for sample in driven[m:]], dim=-1)


class FreeRun:
    """A network that is fed by its own predictions, sample after sample, once the samples of its history are given.

    A network of increments hands its hidden state on from sample to sample: the history cell and the current cell of a
    sample share W_h h_(n-1) and W_x x_n and differ only by W_q q_n, so a step costs one product with W_h instead of one
    for each sample of history. That of the paper goes through the history anew for each prediction, Eq. 15.
    """

    def __init__(self, network: Network) -> None:
        self._network = network
        self._hidden: Tensor | None = None
        # what drives the cells of the last `history` samples (S, B, G), their standardised angles and steps (S, B)
        self.past: deque[tuple[Tensor, Tensor, Tensor]] = deque(maxlen=network.history)

    def step(self, driven: Tensor) -> Tensor:
        """Standardised angle (S, B) of the next sample, from what drives its cells (S, B, G)."""
        network, (_, z, v), hidden = self._network, self.past[-1], self._hidden
        if hidden is None:
            hidden = warm_up(network, *(torch.stack(part, 2) for part in zip(*self.past, strict=True)))
        recurrent = recur(network, hidden)
        z, v = network.move(read_out(network, apply_cell(network, hidden, driven, recurrent)), z, v)
        self.past.append((driven, z, v))
        if network.architecture.increments:
            self._hidden = apply_cell(network, hidden, see(network, driven, z, v), recurrent)
        return z


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
