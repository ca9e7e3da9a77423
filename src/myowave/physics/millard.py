"""The muscle curves of Millard et al. 2013: quintic Bezier segments, tabulated once for look-up in torch.

A Bezier curve gives both x and y as polynomials of a parameter, so y(x) has no formula. The curve is sampled on a
uniform grid of x with its exact slope, and cubic Hermite pieces stand between: C1, and within 1e-9 of the curve.

Source: Millard, Uchida, Seth & Delp 2013, J. Biomech. Eng. 135, 021005, with the default values of OpenSim 4.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.interpolate import BPoly
from torch import Tensor

from myowave.physics.cubics import Cubics

CELLS = 2000  # of the look-up table

# Active force-length: shortest, transition and longest active length, slope of the shallow ascending part.
SHORTEST, TRANSITION, LONGEST, SHALLOW_SLOPE = 0.4441, 0.73, 1.8123, 0.8616
PLATEAU = 0.05  # half width of the plateau
# Passive: strain at f0, slopes at the foot and at f0, curviness.
PASSIVE_STRAIN, FOOT_SLOPE, PASSIVE_SLOPE, PASSIVE_CURVINESS = 0.7, 0.2, 2 / 0.7, 0.75
# Force-velocity: slopes near v_max when shortening, at 0, near v_max when lengthening; largest force; curviness.
CONCENTRIC_SLOPE, ISOMETRIC_SLOPE, ECCENTRIC_SLOPE, ECCENTRIC_FORCE = 0.25, 5.0, 0.15, 1.4
CONCENTRIC_CURVINESS, ECCENTRIC_CURVINESS = 0.6, 0.9


@dataclass(frozen=True)
class Knot:
    """Where two segments meet: position, value, slope."""

    x: float
    y: float
    slope: float


# ASSUME: no force outside the active range (OpenSim keeps 0.1 there where fibres have no damping of their own).
_SHOULDER = 1 - SHALLOW_SLOPE * (1 - PLATEAU - TRANSITION)
_TOE = min(0.1 / PASSIVE_SLOPE, 0.1 * PASSIVE_STRAIN)
_NEAR = 0.9  # v_max

# Each curve's knots.
CURVES = {
    "active_length": (
        Knot(SHORTEST, 0.0, 0.0),
        Knot((SHORTEST + TRANSITION) / 2, _SHOULDER / 2, 1.25 * _SHOULDER / (TRANSITION - SHORTEST)),
        Knot((TRANSITION + 1 - PLATEAU) / 2, (_SHOULDER + 1) / 2, SHALLOW_SLOPE),
        Knot(1.0, 1.0, 0.0),
        Knot((1 + PLATEAU + LONGEST) / 2, 0.5, -1 / (LONGEST - 1 - 2 * PLATEAU)),
        Knot(LONGEST, 0.0, 0.0),
    ),
    "passive": (
        Knot(1.0, 0.0, 0.0),
        Knot(1 + _TOE, FOOT_SLOPE * _TOE / 2, FOOT_SLOPE),
        Knot(1 + PASSIVE_STRAIN, 1.0, PASSIVE_SLOPE),
    ),
    "force_velocity": (
        Knot(-1.0, 0.0, 0.0),
        Knot(-_NEAR, CONCENTRIC_SLOPE * (1 - _NEAR) / 2, CONCENTRIC_SLOPE),
        Knot(0.0, 1.0, ISOMETRIC_SLOPE),
        Knot(_NEAR, ECCENTRIC_FORCE - ECCENTRIC_SLOPE * (1 - _NEAR) / 2, ECCENTRIC_SLOPE),
        Knot(1.0, ECCENTRIC_FORCE, 0.0),
    ),
}
CURVINESS = {
    "active_length": (1.0,) * 5,
    "passive": (PASSIVE_CURVINESS,) * 2,
    "force_velocity": (CONCENTRIC_CURVINESS,) * 2 + (ECCENTRIC_CURVINESS,) * 2,
}


def millard_curve(name: str, x: Tensor) -> Tensor:
    """A curve of `CURVES`, element-wise: active force, 0 outside lengths of 0.444 to 1.812 with a plateau around 1;
    passive force, 0 below length 1, 1 at 1.7, straight beyond; force-velocity, 0 at -1, 1 at 0, 1.4 from 1 on."""
    return _table(name, x.dtype, x.device).value(x)


@functools.cache
def _table(name: str, dtype: torch.dtype, device: torch.device) -> Cubics:
    return Cubics.through(*_sample(CURVES[name], CURVINESS[name])).to(dtype, device)


def _sample(
    knots: Sequence[Knot], curviness: Sequence[float]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Value and slope of a chain of Bezier corners on a uniform grid of x."""
    grid = np.linspace(knots[0].x, knots[-1].x, CELLS + 1)
    y, slope = np.empty_like(grid), np.empty_like(grid)
    for left, right, c in zip(knots[:-1], knots[1:], curviness, strict=True):
        here = (grid >= left.x) & (grid <= right.x)
        across, up = _corner(left, right, c)
        u = _parameter_at(across, grid[here])
        y[here], slope[here] = up(u), up(u, 1) / across(u, 1)
    y[[0, -1]], slope[[0, -1]] = (knots[0].y, knots[-1].y), (knots[0].slope, knots[-1].slope)  # free of rounding
    return grid, y, slope


def _corner(left: Knot, right: Knot, curviness: float) -> tuple[BPoly, BPoly]:
    """x(u) and y(u) of a quintic Bezier curve between two knots, bent like the corner that their tangents form."""
    sharp = 0.1 + 0.8 * curviness
    x = (right.y - left.y - right.x * right.slope + left.x * left.slope) / (left.slope - right.slope)
    corner = np.array([x, left.y + left.slope * (x - left.x)])
    first, last = np.array([left.x, left.y]), np.array([right.x, right.y])
    near_first, near_last = first + sharp * (corner - first), last + sharp * (corner - last)
    points = np.stack([first, near_first, near_first, near_last, near_last, last])
    return BPoly(points[:, :1], [0.0, 1.0]), BPoly(points[:, 1:], [0.0, 1.0])


def _parameter_at(across: BPoly, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """u with across(u) = x, for a polynomial that increases over [0, 1]: table, then Newton."""
    u = np.linspace(0, 1, 401)
    u = np.interp(x, across(u), u)
    for _ in range(6):
        u = np.clip(u - (across(u) - x) / across(u, 1), 0.0, 1.0)
    return u
