"""A forearm whose mass is not a point at the wrist."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def extra_inertia(mass: Tensor, length: Tensor, *, r: Tensor) -> Tensor:
    """Moment of inertia [kg m^2] beside that of the point mass at the wrist, r m l^2.

    The weight's moment m g l stays: it is what mass and length stand for. Mass spread towards the elbow with the same
    moment of weight has less inertia, r < 0; mass beyond the wrist more.
    """
    return r * mass * length * length


EFFECT = Effect(
    name="forearm_inertia",
    acts_on="inertia",
    equation="I = (m (1 + r) + load) l^2",
    function=extra_inertia,
    parameters={
        "r": Parameter(unit="-", low=-0.8, high=1.0, typical=-0.3, meaning="relative change of the forearm's inertia"),
    },
    source="rigid body on a hinge; Eq. 55 of Taneja et al. 2023 is r = 0, a uniform rod r = -1/3",
)
