"""Baselines: what the predictors to beat are called in tables, pictures and text, and their least squares."""

import numpy as np
from numpy.typing import NDArray

from myowave.data.trials import Array

POSTURE = "posture and speed"
POSTURE_LOAD = "posture, speed and load"
EMG_ONLY = "EMG without physics"
MOTOR_ONLY = "motor without physics"
HOLD = "hold the angle"
SAME_SPEED = "go on at the same speed"
NOISE = "noise of the angle"
HORIZON_BASELINES = (HOLD, SAME_SPEED, POSTURE, EMG_ONLY, MOTOR_ONLY)
DEGREE = 3


def polynomial(q: Array, qdot: Array) -> Array:
    """All products q^i qdot^j with i + j <= 3, on a last axis of ten, the constant first."""
    return np.stack([q**i * qdot**j for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)], -1)


def fit_linear(features: Array, target: Array, training: NDArray[np.bool_]) -> Array:
    """Coefficients (F,) of target (...) on features (..., F) by least squares, from the rows `training` (...) only.

    The smallest ones where these leave a choice; all 0 where there are none.
    """
    rows = training & np.isfinite(target)
    return np.asarray(np.linalg.lstsq(features[rows], target[rows], rcond=1e-10)[0], dtype=np.float64)
