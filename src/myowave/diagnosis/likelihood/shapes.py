"""Muscle curves and paths of another shape than any family has: small smooth bumps, that may do the work of an effect.

Shapes: T trials, N samples, K numbers of the state, M muscles, C columns.
"""

import math

import numpy as np
import torch
from torch import Tensor

from myowave.data.trials import Array
from myowave.diagnosis.likelihood.forcing import along_steps, forcing_by, more_of
from myowave.identification.output_error import Fit
from myowave.physics.curves import Curves
from myowave.physics.dynamics import muscle_quantities

# ASSUME: an arm's curves differ from the nearest of a published family as these families do among themselves (Thelen
# 2003, Millard et al. 2013, De Groote et al. 2016): by .05 to .24 in the active length, .01 to .16 in the velocity and
# .02 to .03 in the passive curve, root mean square and in units of f0, where their shapes are free.
ACTIVE, PASSIVE = 0.1, 0.03  # standard deviation of a bump [f0]
# ASSUME: in units of f0, l0 and v_max the muscles of an arm have one set of curves (Zajac 1989, Crit. Rev. Biomed. Eng.
# 17), which differs from a family as a whole, and a muscle from the others by about a third of that.
OWN = 0.3
# ASSUME: a muscle without activation shortens at most more slowly, or faster, than one with all of it by this log:
# half of that in Thelen 2003; the other families have none.
SLOWING = 0.7
WIDTH = 0.15  # of a bump, in units of l0 or v_max, and the usual distance between two
ACTIVE_AT = np.arange(0.45, 1.75, WIDTH)  # l0
VELOCITY_AT = np.array([-0.7, -0.5, -0.3, -0.15, 0.15, 0.3, 0.5])  # v_max; the force at 0 is f0 for any curve
PASSIVE_AT = np.arange(1.0, 1.5, WIDTH)  # l0
STILL = 0.05  # v_max, within which a velocity is near 0

# ASSUME: over the angle a moment arm differs from the model's by as much as peak moment arms do between people (Murray
# et al. 2002, ten cadavers), half of which goes into the constants of the path.
PATH = 0.05  # standard deviation of a bump, in units of the muscle's root mean square moment arm
ARM_WIDTH = 0.35  # of a bump, and the distance between two [rad]
ARM_AT = np.arange(0.0, 2.6, ARM_WIDTH)  # rad


MORE_FORCE = more_of("force", "muscle", lambda force, *, c: force + c, "f0")
MORE_LENGTH = more_of("length", "path", lambda length_mt, moment_arm, *, c: (length_mt + c, moment_arm), "m")
MORE_ARM = more_of("moment_arm", "path", lambda length_mt, moment_arm, *, c: (length_mt, moment_arm + c), "m")


def curve_bumps(curves: Curves, activation: Tensor, length: Tensor, velocity: Tensor) -> Tensor:
    """Force in units of f0 of one standard deviation of every bump, (..., C); arguments of one shape (...).

    The published families differ from one another by more than their shapes in the settings make up for, and so will
    any arm. Small smooth bumps on every curve, as large as these differences, may do the work of an effect: it has then
    shown nothing but that curves differ. The last column is a force-velocity curve that hangs on the activation.
    """
    lengthening = curves.force_velocity(velocity)
    long = curves.active_length(length)
    moving = torch.tanh(velocity.abs() / STILL)
    parts = [ACTIVE * activation * lengthening * _bump(length, at) for at in ACTIVE_AT]
    parts += [ACTIVE * activation * long * moving * _bump(velocity, at) for at in VELOCITY_AT]
    parts += [PASSIVE * _bump(length, at) for at in PASSIVE_AT]
    slower = curves.force_velocity(velocity * torch.exp(SLOWING * (1.0 - activation)))
    parts.append(activation * long * (slower - lengthening))
    return torch.stack(parts, -1)


def _bump(x: Tensor, at: float) -> Tensor:
    return torch.exp(-0.5 * ((x - at) / WIDTH) ** 2)


def pushes_of_curves(fit: Fit) -> Array:
    """What each such bump, on all muscles at once and then on each, adds to the state in a step, (T, N - 1, K, C)."""
    # ASSUME: a fibre on a compliant tendon is about as long as on a stiff one.
    q, v, activation = along_steps(fit)
    fibre = muscle_quantities(fit.simulation.along_time, q, v, activation)
    force = curve_bumps(fibre["curves"], activation, fibre["fibre_length"], fibre["fibre_velocity"])
    each = forcing_by(fit, MORE_FORCE)[..., None] * force.numpy()[:, :, None]
    return np.concatenate([each.sum(-2), OWN * _joined(each)], -1)


def path_bumps(q: Tensor) -> tuple[Tensor, Tensor]:
    """One standard deviation of every bump of a moment arm at angles q (...), and the length that goes with it as
    virtual work asks, R = -d length / dq, both (..., C) in units of the usual moment arm."""
    off = (q[..., None] - torch.from_numpy(ARM_AT)) / ARM_WIDTH
    arm = PATH * torch.exp(-0.5 * off**2)
    return arm, -PATH * ARM_WIDTH * math.sqrt(math.pi / 2) * torch.erf(off / math.sqrt(2))


def pushes_of_paths(fit: Fit) -> Array:
    """What each bump of each muscle's path adds to the state within a step, (T, N - 1, K, C)."""
    q, v, activation = along_steps(fit)
    arm = muscle_quantities(fit.simulation.along_time, q, v, activation)["moment_arm"].numpy()
    usual = np.sqrt((arm**2).mean((0, 1)))[:, None]
    of_arm, of_length = (usual * bumps.numpy()[:, :, None, None] for bumps in path_bumps(q))
    by_arm, by_length = (forcing_by(fit, effect)[..., None] for effect in (MORE_ARM, MORE_LENGTH))
    return _joined(by_arm * of_arm + by_length * of_length)


def _joined(pushes: Array) -> Array:
    """Columns of every muscle (..., M, C) in one row."""
    return pushes.reshape(*pushes.shape[:-2], -1)
