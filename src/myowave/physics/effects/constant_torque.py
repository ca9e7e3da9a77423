"""A torque that never changes: a cable, a spring balance, a wrong zero of gravity."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def constant_torque(*, tau: Tensor) -> Tensor:
    """The same torque [N m] in every state, flexing positive."""
    return tau


EFFECT = Effect(
    name="constant_torque",
    title="a constant torque",
    acts_on="joint",
    equation="tau",
    function=constant_torque,
    parameters={
        "tau": Parameter("N m", low=-10.0, high=10.0, typical=0.5, meaning="constant torque, flexing positive")
    },
    source="an external load that depends on nothing",
)
