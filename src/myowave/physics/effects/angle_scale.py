"""An angle sensor with a wrong scale."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def scaled_angle(q: Tensor, *, s: Tensor) -> Tensor:
    """Measured angle (1 + s) q [rad]."""
    return (1.0 + s) * q


EFFECT = Effect(
    name="angle_scale",
    title="a wrong gain of the angle sensor",
    acts_on="observation",
    equation="(1 + s) q",
    function=scaled_angle,
    parameters={"s": Parameter("-", low=-0.3, high=0.3, typical=0.05, meaning="scale error of the angle sensor")},
    source="calibration error of a goniometer",
)
