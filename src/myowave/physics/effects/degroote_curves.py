"""The muscle curves of De Groote et al. 2016 instead of the base model's."""

from myowave.physics.curves import DEGROOTE
from myowave.physics.effect import Effect, Parameter
from myowave.physics.muscle import share_of

EFFECT = Effect(
    name="degroote_curves",
    title="De Groote's muscle curves",
    acts_on="muscle",
    equation="(1 - w) F + w F_degroote",
    function=share_of(DEGROOTE),
    parameters={"w": Parameter("-", high=1.0, typical=1.0, meaning="share of the curves of De Groote et al. 2016")},
    source="De Groote, Kinney, Rao & Fregly 2016, Ann. Biomed. Eng. 44, 2922",
    replaces=True,
)
