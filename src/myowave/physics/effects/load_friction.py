"""Dry friction of a drive that grows with the torque that it passes on."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter
from myowave.physics.effects.coulomb_friction import GROWTH, grown


def load_friction_torque(qdot: Tensor, torque: Tensor, gravity: Tensor, *, mu: Tensor, s: Tensor) -> Tensor:
    """Torque [N m] against the motion, -mu |torque - gravity| tanh(qdot / v), v = 0.03 exp(s). Where the drive
    holds the weight, both press on it, from its two sides."""
    return -mu * (torque - gravity).abs() * grown(qdot, s)


EFFECT = Effect(
    name="load_friction",
    title="friction that grows with the load",
    acts_on="joint",
    equation="-mu |torque - gravity| tanh(qdot / v), v = 0.03 rad/s exp(s)",
    function=load_friction_torque,
    parameters={"mu": Parameter("-", high=1.0, typical=0.1, meaning="share of the load lost in friction"), "s": GROWTH},
    source="Duclusaud et al. 2024, arXiv 2410.08650, extended friction models of servo actuators",
)
