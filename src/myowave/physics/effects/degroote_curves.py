"""The muscle curves of De Groote et al. 2016 instead of the base model's."""

from torch import Tensor

from myowave.physics.curves import DEGROOTE, Curves
from myowave.physics.effect import Effect, Parameter
from myowave.physics.muscle import hill_force


def other_force(
    force: Tensor, activation: Tensor, fibre_length: Tensor, fibre_velocity: Tensor, curves: Curves, *, w: Tensor
) -> Tensor:
    """Force of the fibre [f0] with a share w of the other curves and 1 - w of the base model's."""
    other = hill_force(curves.in_shape(DEGROOTE), activation, fibre_length, fibre_velocity)
    return force + w * (other - hill_force(curves, activation, fibre_length, fibre_velocity))


EFFECT = Effect(
    name="degroote_curves",
    title="other muscle curves",
    acts_on="muscle",
    equation="(1 - w) F + w F_degroote",
    function=other_force,
    parameters={
        "w": Parameter(
            unit="-", low=0.0, high=1.0, typical=1.0, meaning="share of the curves of De Groote et al. 2016"
        ),
    },
    source="De Groote, Kinney, Rao & Fregly 2016, Ann. Biomed. Eng. 44, 2922",
)
