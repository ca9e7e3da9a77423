"""Where does a model fail: by trial, direction, speed, angle, activation and time; which torque is missing there.

Shapes: T trials, N samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from scipy.stats import spearmanr
from scipy.stats import t as student

from myowave.identification.output_error import Fit
from myowave.identification.record import is_bound
from myowave.physics.dynamics import moment_of_inertia
from myowave.physics.valued import give_values

Array = NDArray[np.float64]

BINS = 4  # of as many samples each
WINDOW_S = 0.25  # half the width of a test function
MOST_MAP_BINS, WINDOWS_A_CELL = 8, 5  # the map is as fine as so many windows in a cell, on average, allow
FEWEST = 3  # windows in a cell of the map
CONTRAST = 1.15  # worst bin over best: less is not worth a sentence
TREND = 0.8  # rank correlation of four bins with at most two neighbours exchanged
SHIFT = 0.2  # mean error over RMSE from which the arm is said to run ahead or behind
BATCHES = 10  # stretches of a residual whose scatter gives an interval
STILL_RAD_S = 0.05  # slower than this counts neither as flexion nor as extension


@dataclass(frozen=True)
class MissingTorque:
    """Torque that would have to be added along the simulated motion to make it the measured one.

    Args:
        points: a row for each window: trial, time_s, angle_rad, velocity_rad_s, torque_Nm.
        standard_error: of one point, from the noise of the angle [N m].
    """

    points: pd.DataFrame
    standard_error: float

    @property
    def rms(self) -> float:
        """Root mean square of the missing torque less what noise by itself would show [N m]."""
        return float(np.sqrt(max((self.points["torque_Nm"] ** 2).mean() - self.standard_error**2, 0.0)))

    def map(self) -> pd.DataFrame:
        """Mean over cells of angle and velocity: angle_rad, velocity_rad_s (centres), torque_Nm, windows."""
        points = self.points
        cells = []
        bins = int(np.clip(np.sqrt(len(points) / WINDOWS_A_CELL), 2, MOST_MAP_BINS))
        q_edges, v_edges = (
            np.linspace(points[c].min(), points[c].max() + 1e-9, bins + 1) for c in ("angle_rad", "velocity_rad_s")
        )
        i = np.digitize(points["angle_rad"], q_edges) - 1
        j = np.digitize(points["velocity_rad_s"], v_edges) - 1
        for (a, b), group in points.groupby([i, j]):
            if len(group) >= FEWEST:
                centre = (q_edges[a] + q_edges[a + 1]) / 2, (v_edges[b] + v_edges[b + 1]) / 2
                cells.append((*centre, group["torque_Nm"].mean(), len(group)))
        return pd.DataFrame(cells, columns=["angle_rad", "velocity_rad_s", "torque_Nm", "windows"])


def misfit_by(fit: Fit) -> pd.DataFrame:
    """RMSE of a fit in parts of its data.

    Returns:
        Columns factor, part, low, high, samples, rmse_deg, mean_deg, and rmse_low_deg, rmse_high_deg: the 95 %
        interval of `interval_of_rmse`, empty where there are too few samples.
    """
    valid = fit.record.valid
    residual = np.degrees(fit.residual)
    q, velocity = fit.sensitive.motion.state[..., :2].numpy().transpose(2, 0, 1)
    rows = [_row("trial", name, left) for name, left in fit.record.joined(residual).items()]
    for part, where in (("flexion", velocity > STILL_RAD_S), ("extension", velocity < -STILL_RAD_S)):
        rows.append(_row("direction", part, residual[where & valid]))
    factors = {"speed [deg/s]": np.degrees(np.abs(velocity)), "angle [deg]": np.degrees(q)}
    factors |= _activations(fit)
    factors["time [s]"] = fit.record.begin_s[:, None] + np.arange(residual.shape[1]) * fit.record.dt
    for factor, signal in factors.items():
        edges = np.quantile(signal[valid], np.linspace(0, 1, BINS + 1))
        edges[0] = 0.0 if factor.startswith("speed") else edges[0]  # the slowest sample says less than standing still
        for low, high in zip(edges[:-1], edges[1:], strict=True):
            inside = valid & (signal >= low) & ((signal < high) | (high == edges[-1]))
            if inside.any():
                rows.append(_row(factor, f"{low:.3g} to {high:.3g}", residual[inside], low, high))
    return pd.DataFrame(rows)


def _activations(fit: Fit) -> dict[str, Array]:
    """The activation of every muscle at every sample, (T, N), by its name and unit."""
    drive = fit.simulation.drive
    activation = torch.cat([drive.activation[..., 0, :], drive.activation[..., -1:, -1, :]], -2)
    activation = activation.expand(len(fit.record.names), *activation.shape[-2:]).numpy()
    return {f"activation {m.name} [-]": activation[..., i] for i, m in enumerate(fit.model.muscles)}


def describe(misfit: pd.DataFrame, noise_deg: float) -> str:
    """The table in a few sentences, the strongest first.

    Args:
        misfit: as `misfit_by` gives it.
        noise_deg: standard deviation of the noise of the angle.
    """
    size = f"{'at most ' * is_bound(noise_deg)}{noise_deg:.2g} deg"
    if (misfit["rmse_deg"] <= noise_deg).all():
        return f"In every part of the trials the misfit is below the noise, {size}: nothing to locate."
    noise = f"The noise is {size}."
    said = [text for text in (_by_range(misfit), _by_direction(misfit), _by_trial(misfit)) if text]
    if not said:
        return f"The misfit is the same everywhere. {noise}"
    if said[0].startswith("It is"):
        said[0] = said[0].replace("It is", "The misfit is", 1)
    return " ".join([*said, noise])


def _by_range(misfit: pd.DataFrame) -> str:
    """With what the error grows or falls; where there is no such trend, at what it is largest and smallest."""
    trends, extremes = [], []
    ranges = misfit[misfit["low"].notna()]
    for factors in sharing(ranges, "factor", ("low", "high", "rmse_deg")):
        parts = ranges[ranges["factor"] == factors[0]]
        errors = parts["rmse_deg"].to_numpy()
        contrast = errors.max() / max(errors.min(), 1e-12)
        if contrast <= CONTRAST:
            continue
        order = spearmanr(np.arange(len(errors)), errors).statistic
        across = np.log(errors[-1] / max(errors[0], 1e-12))
        name, unit = _name_and_unit(factors)
        if abs(order) >= TREND - 1e-9 and abs(across) > np.log(contrast) / 2:
            ends = " to ".join(f"{_error(parts.iloc[i])} ({_range(parts.iloc[i])}{unit})" for i in (0, -1))
            trends.append((contrast, f"{'grows' if across > 0 else 'falls'} with {name}, from {ends}"))
        elif abs(errors.argmax() - errors.argmin()) > 1:  # between neighbours a difference is no finding
            worst, best = (f"{_range(row)}{unit} ({_error(row)})" for row in _extremes(parts))
            extremes.append((contrast, f"is largest at {name} {worst} and smallest at {best}"))
    chosen = sorted(trends, reverse=True)[:2] or sorted(extremes, reverse=True)[:1]
    return f"The misfit {'; it '.join(text for _, text in chosen)}." if chosen else ""


def _by_trial(misfit: pd.DataFrame) -> str:
    """The trials with the largest and the smallest error, where these differ."""
    worst, best = _extremes(misfit[misfit["factor"] == "trial"])
    if worst["rmse_deg"] <= CONTRAST * best["rmse_deg"]:
        return ""
    worst, best = (f"trial {row['part'].removeprefix('trial')} ({_error(row)})" for row in (worst, best))
    return f"It is largest in {worst}, smallest in {best}."


def _by_direction(misfit: pd.DataFrame) -> str:
    """Whether the arm runs ahead of the model or behind it, or moves one way worse than the other."""
    parts = misfit[misfit["factor"] == "direction"].set_index("part")
    flexion, extension = parts.loc["flexion"], parts.loc["extension"]
    # Measured less simulated: positive while the angle grows, and negative while it falls, is ahead.
    ahead = np.array([flexion["mean_deg"], -extension["mean_deg"]])
    if (np.abs(ahead) > SHIFT * np.array([flexion["rmse_deg"], extension["rmse_deg"]])).all() and ahead.prod() > 0:
        where = "ahead of" if ahead[0] > 0 else "behind"
        by_flexion, by_extension = np.abs(ahead)
        return f"The arm is {where} the model, by {by_flexion:.2g} deg in flexion and {by_extension:.2g} in extension."
    worst, best = _extremes(parts.reset_index())
    if worst["rmse_deg"] <= CONTRAST * best["rmse_deg"]:
        return ""
    return f"It is larger in {worst['part']} ({_error(worst)}) than in {best['part']} ({_error(best)})."


def missing_torque(fit: Fit) -> MissingTorque:
    """The missing torque of a fit, in its weak form.

    The difference e of measured and simulated angle obeys I (e'' - a_q e - a_v e') = missing torque to first order,
    with the model's moment of inertia I and the slopes a_q, a_v of its acceleration along its motion. Multiplied by
    test functions (1 - s^2)^3 and integrated by parts no derivative of the data is left.
    """
    record, dt = fit.record, fit.record.dt
    # Test functions fit into the shortest piece, four of them.
    half = max(4, min(round(WINDOW_S / dt), int(record.lengths.min()) // 4))
    s = np.arange(-half, half + 1) / (half + 1)
    test = (1 - s**2) ** 3
    first = -6 * s * (1 - s**2) ** 2 / ((half + 1) * dt)
    second = (-6 * (1 - s**2) ** 2 + 24 * s**2 * (1 - s**2)) / ((half + 1) * dt) ** 2
    change = fit.linear.jacobian.numpy()[..., :2, :2] - np.eye(2)
    rate = (change - change @ change / 2 + change @ change @ change / 3) / dt  # logarithm of the step's Jacobian
    by_angle, by_velocity = rate[..., 1, 0], rate[..., 1, 1]
    by_angle, by_velocity = (np.concatenate([x, x[..., -1:]], -1) for x in (by_angle, by_velocity))
    motion = fit.sensitive.motion
    inertia = moment_of_inertia(give_values(fit.model, fit.params, record.emg).along(1), motion.q)
    inertia = inertia.expand_as(motion.q).numpy()
    state = motion.state.numpy()
    rows, errors = [], []
    for i, name in enumerate(record.trials):
        length, e = int(record.valid[i].sum()), fit.residual[i]
        for centre in range(half, length - half, max(1, half // 2)):
            inside = slice(centre - half, centre + half + 1)
            kernel = second - by_angle[i, inside] * test + by_velocity[i, inside] * first
            kernel = kernel * inertia[i, centre] / test.sum()
            errors.append(np.sqrt((kernel**2).sum()) * record.noise)
            rows.append((name, record.begin_s[i] + centre * dt, *state[i, centre, :2], float(kernel @ e[inside])))
    points = pd.DataFrame(rows, columns=["trial", "time_s", "angle_rad", "velocity_rad_s", "torque_Nm"])
    return MissingTorque(points, float(np.sqrt(np.mean(np.square(errors)))))


def _row(factor: str, part: str, residual: Array, low: float = np.nan, high: float = np.nan) -> dict[str, object]:
    rmse = float(np.sqrt((residual**2).mean())) if len(residual) else 0.0
    mean = float(residual.mean()) if len(residual) else 0.0
    least, most = interval_of_rmse(residual)
    return {
        "factor": factor,
        "part": part,
        "low": low,
        "high": high,
        "samples": len(residual),
        "rmse_deg": rmse,
        "mean_deg": mean,
        "rmse_low_deg": least,
        "rmse_high_deg": most,
    }


def interval_of_rmse(residual: Array) -> tuple[float, float]:
    """95 % interval of the root mean square of a residual, (N,) in order of time, in its unit.

    From the means of the squares over `BATCHES` stretches, which hardly depend on one another where the samples do, by
    their scatter on a logarithmic scale; (NaN, NaN) for fewer than two samples a stretch, or where nothing is left.
    """
    if len(residual) < 2 * BATCHES or not np.any(residual):
        return float("nan"), float("nan")
    means = np.array([(part**2).mean() for part in np.array_split(residual, BATCHES)])
    half = student.ppf(0.975, BATCHES - 1) * means.std(ddof=1) / np.sqrt(BATCHES)
    rmse, factor = float(np.sqrt((residual**2).mean())), float(np.exp(half / means.mean() / 2))
    return rmse / factor, rmse * factor


def _extremes(parts: pd.DataFrame) -> tuple[pd.Series, pd.Series]:
    """The parts with the largest and with the smallest error."""
    return parts.loc[parts["rmse_deg"].idxmax()], parts.loc[parts["rmse_deg"].idxmin()]


def _error(row: pd.Series) -> str:
    return f"{row['rmse_deg']:.2g} deg"


def _range(row: pd.Series) -> str:
    low, high = (f"{v:.0f}" if abs(v) >= 10 else f"{v:.2g}" for v in (row["low"], row["high"]))
    return f"{low} to {high}"


def _name_and_unit(factors: Sequence[str]) -> tuple[str, str]:
    """`speed [deg/s]` as "speed" and " deg/s"; a number without a unit has none. Of several the names together."""
    names, units = zip(*(factor.removesuffix("]").rsplit(" [", 1) for factor in factors), strict=True)
    others = " and ".join(name.removeprefix("activation ") for name in names[1:])
    name = names[0].replace("activation", "activation of") + (f" and {others}" if others else "")
    return name, "" if units[0] == "-" else f" {units[0]}"


def sharing(table: pd.DataFrame, name: str, shown: Sequence[str]) -> list[list[str]]:
    """The names of a table, together where the same stands under them, as of muscles that share a channel.

    Args:
        name: column of the names.
        shown: columns that are compared.
    """
    found: dict[str, list[str]] = {}
    for one, rows in table.groupby(name, sort=False):
        found.setdefault(rows[list(shown)].to_csv(index=False), []).append(str(one))
    return [*found.values()]
