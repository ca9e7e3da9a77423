"""Dry friction of the joint."""

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter

# ASSUME: friction grows from rest over about this angular velocity [rad/s]. A jump at 0 would be no function of the
# velocity; what bends or creeps before it slides, as gears and tissue do, grows over up to five times as much.
STICTION = 0.03


def grown(qdot: Tensor, s: Tensor | float = 0.0) -> Tensor:
    """Share of friction that is there at angular velocities [rad/s], with its sign, tanh(qdot / (0.03 exp(s)))."""
    return torch.tanh(qdot / STICTION * torch.exp(-torch.as_tensor(s)))


def friction_torque(qdot: Tensor, *, tau: Tensor, s: Tensor) -> Tensor:
    """Torque [N m] against the motion, -tau tanh(qdot / v), v = 0.03 exp(s)."""
    return -tau * grown(qdot, s)


GROWTH = Parameter("-", low=-1.6, high=1.6, typical=1.0, meaning="logarithm of v over 0.03 rad/s", alone=False)

EFFECT = Effect(
    name="coulomb_friction",
    title="dry friction of the joint",
    acts_on="joint",
    equation="-tau tanh(qdot / v), v = 0.03 rad/s exp(s)",
    function=friction_torque,
    parameters={"tau": Parameter("N m", high=5.0, typical=0.5, meaning="dry friction of the joint"), "s": GROWTH},
    source="Coulomb friction, smooth as in Andersson, Soderberg & Bjorklund 2007, Tribol. Int. 40",
)
