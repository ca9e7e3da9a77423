"""An angle sensor with a wrong zero."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def offset_angle(q: Tensor, *, b: Tensor) -> Tensor:
    """Measured angle q + b [rad]."""
    return q + b


EFFECT = Effect(
    name="angle_offset",
    title="an offset of the angle sensor",
    acts_on="observation",
    equation="q + b",
    function=offset_angle,
    parameters={"b": Parameter("rad", low=-0.5, high=0.5, typical=0.05, meaning="zero error of the angle sensor")},
    source="calibration error of a goniometer",
)
