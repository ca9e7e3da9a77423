"""Another electromechanical delay than the one assumed."""

from torch import Tensor

from myowave.physics.constants import LATEST_S
from myowave.physics.effect import Effect, Parameter


def longer_delay(delay: Tensor, *, d: Tensor) -> dict[str, Tensor]:
    """The delay [s] of every muscle with d added; never below 0, nor above the longest."""
    return {"delay": (delay + d).clamp(0.0, LATEST_S)}


EFFECT = Effect(
    name="extra_delay",
    title="another electromechanical delay",
    acts_on="constants",
    equation="u(t) = e(t - delay - d)",
    function=longer_delay,
    parameters={
        "d": Parameter("s", low=-0.1, high=0.2, typical=0.02, meaning="delay beyond the assumed one", each="electrode")
    },
    source="Eq. 1 of Taneja et al. 2023; delays of 30-150 ms in Corcos et al. 1992, J. Electromyogr. Kinesiol. 2",
)
