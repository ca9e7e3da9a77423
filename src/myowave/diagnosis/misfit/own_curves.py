"""Muscle curves of a shape of their own: what an arm may have that no family of curves holds.

The published families differ from one another by more than their shapes in the settings make up for, and so will any
arm. Small smooth bumps on every curve of every muscle, as large as these differences, may do the work of an effect: it
has then shown nothing but that curves differ.

Shapes: T trials, N samples, M muscles, C columns.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from myowave.diagnosis.misfit.repeated import along_steps
from myowave.identification.disturbance import forcing_by
from myowave.identification.output_error import Fit
from myowave.physics.curves import Curves
from myowave.physics.dynamics import muscle_quantities
from myowave.physics.effect import Effect, Parameter

Array = NDArray[np.float64]

# ASSUME: an arm's curves differ from the nearest of a published family as these families do among themselves (Thelen
# 2003, Millard et al. 2013, De Groote et al. 2016): by .05 to .24 in the active length, .01 to .16 in the velocity and
# .02 to .03 in the passive curve, root mean square and in units of f0, where their shapes are free.
ACTIVE, PASSIVE = 0.1, 0.03  # standard deviation of a bump [f0]
WIDTH = 0.15  # of a bump, in units of l0 or v_max, and the usual distance between two
ACTIVE_AT = np.arange(0.45, 1.75, WIDTH)  # l0
VELOCITY_AT = np.array([-0.7, -0.5, -0.3, -0.15, 0.15, 0.3, 0.5])  # v_max; the force at 0 is f0 for any curve
PASSIVE_AT = np.arange(1.0, 1.5, WIDTH)  # l0
STILL = 0.05  # v_max, within which a velocity is near 0

MORE_FORCE = Effect(
    name="more_force",
    acts_on="muscle",
    equation="F + c",
    function=lambda force, *, c: force + c,
    parameters={"c": Parameter(unit="f0", low=-1.0, high=1.0, typical=0.1, meaning="force", per_muscle=True)},
    source="a unit of force, to tell what any change of a curve does",
)


def bumps(curves: Curves, activation: Tensor, length: Tensor, velocity: Tensor) -> Tensor:
    """Force in units of f0 of one standard deviation of every bump, (..., C); arguments of one shape (...)."""
    lengthening = curves.force_velocity(velocity)
    long = curves.active_length(length)
    moving = torch.tanh(velocity.abs() / STILL)
    parts = [ACTIVE * activation * lengthening * _bump(length, at) for at in ACTIVE_AT]
    parts += [ACTIVE * activation * long * moving * _bump(velocity, at) for at in VELOCITY_AT]
    parts += [PASSIVE * _bump(length, at) for at in PASSIVE_AT]
    return torch.stack(parts, -1)


def _bump(x: Tensor, at: float) -> Tensor:
    return torch.exp(-0.5 * ((x - at) / WIDTH) ** 2)


def pushes_of_curves(fit: Fit) -> Array:
    """What each such bump adds to the state within a step, (T, N - 1, K, C)."""
    # ASSUME: a fibre on a compliant tendon is about as long as on a stiff one.
    q, v, activation = along_steps(fit)
    fibre = muscle_quantities(fit.simulation.along_time, q, v, activation)
    force = bumps(fibre["curves"], activation, fibre["fibre_length"], fibre["fibre_velocity"])
    pushes = forcing_by(fit, MORE_FORCE)[..., None] * force.numpy()[:, :, None]
    return pushes.reshape(*pushes.shape[:3], pushes.shape[3] * pushes.shape[4])
