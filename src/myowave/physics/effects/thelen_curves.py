"""The muscle curves of Thelen 2003 instead of the base model's, with a v_max that falls with the activation."""

from myowave.physics.curves import THELEN
from myowave.physics.effect import Effect, Parameter
from myowave.physics.muscle import share_of

EFFECT = Effect(
    name="thelen_curves",
    title="Thelen's muscle curves",
    acts_on="muscle",
    equation="(1 - w) F + w F_thelen",
    function=share_of(THELEN),
    parameters={"w": Parameter("-", high=1.0, typical=1.0, meaning="share of the curves of Thelen 2003")},
    source="Thelen 2003, J. Biomech. Eng. 125, 70",
    replaces=True,
)
