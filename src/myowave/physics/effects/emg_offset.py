"""EMG that is not 0 at rest: noise of the amplifier, heart, tone that makes no force."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def without_rest(excitation: Tensor, *, b: Tensor) -> Tensor:
    """Excitation u - b; what falls below 0 counts as 0 in Eq. 2."""
    return excitation - b


EFFECT = Effect(
    name="emg_offset",
    title="EMG that is not 0 at rest",
    acts_on="excitation",
    equation="u - b",
    function=without_rest,
    parameters={"b": Parameter("-", low=-0.3, high=0.3, typical=0.05, meaning="EMG at rest", each="electrode")},
    source="offset of rectified surface EMG, e.g. De Luca 1997, J. Appl. Biomech. 13",
)
