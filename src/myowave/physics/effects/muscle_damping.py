"""Viscous damping of the muscle fibres, active or not."""

from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def damped_force(force: Tensor, fibre_velocity: Tensor, *, c: Tensor) -> Tensor:
    """Force of the fibre [f0] with a dashpot beside it, force + c v; v [v_max], lengthening positive."""
    # ASSUME: the dashpot pushes as well as it pulls.
    return force + c * fibre_velocity


EFFECT = Effect(
    name="muscle_damping",
    title="damping of the muscle fibres",
    acts_on="muscle",
    equation="F + c v",
    function=damped_force,
    parameters={"c": Parameter("f0/v_max", high=1.0, typical=0.1, meaning="damping of the muscle fibres")},
    source="Millard, Uchida, Seth & Delp 2013, J. Biomech. Eng. 135, damped equilibrium model (c = 0.1)",
)
