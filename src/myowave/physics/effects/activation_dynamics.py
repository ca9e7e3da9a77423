"""Activation follows its command with a lag: calcium is released faster than it is taken up."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def lagging_activation(state: Tensor) -> Tensor:
    """The activation is the effect's state."""
    return state


def lag(activation: Tensor, state: Tensor, *, rise: Tensor, decay: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """The state relaxes to the activation of Eq. 2, with time constants `rise` and `decay` [s] at an activation of 1/3:
    an active muscle takes longer to become more active, and less time to relax."""
    active = 0.5 + 1.5 * state
    return activation, rise * active, decay / active


def at_its_target(activation: Tensor) -> Tensor:
    """At the first sample the lag is over."""
    return activation


EFFECT = Effect(
    name="activation_dynamics",
    title="activation dynamics",
    acts_on="activation",
    equation="dy/dt = (a - y) / (rise (0.5 + 1.5 y) where a > y, else decay / (0.5 + 1.5 y))",
    function=lagging_activation,
    relaxation=lag,
    initial=at_its_target,
    parameters={
        "rise": Parameter(
            "s", high=0.3, typical=0.03, meaning="time constant of rising activation, at an activation of 1/3"
        ),
        "decay": Parameter(
            "s", high=0.5, typical=0.06, meaning="time constant of falling activation, at an activation of 1/3"
        ),
    },
    source="Thelen 2003, J. Biomech. Eng. 125, Eqs. 1-2; OpenSim has the same",
)
