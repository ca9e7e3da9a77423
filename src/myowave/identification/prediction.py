"""Predict trials that a fit has not seen.

Shapes: T trials, N samples.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from myowave.data.trials import Array
from myowave.identification.along import Along
from myowave.identification.free_parameters import bind_values
from myowave.identification.least_squares import limited
from myowave.identification.output_error import LIFTED_STEPS, Fit, LiftedSearch
from myowave.identification.record import Record
from myowave.physics.trajectory import solve

# ASSUME: where a trial starts, and how fast, is told by its first second; all after it is predicted.
BEGINNING_S = 1.0


@dataclass(frozen=True)
class Prediction:
    """What is left of the measured angle of trials [rad], (T, N), 0 where padded."""

    residual: Array
    rmse: float


def predict(fit: Fit, record: Record) -> Prediction:
    """Simulate trials with the parameters of a fit to others.

    Only angle and velocity at their start are estimated, from the first second (`BEGINNING_S`). A piece of a trial
    starts at the measured state, see `Along`; nothing is estimated.
    """
    params = bind_values(fit.free, fit.values)
    if record.pieces is None:
        start, guess = _beginning(fit, record)
        simulation = record.simulation(fit.model, params)
        angle = solve(simulation, start[:, 0], start[:, 1], guess=guess).motion.angle.numpy()
    else:
        along = Along(fit.model, record.whole, params)
        angle = along.predict(record.pieces.row, record.begin, record.angle.shape[1] - 1)
    residual = np.where(record.valid, record.angle - limited(angle), 0.0)
    return Prediction(residual, float(np.sqrt((residual**2).sum() / record.samples)))


def _beginning(fit: Fit, record: Record) -> tuple[Tensor, Tensor]:
    """Angle and velocity (T, 2) that come nearest to the first second of each trial, and a guess of the state."""
    early = record.valid & (np.arange(record.angle.shape[1]) * record.dt <= BEGINNING_S)
    nothing = np.zeros((1, 0))  # no parameter is free: a step moves the starts only
    known = {**record.known, **bind_values(fit.free, fit.values)}
    # A measured torque tells parameters alone.
    search = LiftedSearch.begin(fit.model, replace(record, known=known, torque=None), (), nothing)
    search = replace(search, record=replace(search.record, valid=early))
    for _ in range(LIFTED_STEPS):
        search = search.lifted()
    (start,) = torch.from_numpy(search.starts)
    return start, search.guess[0]
