"""Passive stiffness of the joint: capsule, ligaments, skin."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter

# ASSUME: the passive elbow rests at 1.0 rad (57 degrees of flexion). Another rest angle is a constant torque besides.
REST_ANGLE = 1.0


def stiffness_torque(q: Tensor, *, k: Tensor) -> Tensor:
    """Torque [N m] towards the rest angle, -k (q - 1.0 rad)."""
    return -k * (q - REST_ANGLE)


EFFECT = Effect(
    name="joint_stiffness",
    title="stiffness of the joint",
    acts_on="joint",
    equation="-k (q - 1.0 rad)",
    function=stiffness_torque,
    parameters={"k": Parameter("N m/rad", high=10.0, typical=1.0, meaning="passive stiffness of the joint")},
    source="Hayes & Hatze 1977, J. Biomech. 10, passive visco-elastic properties of the elbow",
)
