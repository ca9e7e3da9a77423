"""EMG normalised to a wrong maximum."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def rescaled(excitation: Tensor, *, g: Tensor) -> Tensor:
    """Excitation (1 + g) u, before the curved relation of Eq. 2."""
    return (1.0 + g) * excitation


EFFECT = Effect(
    name="emg_gain",
    title="EMG normalised to a wrong maximum",
    acts_on="excitation",
    equation="(1 + g) u",
    function=rescaled,
    parameters={
        "g": Parameter(
            "-",
            low=-0.7,
            high=2.0,
            typical=0.2,
            meaning="how far excitation is above the normalised EMG",
            each="electrode",
        )
    },
    source="error of the maximum voluntary contraction; with A = 0 the same as the muscle's strength",
)
