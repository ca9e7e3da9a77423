"""Another curvature of the relation between EMG and activation."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def other_shape(shape: Tensor, *, dA: Tensor) -> dict[str, Tensor]:
    """The shape factor A of Eq. 2 of every muscle with dA added."""
    return {"shape": shape + dA}


EFFECT = Effect(
    name="activation_shape",
    title="another nonlinearity from EMG to activation",
    acts_on="constants",
    equation="a(u) with A + dA",
    function=other_shape,
    parameters={
        "dA": Parameter("-", low=-3.0, high=3.0, typical=-0.5, meaning="change of the shape factor A", each="electrode")
    },
    source="Eq. 2 of Taneja et al. 2023; A in (-3, 0) in Lloyd & Besier 2003, J. Biomech. 36",
)
