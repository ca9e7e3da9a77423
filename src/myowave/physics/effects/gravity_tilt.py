"""An upper arm that does not hang as one thinks it does."""

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def tilt_torque(q: Tensor, weight: Tensor, tilt: Tensor, *, phi: Tensor) -> Tensor:
    """What gravity's torque [N m] changes by when the upper arm leans forward by phi [rad] more than is known."""
    known = q + tilt
    return -weight * (torch.sin(known + phi) - torch.sin(known))


EFFECT = Effect(
    name="gravity_tilt",
    title="a tilt of the upper arm",
    acts_on="joint",
    equation="-weight (sin(q + tilt + phi) - sin(q + tilt))",
    function=tilt_torque,
    parameters={
        "phi": Parameter("rad", low=-0.8, high=0.8, typical=0.1, meaning="tilt of the upper arm, forward positive")
    },
    source="Eq. 56 of Taneja et al. 2023 with the angle to the vertical q + phi",
)
