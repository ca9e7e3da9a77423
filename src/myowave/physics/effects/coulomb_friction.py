"""Dry friction of the joint."""

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter

# ASSUME: friction grows from rest over this angular velocity [rad/s]; a jump at 0 would be no function of the velocity.
STICTION = 0.1


def friction_torque(qdot: Tensor, *, tau: Tensor) -> Tensor:
    """Torque [N m] against the motion, of the same size at every angular velocity [rad/s], -tau tanh(qdot / 0.1)."""
    return -tau * torch.tanh(qdot / STICTION)


EFFECT = Effect(
    name="coulomb_friction",
    title="dry friction of the joint",
    acts_on="joint",
    equation="-tau tanh(qdot / 0.1 rad/s)",
    function=friction_torque,
    parameters={"tau": Parameter("N m", high=5.0, typical=0.5, meaning="dry friction of the joint")},
    source="Coulomb friction, smooth as in Andersson, Soderberg & Bjorklund 2007, Tribol. Int. 40",
)
