"""Muscle curves of a shape of their own: what an arm may have that no family of curves holds.

The published families differ from one another by more than their shapes in the settings make up for, and so will any
arm. Small smooth bumps on every curve of every muscle, as large as these differences, may do the work of an effect: it
has then shown nothing but that curves differ.

Shapes: T trials, N samples, M muscles, C columns.
"""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from myowave.diagnosis.misfit.repeated import along_steps, moved_by
from myowave.identification.disturbance import forcing_by
from myowave.identification.least_squares import Normal, gain_of, gather
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


@dataclass(frozen=True)
class CurvesOut:
    """A fit with bumps on the curves, expected at 0, integrated out.

    Args:
        drop: how much the objective falls by them [rad^2].
        occam: what they cost: minus twice the logarithm of how much the data narrow them (Laplace).
        normal: the normal equations with them among the parameters, and what they leave of the residual.
    """

    drop: float
    occam: float
    normal: Normal


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


def own_curves(fit: Fit) -> Array:
    """What one standard deviation of each bump on a curve of each muscle does to what counts of the angle, the starts
    of the trials fitted, (T, N, C)."""
    return moved_by(fit, pushes_of_curves(fit))


def pushes_of_curves(fit: Fit) -> Array:
    """What each such bump adds to the state within a step, (T, N - 1, K, C)."""
    # ASSUME: a fibre on a compliant tendon is about as long as on a stiff one.
    q, v, activation = along_steps(fit)
    fibre = muscle_quantities(fit.simulation.valued, q, v, activation)
    force = bumps(fibre["curves"], activation, fibre["fibre_length"], fibre["fibre_velocity"])
    pushes = forcing_by(fit, MORE_FORCE)[..., None] * force.numpy()[:, :, None]
    return pushes.reshape(*pushes.shape[:3], pushes.shape[3] * pushes.shape[4])


def integrate_out_curves(fit: Fit, variance: float) -> CurvesOut:
    """A fit with the shapes of the muscles' curves as nuisance parameters, integrated out to first order.

    Args:
        variance: of an independent sample of the residual [rad^2].
    """
    normal, columns = fit.normal, own_curves(fit)
    (signal, imitation), left = normal.beyond(columns), normal.left
    information = signal.T @ signal
    gain = gain_of(information, signal.T @ left, prior=variance)
    size = gain.estimate
    residual = normal.residual - (signal @ size)[: normal.residual.size].reshape(normal.residual.shape)
    slope = np.concatenate([normal.slope, columns], -1)
    weight, off = np.r_[normal.weight, np.full(len(size), variance)], np.r_[normal.off + imitation @ size, -size]
    occam = float(np.linalg.slogdet(np.eye(len(size)) + information / variance)[1])
    return CurvesOut(gain.fall, occam, gather(residual, slope, normal.by_start, weight, off))
