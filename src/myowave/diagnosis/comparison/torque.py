"""The torque comparison: the torque that the measured motion needs against the torque that the model gives.

Nothing is simulated here, so nothing diverges: a model is asked for its torque at the measured angle and velocity. The
angle is never differentiated twice. With test functions w = (1 - s^2)^3 over +-0.15 s, which vanish with two
derivatives at both ends, and with the model's inertia I and gravity,

    needed = [int w'' q dt - int w gravity / I dt] / int w / I dt
    given  = int w (muscles + effects) / I dt / int w / I dt                                                     [N m]

which for a constant I is needed = [I int w'' q - int w gravity] / int w. Needed less given is what the model lacks.

Shapes: T trials, N samples, D points in a sample step, K windows, F features.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from myowave.diagnosis.comparison.measured import Along, Measured
from myowave.diagnosis.comparison.names import EMG_ONLY, NOISE, POSTURE, POSTURE_LOAD
from myowave.diagnosis.comparison.regression import fit_linear, polynomial

Array = NDArray[np.float64]

HALF_WIDTH_S = 0.15
OVERLAP = 2  # windows stand half of their half width apart
COLUMNS = ["model", "trial", "held_out", "rmse_Nm", "r2"]
OVERFLOWN_NM = 1e9  # a torque beyond this is none
SPLINE = 5  # order of the curve through the measured angles, which w'' weighs
NODES, SHARES = np.polynomial.legendre.leggauss(3)
POINTS, WEIGHTS = (NODES + 1) / 2, SHARES / 2  # in a sample step


@dataclass(frozen=True)
class Windows:
    """Test functions over trials: half width in samples, and which lie within the recorded part."""

    half: int
    dt: float
    inside: NDArray[np.bool_]  # (T, K)

    @classmethod
    def of(cls, measured: Measured) -> "Windows":
        half = max(3, round(HALF_WIDTH_S / measured.dt))
        starts = np.arange(0, measured.angle.shape[1] - 2 * half, max(1, half // OVERLAP))
        return cls(half, measured.dt, starts + 2 * half < np.array(measured.lengths)[:, None])

    def integrate(self, values: Array, *, second: bool = False) -> Array:
        """int w values dt, or int w'' values dt, over every window: (T, N - 1, D) to (T, K)."""
        s = (np.arange(-self.half, self.half)[:, None] + POINTS) / self.half
        curved = (30 * s**2 - 6) * (1 - s**2) / (self.half * self.dt) ** 2
        test = curved if second else (1 - s**2) ** 3
        kernel = (test * WEIGHTS * self.dt).ravel()
        stride = max(1, self.half // OVERLAP) * len(POINTS)
        flat = values.reshape(len(values), -1)
        if flat.shape[1] < len(kernel):
            return np.zeros((len(values), 0))
        windows = torch.from_numpy(np.ascontiguousarray(flat)).unfold(-1, len(kernel), stride)
        return (windows @ torch.from_numpy(kernel)).numpy()  # which may overflow without a word

    def noise(self) -> float:
        """Standard deviation of int w'' q dt for white noise of standard deviation 1 in the samples of q."""
        samples = 6 * self.half + 1
        curves = make_interp_spline(np.arange(samples), np.eye(samples), k=SPLINE)
        fine = curves((np.arange(samples - 1)[:, None] + POINTS).ravel()).T.reshape(samples, samples - 1, -1)
        weights = self.integrate(fine, second=True)
        return float(np.sqrt((weights[:, weights.shape[1] // 2] ** 2).sum()))


@dataclass(frozen=True)
class Balance:
    """Torques of a model in every window [N m], (T, K), and its moment of inertia [kg m^2]."""

    needed: Array
    given: Array
    inertia: Array


def balance(along: Along, windows: Windows) -> Balance:
    """Needed and given torque of a model; what overflows is not finite."""
    angle, *_ = along.motion
    given, gravity, inertia = along.torques(POINTS)
    area = windows.integrate(1 / inertia)
    moved = windows.integrate(along.measured.between(angle, POINTS, SPLINE), second=True)
    needed = (moved - windows.integrate(gravity / inertia)) / area
    return Balance(
        needed=needed,
        given=windows.integrate(given / inertia) / area,
        inertia=windows.integrate(np.ones_like(inertia)) / area,
    )


def posture_features(along: Along, windows: Windows) -> Array:
    """Means over the windows of a polynomial of degree 3 in angle and velocity, (T, K, 10): no EMG."""
    _, q, qdot = (along.measured.between(x, POINTS, 3) for x in along.motion)
    return _means(windows, polynomial(q, qdot))


def emg_features(along: Along, windows: Windows) -> Array:
    """Means over the windows of 1, the delayed activations, and their products with the angle, (T, K, 1 + 2 M)."""
    _, q, _ = (along.measured.between(x, POINTS, 3)[..., None] for x in along.motion)
    activation = along.activations(POINTS)
    return _means(windows, np.concatenate([np.ones_like(q), activation, q * activation], -1))


def compare_torque(models: list[Along]) -> pd.DataFrame:
    """One row per predictor and trial: model, trial, held_out, rmse_Nm, r2.

    The predictors are the models, each against the torque that its own inertia and gravity need, then these to compare
    with, against the torque that the first model needs:
    - `posture and speed`: a polynomial of degree 3 in angle and velocity, no EMG;
    - `posture, speed and load`: the same with each coefficient linear in the load in the hand, where training trials
      with different loads are known;
    - `EMG without physics`: linear in the delayed activations and their products with the angle;
    - `noise of the angle`: what noise of that size does to the needed torque. A model that is right is as good, and
      better only where the noise is known as an upper bound.
    All but the last are least squares over the windows of the training trials only.
    Where a torque overflows (beyond 1e9 N m), rmse_Nm is inf and r2 -inf; a trial too short for a window has neither.
    """
    first = models[0]
    measured = first.measured
    windows = Windows.of(measured)
    results = [balance(along, windows) for along in models]
    rows = []
    for along, result in zip(models, results, strict=True):
        rows += score(along.fitted.name, result.needed, result.given, measured, windows)
    result = results[0]
    training = windows.inside & measured.training[:, None]
    posture = posture_features(first, windows)
    rivals = {POSTURE: posture}
    load = measured.known["load"].numpy() if "load" in measured.known else np.zeros(len(measured.names))
    if np.ptp(load[measured.training]):
        # ASSUME: a known load changes torque in proportion to it, as its weight and inertia do.
        rivals[POSTURE_LOAD] = np.concatenate([posture, posture * load[:, None, None]], -1)
    rivals[EMG_ONLY] = emg_features(first, windows)
    for name, features in rivals.items():
        rows += score(name, result.needed, features @ fit_linear(features, result.needed, training), measured, windows)
    # ASSUME: noise reaches the needed torque through the acceleration; angle and velocity are smooth beside it.
    spread = measured.noise * windows.noise() * result.inertia / windows.integrate(_ones(measured))
    rows += score(NOISE, result.needed, result.needed + spread, measured, windows)
    return pd.DataFrame(rows, columns=COLUMNS)


def score(name: str, needed: Array, given: Array, measured: Measured, windows: Windows) -> list[dict[str, object]]:
    """A row for each trial: root mean square of what is missing [N m], and the share of the variance explained."""
    rows = []
    for trial, label in enumerate(measured.names):
        inside = windows.inside[trial]
        left, variance = (needed - given)[trial, inside], _variance(needed[trial, inside])
        if not inside.any():
            rmse, r2 = np.nan, np.nan
        elif not (np.abs(left) < OVERFLOWN_NM).all():
            rmse, r2 = np.inf, -np.inf
        else:
            rmse = float(np.sqrt((left**2).mean()))
            r2 = 1 - rmse**2 / variance if variance > 0 else np.nan
        rows.append(dict(zip(COLUMNS, (name, label, not measured.training[trial], rmse, r2), strict=True)))
    return rows


def _means(windows: Windows, features: Array) -> Array:
    area = windows.integrate(np.ones(features.shape[:-1]))[..., None]
    return np.stack([windows.integrate(features[..., f]) for f in range(features.shape[-1])], -1) / area


def _ones(measured: Measured) -> Array:
    return np.ones((len(measured.names), measured.angle.shape[1] - 1, len(POINTS)))


def _variance(values: Array) -> float:
    return float(values.var()) if len(values) else 0.0
