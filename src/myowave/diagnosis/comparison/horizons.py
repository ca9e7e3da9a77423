"""The horizon comparison: prediction over short horizons from measured states, and free running beside it.

About every 0.25 s a model starts at the measured angle and velocity and runs free, with the true EMG, for up to 2 s. It
has no time to diverge, so its error tells how wrong the physics is, not how unstable the motion. All restarts of all
trials are one batch.

Shapes: T trials, N samples, M muscles, R restarts, F features.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from myowave.data.trials import Array
from myowave.diagnosis.comparison.baselines import (
    EMG_ONLY,
    HOLD,
    MOTOR_ONLY,
    POSTURE,
    SAME_SPEED,
    fit_linear,
    polynomial,
)
from myowave.identification.along import Along, Index
from myowave.identification.least_squares import LARGEST
from myowave.identification.record import Record

# ASSUME: the state at a restart is the smoothed measured one; it looks at most 0.175 s ahead, for all predictors alike.
HORIZONS_S = (0.1, 0.2, 0.5, 1.0, 2.0)
WHOLE_TRIAL_S = np.inf  # stands for free running over the whole trial
RESTART_S = 0.25
EMG_PAST_S, EMG_WINDOWS = 0.2, 4  # EMG from so long before a restart to the horizon, in so many equal windows
COLUMNS = ["predictor", "horizon_s", "held_out", "rmse_deg"]


@dataclass(frozen=True)
class Restarts:
    """Samples of trials at which a prediction starts: their indices (R,) each."""

    trial: Index
    start: Index

    @classmethod
    def every(cls, record: Record, seconds: float) -> "Restarts":
        """Restarts so far apart, but for the first sample of a trial, where nothing is known of the past."""
        stride = max(1, round(seconds / record.dt))
        starts = [np.arange(stride, length - 1, stride) for length in record.lengths]
        trial = np.repeat(np.arange(len(starts)), [len(s) for s in starts])
        return cls(trial, np.concatenate(starts))

    def reach(self, record: Record, steps: int) -> NDArray[np.bool_]:
        """Which are followed by so many recorded samples, (R,)."""
        return self.start + steps < record.lengths[self.trial]

    def target(self, record: Record, steps: int) -> Array:
        """The measured angle after so many samples [rad], (R,); that of the last sample beyond the end."""
        return record.angle[self.trial, np.minimum(self.start + steps, record.angle.shape[1] - 1)]


def compare_horizons(models: list[Along], errors: pd.DataFrame) -> pd.DataFrame:
    """Error against the horizon, on training and on held-out trials: predictor, horizon_s, held_out, rmse_deg.

    The predictors are the models, then four to compare with, in the words of the module `baselines`:
    - `hold the angle`: q(t + h) = q(t);
    - `go on at the same speed`: q(t) + h qdot(t);
    - `posture and speed`: q(t + h) - q(t) as a polynomial of degree 3 in q(t) and qdot(t), one for each horizon;
    - `EMG without physics`: the same plus the means of the EMG in four equal windows from 0.2 s before t to t + h, or
      `motor without physics`: those of the recorded torque of a motor; neither where nothing drives the arm.
    The last two are least squares over all samples of the training trials only, and all see the same smoothed state.

    The last horizon (inf) is free running over whole trials, from the table `errors` of a diagnosis where its horizon_s
    is empty. The RMSE is inf where a prediction overflows (1e6 rad); a row is missing where no trial is long enough.
    """
    record = models[0].record
    restarts, steps = Restarts.every(record, RESTART_S), _steps(record)
    predicted: dict[str, dict[float, Array]] = {}
    for along in models:
        motion = along.predict(restarts.trial, restarts.start, max(steps.values()))
        predicted[along.model.name] = {horizon: motion[:, n] for horizon, n in steps.items()}
    held_out = ~record.training[restarts.trial]
    rows: list[tuple[str, float, bool, float]] = []
    for name, angles in (predicted | baselines(record, restarts)).items():
        for horizon, angle in angles.items():
            left = angle - restarts.target(record, steps[horizon])
            for part in (False, True):
                scored = restarts.reach(record, steps[horizon]) & (held_out == part)
                if scored.any():
                    rows.append((name, horizon, part, _rmse(left[scored])))
    return pd.DataFrame([*rows, *_whole_trials(errors, record)], columns=COLUMNS)


def baselines(record: Record, restarts: Restarts) -> dict[str, dict[float, Array]]:
    """What a model should beat: {predictor: {horizon: angle (R,)}} [rad]."""
    every = Restarts.every(record, record.dt)
    q, qdot = _state(record, restarts)
    found: dict[str, dict[float, Array]] = {}
    drives = {EMG_ONLY: record.emg.numpy().clip(min=0.0)} if record.emg.shape[-1] else {}
    if record.motor is not None:
        drives[MOTOR_ONLY] = record.motor[..., None].numpy()
    for horizon, steps in _steps(record).items():
        found.setdefault(HOLD, {})[horizon] = q
        found.setdefault(SAME_SPEED, {})[horizon] = q + steps * record.dt * qdot
        training = record.training[every.trial] & every.reach(record, steps)
        change = every.target(record, steps) - _state(record, every)[0]
        seen = {POSTURE: [polynomial(*_state(record, some)) for some in (restarts, every)]}
        for name, drive in drives.items():
            seen[name] = [drive_features(record, drive, some, steps) for some in (restarts, every)]
        for name, (features, fitted) in seen.items():
            found.setdefault(name, {})[horizon] = q + features @ fit_linear(fitted, change, training)
    return found


def _steps(record: Record) -> dict[float, int]:
    """The horizons, each in samples."""
    return {horizon: max(1, round(horizon / record.dt)) for horizon in HORIZONS_S}


def drive_features(record: Record, drive: Array, restarts: Restarts, steps: int) -> Array:
    """Polynomial of degree 3 in angle and velocity at the restart, and means of what drives the arm (T, N, M), EMG of
    every muscle or a motor's torque, in equal windows up to the horizon, (R, 10 + 4 M)."""
    summed = np.concatenate([np.zeros_like(drive[:, :1]), np.cumsum(drive, axis=1)], axis=1)
    edges = np.linspace(-round(EMG_PAST_S / record.dt), steps, EMG_WINDOWS + 1).round().astype(int)
    at = (restarts.start[:, None] + edges + 1).clip(0, drive.shape[1])
    sums = np.diff(summed[restarts.trial[:, None], at], axis=1)
    means = sums / np.diff(at, axis=1).clip(min=1)[..., None]
    return np.concatenate([polynomial(*_state(record, restarts)), *means.swapaxes(0, 1)], -1)


def _state(record: Record, restarts: Restarts) -> tuple[Array, Array]:
    q, qdot = record.motion[restarts.trial, restarts.start].unbind(-1)
    return q.numpy(), qdot.numpy()


def _whole_trials(errors: pd.DataFrame, record: Record) -> Iterator[tuple[str, float, bool, float]]:
    """Rows of free running over whole trials, every sample counted once; none where the fits are to pieces."""
    samples = dict(zip(record.names, record.lengths, strict=True))
    whole = errors[errors["horizon_s"].isna()]
    for (model, role), trials in whole.groupby(["model", "role"], sort=False):
        weights = trials["trial"].astype(str).map(samples)
        yield model, WHOLE_TRIAL_S, role == "test", float(np.sqrt(np.average(trials["rmse_deg"] ** 2, weights=weights)))


def _rmse(left: Array) -> float:
    return float(np.degrees(np.sqrt((left**2).mean()))) if (np.abs(left) < LARGEST).all() else np.inf
