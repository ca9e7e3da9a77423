"""Drag of the air, or of water, that grows with the square of the speed."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def drag_torque(qdot: Tensor, *, d: Tensor) -> Tensor:
    """Torque [N m] against the angular velocity [rad/s], -d qdot |qdot|."""
    return -d * qdot * qdot.abs()


EFFECT = Effect(
    name="quadratic_drag",
    title="drag that grows with speed squared",
    acts_on="joint",
    equation="-d qdot |qdot|",
    function=drag_torque,
    parameters={"d": Parameter("N m s^2/rad^2", high=5.0, typical=0.2, meaning="drag at 1 rad/s")},
    source="Nelson & Olsson 1986, Am. J. Phys. 54, 112-121, The pendulum - rich physics from a simple system",
)
