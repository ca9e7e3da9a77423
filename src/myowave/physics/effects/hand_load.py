"""A mass held in the hand that nobody noted."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def more_load(load: Tensor, *, m: Tensor) -> dict[str, Tensor]:
    """The load [kg] with m added, where the model's forearm holds it."""
    return {"load": load + m}


EFFECT = Effect(
    name="hand_load",
    title="a load in the hand that nobody noted",
    acts_on="constants",
    equation="load + m",
    function=more_load,
    parameters={"m": Parameter("kg", high=5.0, typical=0.3, meaning="mass held in the hand")},
    source="Eqs. 55-56 of Taneja et al. 2023 with another mass; in one condition the same motion as weaker muscles",
)
