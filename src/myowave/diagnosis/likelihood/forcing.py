"""What a push within a step does to the state at its end, and to the angle from then on.

Shapes: T trials, N samples, K numbers of the state, M muscles, C columns, P parameters, W waves.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from myowave.data.trials import Array
from myowave.identification.output_error import Fit
from myowave.physics.effect import Effect
from myowave.physics.effects.emg_offset import EFFECT as EMG_OFFSET
from myowave.physics.tangent import forcing_of
from myowave.physics.trajectory import recur

REACH = 1e-4  # step of the differences by parameters


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
