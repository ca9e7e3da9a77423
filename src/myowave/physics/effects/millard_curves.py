"""The muscle curves of Millard et al. 2013 instead of the base model's."""

from myowave.physics.curves import MILLARD
from myowave.physics.effect import Effect, Parameter
from myowave.physics.muscle import share_of

EFFECT = Effect(
    name="millard_curves",
    title="Millard's muscle curves",
    acts_on="muscle",
    equation="(1 - w) F + w F_millard",
    function=share_of(MILLARD),
    parameters={"w": Parameter("-", high=1.0, typical=1.0, meaning="share of the curves of Millard et al. 2013")},
    source="Millard, Uchida, Seth & Delp 2013, J. Biomech. Eng. 135, 021005",
    replaces=True,
)
