"""Faster or slower muscles than assumed."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def other_vmax(vmax: Tensor, *, r: Tensor) -> dict[str, Tensor]:
    """Maximum contraction velocity [m/s] of every muscle, (1 + r) vmax."""
    return {"vmax": (1.0 + r) * vmax}


EFFECT = Effect(
    name="vmax_change",
    title="another maximum shortening velocity",
    acts_on="constants",
    equation="(1 + r) v_max",
    function=other_vmax,
    parameters={"r": Parameter("-", low=-0.7, high=3.0, typical=-0.3, meaning="relative change of v_max")},
    source="Eq. 46 of Taneja et al. 2023; v_max of 5-15 l0/s in Zajac 1989, Crit. Rev. Biomed. Eng. 17",
)
