"""Dimensionless muscle curves: force-length, passive force, force-velocity. All act element-wise.

Lengths are in units of the optimal fibre length l0, velocities in units of v_max and positive when lengthening,
forces in units of the maximum isometric force f0.
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

Curve = Callable[[Tensor], Tensor]

# Thelen 2003, Table 1 (young adults): shape of the force-velocity hyperbola and the largest eccentric force.
SHAPE_AF = 0.25
ECCENTRIC_FORCE = 1.4
# Eq. 50: passive curve of an adult.
PASSIVE_GAMMA1 = 0.075
PASSIVE_GAMMA2 = 6.6


def active_length_taneja(length: Tensor) -> Tensor:
    """Active force-length curve of three parabolas, peak 1 at length 1, C1.

    Source: Taneja et al. 2023, Eq. 49.
    """
    # ASSUME: no active force outside [0.4, 1.6]; as printed, Eq. 49 rises again there.
    middle = 1 - 4 * (1 - length) ** 2
    outer = 9 * torch.where(length < 1, length - 0.4, length - 1.6) ** 2
    curve = torch.where((length - 1).abs() <= 0.4, middle, outer)
    return torch.where((length - 1).abs() < 0.6, curve, 0.0)


def passive_taneja(length: Tensor) -> Tensor:
    """Passive force-length curve: zero up to length 1, exponential to 1.4, then straight, C1 at 1.4.

    Source: Taneja et al. 2023, Eq. 50.
    """
    toe = torch.special.expm1(PASSIVE_GAMMA2 * (length.clamp(1.0, 1.4) - 1))
    slope = PASSIVE_GAMMA2 * torch.exp(torch.tensor(0.4 * PASSIVE_GAMMA2, dtype=length.dtype, device=length.device))
    return PASSIVE_GAMMA1 * (toe + slope * (length - 1.4).clamp(min=0.0))


def force_velocity_thelen(velocity: Tensor) -> Tensor:
    """Normalised Hill hyperbola: 0 at -1, 1 at 0, towards 1.4 when lengthening; C1 at 0.

    Source: Hill 1938 with the constants of Thelen 2003. The paper cites the curve [67] without a formula.
    """
    shorten = velocity.clamp(-1.0, 0.0)
    lengthen = velocity.clamp(min=0.0)
    steepness = (1 + 1 / SHAPE_AF) / (ECCENTRIC_FORCE - 1)
    concentric = (1 + shorten) / (1 - shorten / SHAPE_AF)
    eccentric = (1 + lengthen * ECCENTRIC_FORCE * steepness) / (1 + lengthen * steepness)
    return torch.where(velocity <= 0, concentric, eccentric)


@dataclass(frozen=True)
class Curves:
    """The three curves that make a Hill-type muscle."""

    active_length: Curve = active_length_taneja
    passive: Curve = passive_taneja
    force_velocity: Curve = force_velocity_thelen


# What `physics.curves` in config.yaml may name, curve by curve.
ACTIVE_LENGTH: dict[str, Curve] = {"taneja": active_length_taneja}
PASSIVE: dict[str, Curve] = {"taneja": passive_taneja}
FORCE_VELOCITY: dict[str, Curve] = {"thelen": force_velocity_thelen}
