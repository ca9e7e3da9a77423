"""Viscous damping of the joint."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def damping_torque(qdot: Tensor, *, c: Tensor) -> Tensor:
    """Torque [N m] against the angular velocity [rad/s], -c qdot."""
    return -c * qdot


EFFECT = Effect(
    name="joint_damping",
    title="damping of the joint",
    acts_on="joint",
    equation="-c qdot",
    function=damping_torque,
    parameters={"c": Parameter("N m s/rad", high=10.0, typical=1.0, meaning="viscous coefficient of the joint")},
    source="Hayes & Hatze 1977, J. Biomech. 10, passive visco-elastic properties of the elbow",
)
