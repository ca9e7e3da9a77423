"""Predict trials that a fit has not seen.

Shapes: T trials, N samples.
"""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from myowave.identification.fit import Fit, bind_values, with_states
from myowave.identification.record import Record
from myowave.physics.simulation import Simulation
from myowave.physics.trajectory import Newton, solve

Array = NDArray[np.float64]

# ASSUME: where a trial starts, and how fast, is told by its first second; all after it is predicted.
BEGINNING_S = 1.0
LIFTED_STEPS = 4


@dataclass(frozen=True)
class Prediction:
    """Predicted angle [rad] of trials (T, N), and what is left of the measured one, 0 where padded."""

    angle: Array
    residual: Array
    rmse_by_trial: Array
    rmse: float


def predict(fit: Fit, record: Record) -> Prediction:
    """Simulate trials with the parameters of a fit to others.

    Only angle and velocity at their start are estimated, from the first second (`BEGINNING_S`).
    """
    guess = record.first_guess()
    begin = guess[:, 0].numpy().copy()
    if record.at_rest:
        begin[:, 1] = 0.0
    simulation = Simulation(fit.model, bind_values(fit.free, fit.values, record), record.emg, record.dt)
    lifted = Newton(iterations=1, rescue=False)
    guess = with_states(fit.model, record, fit.free, fit.values, guess)
    early = record.valid & (np.arange(record.angle.shape[1]) * record.dt <= BEGINNING_S)
    count = 1 if record.at_rest else 2
    for _ in range(LIFTED_STEPS):
        start = torch.from_numpy(begin)
        result = solve(simulation, start[:, 0], start[:, 1], guess=guess, newton=lifted)
        slope = np.moveaxis(result.by_start.numpy(), 0, -1)[..., :count] * early[..., None]
        residual = np.where(early, record.angle - result.motion.angle.numpy(), 0.0)
        gram = np.einsum("tni,tnj->tij", slope, slope) + 1e-12 * np.eye(count)
        shift = np.zeros_like(begin)
        shift[:, :count] = np.linalg.solve(gram, np.einsum("tni,tn->ti", slope, residual)[..., None])[..., 0]
        begin = begin + shift
        guess = result.motion.state + torch.einsum("tnkp,tp->tnk", result.tangent, torch.from_numpy(shift))
    start = torch.from_numpy(begin)
    angle = solve(simulation, start[:, 0], start[:, 1], guess=guess).motion.angle.numpy()
    residual = np.where(record.valid, record.angle - angle, 0.0)
    squares = (residual**2).sum(-1)
    return Prediction(
        angle=angle,
        residual=residual,
        rmse_by_trial=np.sqrt(squares / record.valid.sum(-1)),
        rmse=float(np.sqrt(squares.sum() / record.samples)),
    )
