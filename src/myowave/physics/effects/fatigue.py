"""Fatigue: a muscle that has worked gives less force for the same activation."""

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter

# ASSUME: past activation is forgotten, and the muscle recovers, with this time constant [s].
RECOVERY = 30.0


def fatigued_activation(activation: Tensor, state: Tensor, *, k: Tensor) -> Tensor:
    """Activation a (1 - k y); y is the running mean of the activation, 0 in a rested muscle."""
    return activation * (1.0 - k * state)


def accumulation(activation: Tensor, state: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """The state is the activation's running mean over the time of recovery."""
    recovery = torch.full_like(state, RECOVERY)
    return activation, recovery, recovery


EFFECT = Effect(
    name="fatigue",
    title="muscle fatigue",
    acts_on="activation",
    equation="a (1 - k y), dy/dt = (a - y) / 30 s",
    function=fatigued_activation,
    relaxation=accumulation,
    parameters={"k": Parameter("-", high=1.0, typical=0.4, meaning="loss of activation after long full activation")},
    source="one compartment after Xia & Frey Law 2008, J. Biomech. 41",
)
