"""From EMG to motion with a trained network, free running (Fig. 4b): the first `history` angles are given, all others
are the network's own. `streaming` does the same on one sample of EMG at a time.

Shapes: S seeds, T trials, N samples, C channels, X inputs, B windows, K samples of a window of which m are history.
"""

from dataclasses import replace

import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.learning.inputs import to_tensors
from myowave.learning.methods import RUNS
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
    """Free run of windows: inputs (B, K, X), standardised history (S, B, m); standardised predictions (S, B, K - m)."""
    return RUNS[network.architecture.method](network, x, z, v)
