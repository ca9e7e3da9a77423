"""Pennate fibres where the model has straight ones."""

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter

# Squared angle [rad^2] that counts as none: keeps the square root's derivative finite, changes forces by 1e-14.
NONE = 1e-14


def more_pennation(pennation: Tensor, *, s: Tensor) -> dict[str, Tensor]:
    """The pennation angle [rad] at optimal fibre length of every muscle, sqrt(pennation^2 + s).

    The square is the parameter because forces change with it from the start: a small angle alone changes nothing.
    """
    return {"pennation": torch.sqrt(pennation**2 + s + NONE)}


EFFECT = Effect(
    name="pennation",
    title="pennate fibres",
    acts_on="constants",
    equation="sqrt(pennation^2 + s)",
    function=more_pennation,
    parameters={"s": Parameter("rad^2", high=0.4, typical=0.03, meaning="square of the fibres' angle to the tendon")},
    source="Eqs. 46-47 of Taneja et al. 2023; fibres of constant height, Scott & Winter 1991, J. Biomech. 24",
)
