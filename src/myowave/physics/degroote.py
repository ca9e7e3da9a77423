"""The muscle curves of De Groote et al. 2016: smooth everywhere inside their range; element-wise.

Source: De Groote, Kinney, Rao & Fregly 2016, Ann. Biomed. Eng. 44, 2922, with the digits of OpenSim's
DeGrooteFregly2016Muscle, which make the curves 1 at length 1 and f_V exactly 0 at -1 and 1 at 0.
"""

import math

import torch
from torch import Tensor

# Three bells (height, centre, width, growth of the width with length).
BELLS = (
    (0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465),
    (0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188),
    (0.1, 1.0, 0.353553390593274, 0.0),
)
PASSIVE_SHAPE, PASSIVE_STRAIN = 4.0, 0.6
VELOCITY = (-0.3211346127989808, -8.149, -0.374, 0.8825327733249912)


def active_length_degroote(length: Tensor) -> Tensor:
    """Active force-length curve, a sum of three bells."""
    # ASSUME: below length 0.2 the curve keeps its value there, about 0; a bell's width is 0 at 0.15.
    length = length.clamp(min=0.2)
    bells = (h * torch.exp(-0.5 * ((length - c) / (w + g * length)) ** 2) for h, c, w, g in BELLS)
    return sum(bells, start=torch.zeros_like(length))


def passive_degroote(length: Tensor) -> Tensor:
    """Passive force-length curve, exponential from length 1, 1 at 1.6."""
    # ASSUME: no passive force below length 1, where the formula is slightly negative; straight beyond 1.6.
    toe = torch.special.expm1(PASSIVE_SHAPE / PASSIVE_STRAIN * (length.clamp(1.0, 1 + PASSIVE_STRAIN) - 1))
    slope = PASSIVE_SHAPE / PASSIVE_STRAIN * math.exp(PASSIVE_SHAPE)
    return (toe + slope * (length - 1 - PASSIVE_STRAIN).clamp(min=0.0)) / math.expm1(PASSIVE_SHAPE)


def force_velocity_degroote(velocity: Tensor) -> Tensor:
    """Force-velocity curve, lengthening positive."""
    # ASSUME: no force when shortening faster than v_max, where the formula is negative.
    d1, d2, d3, d4 = VELOCITY
    return (d1 * torch.asinh(d2 * velocity + d3) + d4).clamp(min=0.0)
