"""Activation follows its command with a lag: calcium is released faster than it is taken up."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def lagging_activation(state: Tensor) -> Tensor:
    """The activation is the effect's state."""
    return state


def lag(activation: Tensor, state: Tensor, *, rise: Tensor, decay: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """The state relaxes to the activation of Eq. 2, with time constants `rise` and `decay` [s]."""
    return activation, rise, decay


def at_its_target(activation: Tensor) -> Tensor:
    """At the first sample the lag is over."""
    return activation


EFFECT = Effect(
    name="activation_dynamics",
    title="activation that lags",
    acts_on="activation",
    equation="dy/dt = (a - y) / (rise where a > y, else decay)",
    function=lagging_activation,
    relaxation=lag,
    initial=at_its_target,
    parameters={
        "rise": Parameter("s", high=0.3, typical=0.03, meaning="time constant of rising activation"),
        "decay": Parameter("s", high=0.5, typical=0.06, meaning="time constant of falling activation"),
    },
    source="Zajac 1989, Crit. Rev. Biomed. Eng. 17; time constants as in Thelen 2003, J. Biomech. Eng. 125",
)
