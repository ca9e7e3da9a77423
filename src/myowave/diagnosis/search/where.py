"""Where does a model fail: by trial, direction, speed, angle, activation and time; which torque is missing there.

Shapes: T trials, N samples.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
import torch
from scipy.stats import spearmanr

from myowave.data.trials import Array
from myowave.identification.output_error import Fit
from myowave.identification.windows import Windows
from myowave.physics.dynamics import moment_of_inertia

BINS = 4  # of as many samples each
WINDOW_S = 0.25  # half the width of a test function
CONTRAST = 1.15  # worst bin over best: less is no finding
TREND = 0.8  # rank correlation of four bins with at most two neighbours exchanged
SHIFT = 0.2  # mean error over RMSE from which the arm is said to run ahead or behind
STILL_RAD_S = 0.05  # slower than this counts neither as flexion nor as extension


@dataclass(frozen=True)
class MissingTorque:
    """Torque that would have to be added along the simulated motion to make it the measured one."""

    points: pd.DataFrame  # a row for each window: trial, time_s, measured angle_rad and velocity_rad_s, torque_Nm
    standard_error: float  # of one point, from the noise of the angle [N m]

    @property
    def rms(self) -> float:
        """Root mean square of the missing torque less what noise by itself would show [N m]."""
        return float(np.sqrt(max((self.points["torque_Nm"] ** 2).mean() - self.standard_error**2, 0.0)))


def misfit_by(fit: Fit) -> pd.DataFrame:
    """RMSE of a fit in parts of its data, by the measured motion, as a model may run away: columns factor, part, low,
    high, samples, rmse_deg, mean_deg."""
    record, valid = fit.record, fit.record.valid
    residual = np.degrees(fit.residual)
    q, velocity = record.motion.numpy().transpose(2, 0, 1)
    rows = [_row("trial", name, left) for name, left in record.joined(residual).items()]
    for part, where in (("flexion", velocity > STILL_RAD_S), ("extension", velocity < -STILL_RAD_S)):
        rows.append(_row("direction", part, residual[where & valid]))
    time = record.begin_s[:, None] + np.arange(residual.shape[1]) * record.dt
    factors = {"speed [deg/s]": np.degrees(np.abs(velocity)), "angle [deg]": np.degrees(q), **_activations(fit)}
    for factor, signal in (factors | {"time [s]": time}).items():
        edges = np.quantile(signal[valid], np.linspace(0, 1, BINS + 1))
        edges[0] = 0.0 if factor.startswith("speed") else edges[0]  # the slowest sample says less than standing still
        bins = np.searchsorted(edges[1:-1], signal, side="right")
        for place, (low, high) in enumerate(pairwise(edges)):
            inside = valid & (bins == place)
            if inside.any():
                rows.append(_row(factor, f"{low:.3g} to {high:.3g}", residual[inside], low, high))
    return pd.DataFrame(rows)


def _activations(fit: Fit) -> dict[str, Array]:
    """The activation of every muscle at every sample, (T, N), by name and unit; muscles that share one are named
    together."""
    _, activation = fit.simulation.drive.at_samples
    activation = activation.expand(len(fit.record.names), *activation.shape[-2:]).numpy()
    alike: dict[bytes, list[int]] = {}
    for place in range(activation.shape[-1]):
        alike.setdefault(activation[..., place].tobytes(), []).append(place)
    names = [muscle.name for muscle in fit.model.muscles]
    return {
        f"activation of {' and '.join(names[i] for i in places)} [-]": activation[..., places[0]]
        for places in alike.values()
    }


def locate(misfit: pd.DataFrame) -> list[dict[str, Any]]:
    """What the error of `misfit_by` goes with, as plain data, the strongest first; nothing where it is the same
    everywhere.

    Returns:
        Findings with their `kind`, what they are `of` and its `unit`, and two `parts`, each {"part", "low", "high",
        "rmse_deg", "mean_deg"}: `trend`, from the lowest to the highest part of a factor, and `extremes`, the worst and
        the best of these; `shift`, the arm ahead of the model in flexion and extension alike (mean_deg > 0 while the
        angle grows), or behind it; `direction` and `trial`, the worst and the best.
    """
    halves, trials = (misfit[misfit["factor"] == factor] for factor in ("direction", "trial"))
    ahead = halves["mean_deg"].to_numpy() * [1, -1]  # measured less simulated: positive while the angle grows is ahead
    shifted = (np.abs(ahead) > SHIFT * halves["rmse_deg"]).all() and ahead.prod() > 0
    by_direction = [_finding("shift", halves)] if shifted else _contrast("direction", halves)
    return [*_by_range(misfit[misfit["low"].notna()]), *by_direction, *_contrast("trial", trials)]


def _by_range(ranges: pd.DataFrame) -> list[dict[str, Any]]:
    """With what the error grows or falls; where there is no such trend, where it is largest and smallest."""
    trends, extremes = [], []
    for _, parts in ranges.groupby("factor", sort=False):
        errors = parts["rmse_deg"].to_numpy()
        contrast = errors.max() / max(errors.min(), 1e-12)
        if contrast <= CONTRAST:
            continue
        order = spearmanr(np.arange(len(errors)), errors).statistic
        across = np.log(errors[-1] / max(errors[0], 1e-12))
        if abs(order) >= TREND - 1e-9 and abs(across) > np.log(contrast) / 2:
            trends.append((contrast, _finding("trend", parts.iloc[[0, -1]])))
        elif abs(errors.argmax() - errors.argmin()) > 1:  # between neighbours a difference is no finding
            extremes.append((contrast, _finding("extremes", _extremes(parts))))
    ordered = [sorted(found, key=lambda pair: -pair[0]) for found in (trends, extremes)]
    return [finding for _, finding in ordered[0][:2] or ordered[1][:1]]


def _contrast(kind: str, parts: pd.DataFrame) -> list[dict[str, Any]]:
    """The worst and the best part, where they differ; one without samples is none."""
    parts = parts[parts["samples"] > 0]
    if parts.empty:
        return []
    ends = _extremes(parts)
    return [_finding(kind, ends)] if ends["rmse_deg"].iloc[0] > CONTRAST * ends["rmse_deg"].iloc[1] else []


def _extremes(parts: pd.DataFrame) -> pd.DataFrame:
    """The parts with the largest and with the smallest error."""
    return parts.loc[[parts["rmse_deg"].idxmax(), parts["rmse_deg"].idxmin()]]


def _finding(kind: str, parts: pd.DataFrame) -> dict[str, Any]:
    of, _, unit = parts["factor"].iloc[0].removesuffix("]").partition(" [")
    known = parts[["part", "low", "high", "rmse_deg", "mean_deg"]].astype(object)
    return {"kind": kind, "of": of, "unit": unit, "parts": known.where(known.notna(), None).to_dict("records")}


def missing_torque(fit: Fit) -> MissingTorque:
    """The missing torque of a fit, in its weak form.

    The difference e of measured and simulated angle obeys I (e'' - a_q e - a_v e') = missing torque to first order,
    with the model's moment of inertia I and the slopes a_q, a_v of its acceleration along its motion. Multiplied by
    test functions (1 - s^2)^3 and integrated by parts no derivative of the data is left.
    """
    record, dt = fit.record, fit.record.dt
    # Test functions fit into the shortest piece, four of them.
    half = max(4, min(round(WINDOW_S / dt), int(record.lengths.min()) // 4))
    # They are 0 where they end, one sample before and behind those within.
    at, all_of_it = torch.zeros(1, dtype=torch.float64), torch.ones(1, dtype=torch.float64)
    windows = Windows.over(record.lengths + 2, dt, half + 1, max(1, half // 2), at, all_of_it)
    change = fit.linear.jacobian[..., :2, :2] - torch.eye(2)
    rate = (change - change @ change / 2 + change @ change @ change / 3) / dt  # logarithm of the step's Jacobian
    by_angle, by_velocity = torch.cat([rate, rate[:, -1:]], 1)[..., 1, :].unbind(-1)
    e, by_angle, by_velocity = (
        windows.each(torch.nn.functional.pad(x, (1, 1))[..., None])
        for x in (torch.from_numpy(fit.residual), by_angle, by_velocity)
    )
    test, second = windows.kernel(), windows.kernel(2)
    motion = fit.sensitive.motion
    inertia = moment_of_inertia(fit.simulation.along_time, motion.q).expand_as(motion.q)
    trial, place = np.nonzero(windows.inside)
    centre = half + place * windows.stride
    # int w a_v e' dt = -int (w a_v)' e dt, where a_v goes with activation.
    (damped,) = torch.gradient(by_velocity * test, spacing=dt, dim=-1)
    kernel = (second - by_angle * test + damped)[trial, place]
    kernel = kernel * inertia[trial, centre, None] / test.sum()
    angle, velocity = record.motion[trial, centre].numpy().T
    points = pd.DataFrame(
        {
            "trial": np.array(record.names)[trial],
            "time_s": record.begin_s[trial] + centre * dt,
            "angle_rad": angle,
            "velocity_rad_s": velocity,
            "torque_Nm": (kernel * e[trial, place]).sum(-1).numpy(),
        }
    )
    return MissingTorque(points, record.noise * float((kernel**2).sum(-1).mean().sqrt()))


def _row(factor: str, part: str, residual: Array, low: float = np.nan, high: float = np.nan) -> dict[str, object]:
    rmse, mean = (np.sqrt((residual**2).mean()), residual.mean()) if len(residual) else (0.0, 0.0)
    about = {"factor": factor, "part": part, "low": low, "high": high, "samples": len(residual)}
    return {**about, "rmse_deg": rmse, "mean_deg": mean}
