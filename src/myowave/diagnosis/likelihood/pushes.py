"""What may move an arm beside what its model knows: excitation, torque, a general correction, curves of another shape.

Shapes: T trials, N samples, K numbers of the state, M muscles, C columns, P parameters, W waves.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from myowave.data.trials import Array
from myowave.diagnosis.likelihood.terms import OF_ACTIVATION, OF_MOTION
from myowave.identification.output_error import Fit
from myowave.physics.curves import Curves
from myowave.physics.dynamics import muscle_quantities
from myowave.physics.effect import Effect, Parameter
from myowave.physics.effects.constant_torque import EFFECT as CONSTANT_TORQUE
from myowave.physics.effects.emg_offset import EFFECT as EMG_OFFSET
from myowave.physics.tangent import forcing_of
from myowave.physics.trajectory import recur

REACH = 1e-4  # step of the differences by parameters
LAGS_S = (-0.16, -0.08, 0.08, 0.16, 0.3)  # of excitation, ahead and behind

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
class Pushes:
    """What moves the arm of a fit beside what its model knows."""

    # excitation, torque: what 1 more in each muscle's excitation, and 1 N m, adds to the state within a step, (T, N -
    # 1, K, M) and (T, N - 1, K, 1)
    excitation: Array
    torque: Array
    # how each part of the general correction moves the angle, and `curves`, each bump, (T, N, C) [rad]
    repeating: Array
    curves: Array

    @classmethod
    def of(cls, fit: Fit) -> "Pushes":
        excitation, torque = excitation_forcing(fit), forcing_by(fit, CONSTANT_TORQUE)
        repeating = np.stack([*_by_torque(fit, torque), *_by_excitation(fit, excitation)], -1)
        both = moved_by(fit, np.concatenate([repeating, pushes_of_curves(fit)], -1))
        return cls(excitation, torque, *np.split(both, [repeating.shape[-1]], -1))


def excitation_forcing(fit: Fit) -> Array:
    """What 1 more in each muscle's excitation adds to the state within a step, (T, N - 1, K, M)."""
    return -forcing_by(fit, EMG_OFFSET, -REACH)  # an offset takes away


def forcing_by(fit: Fit, effect: Effect, reach: float = REACH) -> Array:
    """What 1 in each parameter of an effect adds to the state within a step of a fit's motion, (T, N - 1, K, P).

    Args:
        effect: without a state; the model may have it already. One that the model refuses adds nothing, P = 0.
        reach: step of the differences.
    """
    if fit.model.refuses(effect):
        return np.zeros((*fit.linear.after.shape, 0))
    probe = replace(effect, name=f"{effect.name}_more")
    model = fit.model.with_effects([probe])
    simulation = fit.record.simulation(model, fit.simulation.params)
    return forcing_of(simulation, fit.linear, dict.fromkeys(model.parameters_of(probe), 1.0), reach).numpy()


def moved_by(fit: Fit, pushes: Array) -> Array:
    """How changes of the state within each step, (T, N - 1, K, C), move the angle, (T, N, C); 0 where padded."""
    jacobian = fit.linear.jacobian
    start = jacobian.new_zeros(*jacobian.shape[:-3], jacobian.shape[-1], pushes.shape[-1])
    answer: Tensor = recur(jacobian, torch.from_numpy(pushes), start)[..., 0, :]
    return answer.numpy() * fit.record.valid[..., None]


def answers(jacobian: Array, forcing: Array, waves: Array) -> Iterator[Array]:
    """Amplitudes of waves (T, N, W) in the angle's answer to 1 more in each muscle's excitation within one step,
    (T, M, W), for each step from the last to the first, of a Jacobian (T, N - 1, K, K) and forcing (T, N - 1, K, M)."""
    by_state = np.zeros((len(waves), jacobian.shape[-1], waves.shape[-1]))  # of what comes after, by the state now
    for n in reversed(range(jacobian.shape[1])):
        by_state[:, 0] += waves[:, n + 1]
        yield np.swapaxes(forcing[:, n], -1, -2) @ by_state
        by_state = np.swapaxes(jacobian[:, n], -1, -2) @ by_state


def along_steps(fit: Fit) -> tuple[Tensor, Tensor, Tensor]:
    """Angle and velocity of a fit's motion (T, N - 1) and its activations (T, N - 1, M) where each step begins."""
    q, v = fit.sensitive.motion.state[:, :-1, :2].unbind(-1)
    return q, v, fit.simulation.drive.activation[..., 0, :].expand(*q.shape, -1)


def excitation_of(fit: Fit) -> Array:
    """Of each muscle where each step begins, (T, N - 1, M)."""
    state = fit.sensitive.motion.state
    return fit.simulation.drive.excitation[..., 0, :].expand(state.shape[0], state.shape[1] - 1, -1).numpy()


def _by_torque(fit: Fit, forcing: Array) -> Iterator[Array]:
    """Changes of the state within a step by torques of the joint's state and the activations, (T, N - 1, K) each."""
    q, v, activation = along_steps(fit)
    q = q - float(fit.record.angle[fit.record.valid].mean())  # so that what goes with it is no constant
    parts = [term(q, v, v) for term in OF_MOTION.values()]
    parts += [term(q, v, own) for own in activation.unbind(-1) for term in OF_ACTIVATION.values()]
    parts += (activation * activation.cumsum(-2) * fit.record.dt).unbind(-1)  # what gets tired
    parts.append(fit.sensitive.motion.state[..., 1].diff() / fit.record.dt)  # inertia
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


def bumps(curves: Curves, activation: Tensor, length: Tensor, velocity: Tensor) -> Tensor:
    """Force in units of f0 of one standard deviation of every bump, (..., C); arguments of one shape (...).

    The published families differ from one another by more than their shapes in the settings make up for, and so will
    any arm. Small smooth bumps on every curve of every muscle, as large as these differences, may do the work of an
    effect: it has then shown nothing but that curves differ.
    """
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
