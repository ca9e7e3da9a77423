"""An angle sensor on something that gives: skin, a strap, a rod that bends between motor and load."""

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def giving_angle(q: Tensor, qdot: Tensor, dt: float, *, s: Tensor) -> Tensor:
    """Measured angle q + s d2q/dt2 [rad] from samples (..., N), two at least, every `dt` seconds.

    The acceleration is the central difference of the velocity, one-sided at both ends.
    """
    (acceleration,) = torch.gradient(qdot, spacing=dt, dim=-1)
    return q + s * acceleration


EFFECT = Effect(
    name="elastic_mount",
    title="a flexible mount of the angle sensor",
    acts_on="observation",
    equation="q + s qddot",
    function=giving_angle,
    parameters={
        "s": Parameter(
            "s^2",
            low=-0.01,
            high=0.01,
            typical=0.001,
            meaning="angle for an acceleration, 1 / (2 pi f)^2; below 0 where the sensor stays behind",
        )
    },
    source="deflection of a mass on a spring far below its resonance f; skin: Trujillo & Busby 1990",
)
