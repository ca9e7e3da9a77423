"""Stops at both ends of the range of the joint."""

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter

# ASSUME: the elbow straight and flexed by 145 degrees are the ends of its range [rad]; both stops are equally firm.
EXTENDED, FLEXED = 0.0, 2.53
STEEPNESS = 10.0  # 1/rad
# ASSUME: beyond 1.2 rad past a stop its torque grows no more; a joint is never there, a solver's trial step may be.
DEEPEST = 12.0


def stop_torque(q: Tensor, *, k: Tensor) -> Tensor:
    """Torque [N m] away from the ends of the range, k at an end and exponential around it."""
    at_extension = torch.exp((STEEPNESS * (EXTENDED - q)).clamp(max=DEEPEST))
    at_flexion = torch.exp((STEEPNESS * (q - FLEXED)).clamp(max=DEEPEST))
    return k * (at_extension - at_flexion)


EFFECT = Effect(
    name="joint_stops",
    title="stops at the ends of the joint's range",
    acts_on="joint",
    equation="k (exp(-10 q) - exp(10 (q - 2.53 rad)))",
    function=stop_torque,
    parameters={"k": Parameter("N m", high=10.0, typical=1.0, meaning="torque of the stops at the ends of the range")},
    source="double exponential as in Riener & Edrich 1999, J. Biomech. 32, and Lemay & Crago 1996, J. Biomech. 29",
)
