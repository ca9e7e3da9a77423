"""A tendon that stretches: fibres shorten while the joint stands still."""

import math
from collections.abc import Callable

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter

VELOCITY_STEP = 1e-3  # v_max, for the slope of the force-velocity curve
ROUNDS = 10  # of Newton's method at the first sample
FORCE_STEP = 1e-6  # f0, for the slope of what the fibre gives over what the tendon carries
STEEPEST = 0.5  # that slope counts up to here: at 1 a step would be infinite
# Thelen 2003, Eq. 5: an exponential toe up to a force [f0] and a share of the strain at f0, then a straight line. A
# tendon that carries little is a tenth as stiff as one that carries much.
TOE_FORCE, TOE_STRAIN, TOE_SHAPE = 0.33, 0.609, 3.0
TOE_RISE = math.expm1(TOE_SHAPE) / TOE_FORCE
LINEAR = (1.0 - TOE_STRAIN) / (1.0 - TOE_FORCE)  # strain over force above the toe


def tendon_force(state: Tensor) -> Tensor:
    """The tendon passes on what it carries: its force [f0] is the effect's state."""
    return state


def elongation(force: Tensor) -> Tensor:
    """Strain of the tendon under a force [f0], in units of that at f0."""
    toe = TOE_STRAIN / TOE_SHAPE * torch.log1p(TOE_RISE * force.clamp(0.0, TOE_FORCE))
    return toe + LINEAR * (force - TOE_FORCE).clamp(min=0.0)


def compliance(force: Tensor) -> Tensor:
    """Its slope over the force [1/f0]."""
    toe = TOE_STRAIN / TOE_SHAPE * TOE_RISE / (1.0 + TOE_RISE * force.clamp(0.0, TOE_FORCE))
    return torch.where(force < TOE_FORCE, toe, LINEAR)


def stretch(
    state: Tensor,
    activation: Tensor,
    hill: Callable[..., Tensor],
    fibre_length: Tensor,
    fibre_velocity: Tensor,
    l0: Tensor,
    vmax: Tensor,
    slack: Tensor,
    *,
    strain: Tensor,
) -> tuple[Tensor, Tensor, Tensor]:
    """The tendon's force y relaxes to the force of a fibre that moves as if the tendon were rigid.

    The tendon is longer by x = strain slack e(y), the fibre shorter by as much. It moves by dx/dt less than with a
    rigid tendon, which makes its force F - D dx/dt, with D the slope of force over velocity; it equals y. So
    dy/dt = (F - y) / (strain slack e'(y) D).
    """
    # ASSUME: a straight force-velocity curve between the velocities of the muscle and of its fibre; the tendon runs
    # along the fibres, whatever their pennation.
    force = hill(activation, fibre_length - strain * slack * elongation(state) / l0, fibre_velocity)
    faster = hill(activation, fibre_length, fibre_velocity + VELOCITY_STEP)
    slower = hill(activation, fibre_length, fibre_velocity - VELOCITY_STEP)
    slope = ((faster - slower) / (2.0 * VELOCITY_STEP * vmax)).clamp(min=0.0)
    time_constant = strain * slack * compliance(state) * slope
    return force, time_constant, time_constant


def balanced(
    activation: Tensor,
    hill: Callable[..., Tensor],
    fibre_length: Tensor,
    fibre_velocity: Tensor,
    force: Tensor,
    l0: Tensor,
    slack: Tensor,
    *,
    strain: Tensor,
) -> Tensor:
    """At the first sample tendon and fibre carry the same force, and the tendon's length stands still."""

    def given(force: Tensor) -> Tensor:
        return hill(activation, fibre_length - strain * slack * elongation(force) / l0, fibre_velocity)

    for _ in range(ROUNDS):
        now = given(force)
        # Whatever slope a round takes, the balance is where the force stays: no derivative goes through it.
        slope = ((given(force + FORCE_STEP) - now) / FORCE_STEP).detach().clamp(max=STEEPEST)
        force = force + (now - force) / (1.0 - slope)
    return force


EFFECT = Effect(
    name="compliant_tendon",
    title="an elastic tendon",
    acts_on="muscle",
    equation="dy/dt = (F(l - strain slack e(y) / l0, v) - y) / (strain slack e'(y) dF/dv)",
    function=tendon_force,
    relaxation=stretch,
    initial=balanced,
    parameters={"strain": Parameter("-", high=0.15, typical=0.04, meaning="strain of the tendon at force f0")},
    source="Thelen 2003, J. Biomech. Eng. 125, Eq. 5; strains of 0.033-0.049 there and in Millard et al. 2013",
)
