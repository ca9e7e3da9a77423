"""What the residual itself finds: parameters with the least J_res along perfectly known angles, without any network.

It is the best that training can come to: how far these are from the truth is the bias of the equation as it is read.
"""

from collections.abc import Iterable

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.learning.methods.paper.residual import Pieces, Residual
from myowave.physics.model import Model

STEPS = 8  # of Gauss-Newton, from the truth
NUDGE = 1e-6


def least_residual(model: Model, trials: Trials, names: Iterable[str], *, averaged: bool) -> dict[str, float]:
    """Error [%] of each parameter where J_res along the measured training angles is least.

    Args:
        names: parameters whose true values are the model's constants.
        averaged: whether the torque is averaged over the kernel of the second difference.
    """
    names, train = tuple(names), trials.select(trials.train)
    cpu = torch.device("cpu")
    residual = Residual(model, train, names, cpu, averaged=averaged)
    length = min(train.lengths)
    pieces = Pieces(torch.arange(len(train.names)), torch.zeros(len(train.names), dtype=torch.long), length)
    q = pieces.of(torch.from_numpy(train.angle))[None]
    bend = (q[..., 2:] - 2 * q[..., 1:-1] + q[..., :-2]) / train.dt**2
    truth = torch.tensor([model.defaults[name] for name in names], dtype=torch.float64)

    def left(factors: Tensor) -> Tensor:
        """Residuals (P, n) of several sets of factors on the truth, (P, number of names)."""
        values = (factors * truth).T
        params = {name: value[:, None] for name, value in zip(names, values, strict=True)}
        return residual.along_sequence(params, pieces, q.expand(len(factors), -1, -1), bend).flatten(1)

    factors = torch.ones(len(names), dtype=torch.float64)
    for _ in range(STEPS):
        here, *nudged = left(torch.cat([factors[None], factors + NUDGE * torch.eye(len(names))])).unbind()
        slope = (torch.stack(nudged, -1) - here[:, None]) / NUDGE
        factors = factors - torch.linalg.lstsq(slope, here).solution
    return dict(zip(names, (100 * (factors - 1)).tolist(), strict=True))


def tabulate_bias(model: Model, all_trials: Iterable[Trials], names: Iterable[str]) -> pd.DataFrame:
    """One row per dataset and reading of the torque (sampled, averaged): errors of the parameters [%]."""
    names = tuple(names)
    rows = [
        {"dataset": trials.dataset, "torque": torque, **least_residual(model, trials, names, averaged=averaged)}
        for trials in all_trials
        for torque, averaged in (("sampled", False), ("averaged", True))
    ]
    return pd.DataFrame(rows)


def accelerations_seen(predicted: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Share of the measured accelerations that predictions have, (S,): the slope of their second differences.

    Args:
        predicted: one step ahead, (S, N) [rad].
        measured: (N,) [rad].
    """
    wanted, found = np.diff(measured, 2), np.diff(predicted, 2, axis=-1)
    return found @ wanted / (wanted @ wanted)
