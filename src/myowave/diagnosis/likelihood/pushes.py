"""What may move an arm beside what its model knows: excitation, torque, a general correction, other curves and paths.

Shapes: T trials, N samples, K numbers of the state, M muscles, C columns.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np

from myowave.data.trials import Array
from myowave.diagnosis.likelihood.forcing import MORE_EXCITATION, along_steps, excitation_of, forcing_by, moved_by
from myowave.diagnosis.likelihood.shapes import pushes_of_curves, pushes_of_paths
from myowave.diagnosis.likelihood.terms import OF_ACTIVATION, OF_EFFECTS, OF_MOTION
from myowave.identification.output_error import Fit
from myowave.physics.effects.constant_torque import EFFECT as CONSTANT_TORQUE

LAGS_S = (-0.16, -0.08, 0.08, 0.16, 0.3)  # of excitation, ahead and behind


@dataclass(frozen=True)
class Pushes:
    """What moves the arm of a fit beside what its model knows."""

    # excitation, torque: what 1 more in each muscle's excitation, and 1 N m, adds to the state within a step, (T, N -
    # 1, K, M) and (T, N - 1, K, 1)
    excitation: Array
    torque: Array
    # how each part of the general correction moves the angle, and each bump of `curves` and of `paths`, (T, N, C) [rad]
    repeating: Array
    curves: Array
    paths: Array

    @classmethod
    def of(cls, fit: Fit, catalogue: Collection[str] = ()) -> "Pushes":
        """Of a fit; `catalogue` has the names of effects that a model may have, which the general correction lacks."""
        excitation, torque = forcing_by(fit, MORE_EXCITATION), forcing_by(fit, CONSTANT_TORQUE)
        repeating = np.stack([*_by_torque(fit, torque, catalogue), *_by_excitation(fit, excitation)], -1)
        parts = [repeating, pushes_of_curves(fit), pushes_of_paths(fit)]
        moved = moved_by(fit, np.concatenate(parts, -1))
        return cls(excitation, torque, *np.split(moved, np.cumsum([part.shape[-1] for part in parts[:-1]]), -1))


def _by_torque(fit: Fit, forcing: Array, catalogue: Collection[str]) -> Iterator[Array]:
    """Changes of the state within a step by torques of the joint's state and the activations, (T, N - 1, K) each."""
    q, v, activation = along_steps(fit)
    q = q - float(fit.record.angle[fit.record.valid].mean())  # so that what goes with it is no constant
    parts = [term(q, v, v) for name, term in OF_MOTION.items() if OF_EFFECTS.get(name) not in catalogue]
    parts += [term(q, v, own) for own in activation.unbind(-1) for term in OF_ACTIVATION.values()]
    parts += (activation * activation.cumsum(-2) * fit.record.dt).unbind(-1)  # what gets tired
    if "forearm_inertia" not in catalogue:
        parts.append(fit.sensitive.motion.state[..., 1].diff() / fit.record.dt)
    for part in parts:
        yield forcing[..., 0] * part.numpy()[..., None]


def _by_excitation(fit: Fit, forcing: Array) -> Iterator[Array]:
    """The same by excitations that are late, early, off, bent, or those of other muscles."""
    excitation = excitation_of(fit)
    samples = np.arange(excitation.shape[1])
    for muscle in range(excitation.shape[-1]):
        own = excitation[..., muscle]
        shifts = [(samples - round(lag / fit.record.dt)).clip(0, len(samples) - 1) for lag in LAGS_S]
        others = [excitation[..., m] for m in range(excitation.shape[-1]) if m != muscle]
        for signal in (*(own[:, s] - own for s in shifts), np.ones_like(own), own**2, *others):
            yield forcing[..., muscle] * signal[..., None]
