"""What a map of missing torque over angle and velocity looks like, in a sentence."""

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array = NDArray[np.float64]

CLEAR = 0.6  # share of the map that a pattern must explain to be named
ALIKE = 0.05  # shares that differ by less are not told apart; each further coefficient must bring as much
FEWEST = 5  # cells
STILL_RAD_S = 0.05  # slower than this has no direction


def tell_missing_torque(cells: pd.DataFrame, rms: float, model: str) -> str:
    """The map of one model in a sentence: against the velocity, the direction, the angle, or everywhere the same.

    Args:
        cells: columns angle_rad, velocity_rad_s (centres), torque_Nm (positive towards flexion), windows.
        rms: missing torque beyond what noise shows [N m]; 0 where there is none.
        model: its name.
    """
    if rms <= 0:
        return f"Beside {model} no torque is missing beyond what noise shows."
    if len(cells) < FEWEST:
        return "The map has too few cells to see a pattern."
    angle, velocity, torque, weight = (
        cells[c].to_numpy(dtype=float) for c in ("angle_rad", "velocity_rad_s", "torque_Nm", "windows")
    )
    lacks = f"What {model} lacks, {rms:.2g} N m RMS,"
    one = np.ones_like(angle)
    moving = np.where(np.abs(velocity) > STILL_RAD_S, np.sign(velocity), 0.0)
    fits = {
        "same": _fit(torque, weight, one),
        "velocity": _fit(torque, weight, velocity),
        "direction": _fit(torque, weight, moving),
        "angle": _fit(torque, weight, one, angle),
    }
    worth = {name: share - ALIKE * (len(c) - 1) for name, (c, share) in fits.items()}
    best = max(worth, key=lambda name: worth[name])
    if fits[best][1] < CLEAR:
        return (
            f"{lacks} follows no simple pattern: neither a constant torque nor one that goes with the angle "
            f"or the velocity explains more than {max(fits[best][1], 0):.0%} of the map."
        )
    coefficients, share = fits[best]
    told = {"same": _same, "velocity": _velocity, "direction": _direction, "angle": _angle}[best](coefficients)
    text = f"{lacks} {told} This explains {share:.0%} of the map."
    other = {"velocity": "direction", "direction": "velocity"}.get(best)
    if other and coefficients[0] < 0 and worth[other] > worth[best] - ALIKE:
        text += " The map does not tell damping, which grows with the speed, from friction, which does not."
    return text


def _fit(torque: Array, weight: Array, *columns: Array) -> tuple[Array, float]:
    """Weighted least squares: coefficients, and the share of the squares that they explain."""
    root = np.sqrt(weight)
    design = np.stack(columns, -1) * root[:, None]
    coefficients = np.asarray(np.linalg.lstsq(design, torque * root, rcond=None)[0], dtype=np.float64)
    left = ((torque * root - design @ coefficients) ** 2).sum()
    return coefficients, float(1 - left / (weight * torque**2).sum())


def _same(coefficients: Array) -> str:
    size = f"{coefficients[0]:+.2g} N m"
    return f"is much the same everywhere, {size}: that is what a constant torque, a load or a tilt does."


def _velocity(coefficients: Array) -> str:
    size = f"by {abs(coefficients[0]):.2g} N m for each rad/s"
    if coefficients[0] < 0:
        return f"opposes the velocity, {size}: that is what damping does."
    return f"goes with the velocity, {size}: the model brakes the motion more than the arm does."


def _direction(coefficients: Array) -> str:
    size = f"by about {abs(coefficients[0]):.2g} N m at any speed"
    if coefficients[0] < 0:
        return f"opposes the motion, {size}: that is what dry friction does."
    return f"goes with the motion, {size}: the model brakes it more than the arm does."


def _angle(coefficients: Array) -> str:
    constant, slope = coefficients
    rest = np.degrees(-constant / slope)
    size = f"by {abs(slope):.2g} N m for each rad"
    if slope < 0:
        return f"pulls towards {rest:.0f} deg, {size} away from there: that is what stiffness does."
    why = "that is what a wrong weight, moment arm or length of a muscle does."
    return f"pushes away from {rest:.0f} deg, {size} away from there: {why}"
