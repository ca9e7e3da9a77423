"""The muscle curves of Thelen 2003, young adults; element-wise.

Lengthening is resisted twice as steeply as shortening where both begin, and a muscle that is hardly active shortens
more slowly: its v_max is (1 - SLOWING (1 - a)) of that of a fully active one.

Source: Thelen 2003, J. Biomech. Eng. 125, 70, Eqs. 3-7 and Table 1.
"""

import math

import torch
from torch import Tensor

WIDTH = 0.45  # of the bell, gamma
PASSIVE_SHAPE, PASSIVE_STRAIN = 5.0, 0.6  # k_PE; strain at which the passive force is f0
SHAPE_AF = 0.25  # of the hyperbola; Hill's constant a over f0
ECCENTRIC_FORCE = 1.4  # the largest force when lengthening, F_len
STEEPER = 2.0  # slope where lengthening begins, over that where shortening begins
SLOWING = 0.75  # share of v_max that a muscle without activation lacks


def active_length_thelen(length: Tensor) -> Tensor:
    """Active force-length curve, a bell."""
    return torch.exp(-((length - 1.0) ** 2) / WIDTH)


def passive_thelen(length: Tensor) -> Tensor:
    """Passive force-length curve, exponential from length 1, 1 at 1.6."""
    # ASSUME: no passive force below length 1, where the formula is slightly negative; straight beyond 1.6.
    rate = PASSIVE_SHAPE / PASSIVE_STRAIN
    toe = torch.special.expm1(rate * (length.clamp(1.0, 1.0 + PASSIVE_STRAIN) - 1.0))
    beyond = rate * math.exp(PASSIVE_SHAPE) * (length - 1.0 - PASSIVE_STRAIN).clamp(min=0.0)
    return (toe + beyond) / math.expm1(PASSIVE_SHAPE)


def force_velocity_thelen(velocity: Tensor) -> Tensor:
    """Force-velocity curve, lengthening positive; its slope jumps at 0.

    Args:
        velocity: in units of the v_max that the muscle has at its activation.
    """
    # ASSUME: no force when shortening faster than v_max.
    velocity = velocity.clamp(min=-1.0)
    slope = 1.0 + 1.0 / SHAPE_AF
    bend = STEEPER * slope / (ECCENTRIC_FORCE - 1.0)
    steep = torch.where(velocity > 0, STEEPER * slope, slope)
    return 1.0 + steep * velocity / (1.0 + torch.where(velocity > 0, bend, -1.0 / SHAPE_AF) * velocity)
