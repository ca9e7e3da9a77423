"""The torque comparison: what the measured motion needs against what the model gives, see `identification.torque`.

Nothing is simulated here, so nothing diverges: a model is asked for its torque at the measured angle and velocity.
Needed less given is what the model lacks.

Shapes: T trials, N samples, n steps, D points in a step, K windows, F features.
"""

import numpy as np
import pandas as pd
import torch

from myowave.data.trials import Array
from myowave.diagnosis.comparison.baselines import (
    EMG_ONLY,
    MOTOR_ONLY,
    NOISE,
    POSTURE,
    POSTURE_LOAD,
    fit_linear,
    polynomial,
)
from myowave.identification.along import Along
from myowave.identification.torque import TorqueBalance, windows_of
from myowave.physics.simulation import between_samples

COLUMNS = ["model", "trial", "held_out", "rmse_Nm", "r2"]
ROUNDING = 1e-9  # a torque that varies by no larger share of itself is constant
OVERFLOWN_NM = 1e9  # a torque beyond this is none


def compare_torque(models: list[Along]) -> pd.DataFrame:
    """One row per predictor and trial: model, trial, held_out, rmse_Nm, r2.

    The predictors are the models, each against the torque that its own inertia and gravity need, then these to compare
    with, against the torque that the first model needs:
    - `posture and speed`: a polynomial of degree 3 in angle and velocity, no EMG;
    - `posture, speed and load`: the same with each coefficient linear in the load in the hand, where training trials
      with different loads are known;
    - `EMG without physics`: posture and speed, and such a polynomial times the delayed activation of each electrode:
      muscles of any shape that remember nothing; none without electrodes;
    - `motor without physics`: the same with the recorded torque of a motor, where there is one;
    - `noise of the angle`: what noise of that size does to the needed torque. A model that is right is as good, and
      better only where the noise is known as an upper bound.
    All but the last are least squares over the windows of the training trials only.
    Where a torque overflows (beyond 1e9 N m), rmse_Nm is inf and r2 -inf; a trial too short for a window has neither.
    """
    first, record = models[0], models[0].record
    balances = [TorqueBalance.along(along) for along in models]
    results = [balance.torques(along.params) for balance, along in zip(balances, models, strict=True)]
    rows = []
    for balance, result in zip(balances, results, strict=True):
        rows += score(balance.model.name, result.needed, result.given, balance)
    balance, needed = balances[0], results[0].needed
    training = balance.inside & record.training[:, None]
    # Means over the windows of a polynomial of degree 3 in angle and velocity, (T, K, 10): no EMG.
    smooth = torch.from_numpy(polynomial(balance.q.numpy(), balance.qdot.numpy()))
    posture = balance.mean(smooth)
    rivals = {POSTURE: posture}
    load = record.known["load"].numpy() if "load" in record.known else np.zeros(len(record.names))
    if np.ptp(load[record.training]):
        # ASSUME: a known load changes torque in proportion to it, as its weight and inertia do.
        rivals[POSTURE_LOAD] = np.concatenate([posture, posture * load[:, None, None]], -1)
    _, activation = first.simulation.activate(balance.position)
    # ASSUME: muscles that share an electrode are active alike; the first of them counts.
    places = [first.model.muscles.index(m) for m in first.model.leading.values()]
    drives = {EMG_ONLY: activation.expand(len(record.names), -1, -1, -1)[..., places]} if places else {}
    if record.motor is not None:
        drives[MOTOR_ONLY] = between_samples(record.motor[..., None], balance.position)
    for name, drive in drives.items():
        driven = (drive[..., None] * smooth[..., None, :]).flatten(-2)
        rivals[name] = balance.mean(torch.cat([smooth, driven], -1))
    for name, features in rivals.items():
        rows += score(name, needed, features @ fit_linear(features, needed, training), balance)
    # ASSUME: noise reaches the needed torque through the acceleration; angle and velocity are smooth beside it.
    area = balance.windows.integrate(torch.ones_like(balance.q)).numpy()
    spread = record.noise * windows_of(record).noise() * results[0].inertia / area
    rows += score(NOISE, needed, needed + spread, balance)
    return pd.DataFrame(rows, columns=COLUMNS)


def score(name: str, needed: Array, given: Array, balance: TorqueBalance) -> list[dict[str, object]]:
    """A row for each trial: root mean square of what is missing [N m], and the share of the variance explained."""
    rows = []
    for trial, label in enumerate(balance.record.names):
        inside = balance.inside[trial]
        rmse, r2 = np.nan, np.nan
        if inside.any():
            left, variance = (needed - given)[trial, inside], float(needed[trial, inside].var())
            moves = np.sqrt(variance) > ROUNDING * np.abs(needed[trial, inside]).max()
            rmse, r2 = np.inf, -np.inf
            if (np.abs(left) < OVERFLOWN_NM).all():
                rmse = float(np.sqrt((left**2).mean()))
                r2 = 1 - rmse**2 / variance if moves else np.nan
        rows.append(dict(zip(COLUMNS, (name, label, not balance.record.training[trial], rmse, r2), strict=True)))
    return rows
