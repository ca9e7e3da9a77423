"""How likely the torque of two groups of trials is under a change in the second, all that they share integrated out.

The muscles of each electrode give their activation times a smooth function of angle and velocity, unknown and the same
in all trials: moment arms, forces and gains are in it, so no error of a muscle model counts that both groups share. On
top come noise, EMG that differs from trial to trial, and what the recording does not say of the posture.

Sources: Rasmussen & Williams 2006, Gaussian Processes for Machine Learning, Sec. 2.7 (common functions integrated
out); Kennedy & O'Hagan 2001, J. R. Stat. Soc. B 63 (a discrepancy that repeats).

Shapes: T trials, L windows, C electrodes.
"""

import math
from collections.abc import Mapping

import numpy as np
import torch
from torch import Tensor

from myowave.data.trials import Array
from myowave.diagnosis.changed.windows import Windowed
from myowave.diagnosis.likelihood.algebra import Component, Residual, Weighed, log_evidence, most_likely

# ASSUME: what moves the shoulder or the sensor disturbs the torque for about this long [s].
MEMORY_S = 0.5
# ASSUME: torque of a relaxed elbow: constant [N m], with the angle [N m/rad], with velocity [N m s/rad] (Hayes & Hatze
# 1977; Lin et al. 2005, in the middle of the range).
RELAXED = (0.3, 0.3, 0.2)
LEAN_RAD = float(np.radians(2.0))  # ASSUME: the lean of the upper arm is known so well in a trial
LEAN_GAIN = 0.4  # ASSUME: a sensor of it reads between half and all of it; skin moves less than the bone
# Smallest, where a search starts, largest: torque of one activation from trial to trial, relative to the usual one (5
# to 30 %: Viitasalo & Komi 1975; Veiersted 1991, cited from memory), and what is left of the EMG's noise in a window.
# ASSUME: the former is as if the share of muscles with other moment arms changed.
TRIAL_GAIN, EMG_NOISE = (0.01, 0.05, 0.3), (0.01, 0.1, 1.0)
STRENGTH = 0.5  # ASSUME: standard deviation of the strength of an electrode's muscles, relative to that fitted to all
SHAPE = (0.01, 0.2, 5.0)  # the same of smooth functions beside the usual curves and paths: bounds that no fit reaches
TINY = 1e-6  # squared activation of a silent channel


def residual_of(windowed: Windowed) -> Residual:
    """The torque of the windows less that of the usual muscles, with all that may have made it."""
    motion, padded, strength = windowed.motion, windowed.motion.padded, windowed.strength
    size = float(np.sqrt((windowed.torque**2).mean()))
    given = strength * windowed.usual
    share = np.sqrt((given**2).mean(-1) / (windowed.activation**2).mean(-1).clip(TINY))
    active = share[:, None] * windowed.activation
    muscles = np.concatenate([a[:, None] * motion.smooth for a in active], -1)
    valid = padded(np.ones(len(windowed.torque)))
    each, by_tilt = padded(active.T), padded(windowed.by_tilt[:, None])
    alike = _matern(padded(motion.time)) * valid[:, None] * valid[..., None]
    # ASSUME: what is not explained of a trial's torque grows with it (noise of force does so: Jones, Hamilton &
    # Wolpert 2002, cited from memory).
    noise = (0.003 * size, 0.1 * size, size)
    loaded = torch.from_numpy(windowed.sizes / size)[:, None, None] ** 2
    components = (
        Component("noise", loaded * torch.diag_embed(valid), None, None, *noise),
        Component("lasting noise", loaded * alike, None, None, *noise),
        Component("lean", LEAN_RAD**2 * by_tilt @ by_tilt.mT),
        Component("posture", columns=padded(_posture(windowed))),
        Component("drive", columns=padded(strength * windowed.by_errors.T)),
        Component("strength", columns=padded(STRENGTH * given.T)),
        Component("muscles", None, padded(muscles), None, *SHAPE),
        Component("gain of a trial", each @ each.mT, None, None, *TRIAL_GAIN),
        Component("noise of the EMG", each @ each.mT * alike, None, None, *EMG_NOISE),
    )
    return Residual(padded(windowed.left_by(strength)), valid > 0, components)


def likeliest(windowed: Windowed, start: Mapping[str, float]) -> Weighed:
    """The likeliest sizes of what made the torque, searched from others, and the log evidence of the measured
    motion [nats]."""
    found = most_likely(residual_of(windowed), (), start)
    return Weighed(found.sizes, found.value + float(windowed.density.sum()))


def evidence(windowed: Windowed, sizes: Mapping[str, float]) -> float:
    """The log evidence with given sizes [nats]."""
    return log_evidence(residual_of(windowed), sizes) + float(windowed.density.sum())


def _matern(time: Tensor) -> Tensor:
    """Correlation of what is slow, of order 3/2, at times (T, L), (T, L, L)."""
    apart = math.sqrt(3) * (time[:, :, None] - time[:, None]).abs() / MEMORY_S
    return (1 + apart) * torch.exp(-apart)


def _posture(windowed: Windowed) -> Array:
    """What is not known of the posture, in standard deviations: the relaxed joint, gain of the lean's sensor."""
    (constant, stiff, damped), (q, qdot, read) = RELAXED, windowed.motion.mean
    columns = [np.full(len(q), constant), stiff * (q - 1), damped * qdot]
    return np.stack([*columns, LEAN_GAIN * windowed.by_tilt * read], -1)
