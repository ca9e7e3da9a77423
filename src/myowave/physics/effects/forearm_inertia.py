"""A forearm with another moment of inertia than the model's."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def extra_inertia(inertia: Tensor, *, r: Tensor) -> Tensor:
    """Moment of inertia [kg m^2] beside that of the model's forearm without load, r I; r m l^2 for a point mass.

    The weight's moment stays. Of a model whose mass is a point at the wrist, mass spread towards the elbow with the
    same moment of weight has less inertia, r < 0; mass beyond the wrist more.
    """
    return r * inertia


EFFECT = Effect(
    name="forearm_inertia",
    title="another inertia of the forearm",
    acts_on="inertia",
    equation="I (1 + r) without the load",
    function=extra_inertia,
    parameters={
        "r": Parameter("-", low=-0.8, high=1.0, typical=-0.3, meaning="relative change of the forearm's inertia")
    },
    source="rigid body on a hinge; Eq. 55 of Taneja et al. 2023 is r = 0, a uniform rod r = -1/3",
)
