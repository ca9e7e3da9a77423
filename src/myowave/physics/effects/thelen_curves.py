"""The muscle curves of Thelen 2003 instead of the base model's, with a v_max that falls with the activation."""

from torch import Tensor

from myowave.physics.curves import THELEN, Curves
from myowave.physics.effect import Effect, Parameter
from myowave.physics.muscle import hill_force


def other_force(
    force: Tensor, activation: Tensor, fibre_length: Tensor, fibre_velocity: Tensor, curves: Curves, *, w: Tensor
) -> Tensor:
    """Force of the fibre [f0] with a share w of the other curves and 1 - w of the base model's."""
    other = hill_force(curves.in_shape(THELEN), activation, fibre_length, fibre_velocity)
    return force + w * (other - hill_force(curves, activation, fibre_length, fibre_velocity))


EFFECT = Effect(
    name="thelen_curves",
    title="other muscle curves",
    acts_on="muscle",
    equation="(1 - w) F + w F_thelen",
    function=other_force,
    parameters={
        "w": Parameter(unit="-", low=0.0, high=1.0, typical=1.0, meaning="share of the curves of Thelen 2003"),
    },
    source="Thelen 2003, J. Biomech. Eng. 125, 70",
)
