"""What a map of missing torque over angle and velocity looks like."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Array = NDArray[np.float64]

ALIKE = 0.05  # shares that differ by less are not told apart; each further coefficient must bring as much
FEWEST = 5  # cells
STILL_RAD_S = 0.05  # slower than this has no direction


def find_pattern(cells: pd.DataFrame) -> dict[str, Any] | None:
    """The simple torque that explains most of a map, as plain data; none where it has too few cells.

    Args:
        cells: columns angle_rad, velocity_rad_s (centres), torque_Nm (positive towards flexion), windows.

    Returns:
        kind: `same` everywhere, or with `velocity`, `direction` or `angle`; coefficients: [N m], or for each rad/s or
        rad (of the angle after the constant); share: of the map's squares that it explains [-]; as_good: another kind
        that is not told apart from it, or None.
    """
    if len(cells) < FEWEST:
        return None
    angle, velocity, torque, weight = (
        cells[c].to_numpy(dtype=float) for c in ("angle_rad", "velocity_rad_s", "torque_Nm", "windows")
    )
    one = np.ones_like(angle)
    moving = np.where(np.abs(velocity) > STILL_RAD_S, np.sign(velocity), 0.0)
    kinds = {"same": [one], "velocity": [velocity], "direction": [moving], "angle": [one, angle]}
    fits = {kind: _explain(torque, weight, *columns) for kind, columns in kinds.items()}
    worth = {kind: share - ALIKE * (len(found) - 1) for kind, (found, share) in fits.items()}
    best = max(worth, key=lambda kind: worth[kind])
    other = {"velocity": "direction", "direction": "velocity"}.get(best)
    coefficients, share = fits[best]
    as_good = other if other and worth[other] > worth[best] - ALIKE else None
    return {"kind": best, "coefficients": coefficients.tolist(), "share": share, "as_good": as_good}


def _explain(torque: Array, weight: Array, *columns: Array) -> tuple[Array, float]:
    """Weighted least squares: coefficients, and the share of the squares that they explain."""
    root = np.sqrt(weight)
    design = np.stack(columns, -1) * root[:, None]
    coefficients = np.asarray(np.linalg.lstsq(design, torque * root, rcond=None)[0], dtype=np.float64)
    left = ((torque * root - design @ coefficients) ** 2).sum()
    return coefficients, float(1 - left / (weight * torque**2).sum())
