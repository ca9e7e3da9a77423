"""What a push within a step does to the state at its end, and to the angle from then on.

Shapes: T trials, N samples, K numbers of the state, M muscles, C columns, P parameters, W waves.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from myowave.data.processing.filters import before_low_pass
from myowave.data.trials import Array
from myowave.identification.output_error import Fit
from myowave.physics.effect import Effect, Parameter
from myowave.physics.motion import late_activation, observe, unpack
from myowave.physics.simulation import Instant
from myowave.physics.tangent import derivatives_observed, forcing_of
from myowave.physics.trajectory import recur

REACH = 1e-4  # step of the differences by parameters


def more_of(name: str, acts_on: str, function: Callable[..., Any], unit: str) -> Effect:
    """One more of something in each muscle, to tell what any change of it does."""
    parameters = {"c": Parameter(unit, low=-1.0, high=1.0, typical=0.1, meaning=name, each="muscle")}
    return Effect(name, acts_on, "", function, parameters, "a unit")


MORE_EXCITATION = more_of("excitation", "excitation", lambda excitation, *, c: excitation + c, "-")


def forcing_by(fit: Fit, effect: Effect) -> Array:
    """What 1 in each parameter of an effect adds to the state within a step of a fit's motion, (T, N - 1, K, P).

    Args:
        effect: without a state; the model may have it already. One that the model refuses adds nothing, P = 0.
    """
    if fit.model.refuses(effect):
        return np.zeros((*fit.linear.after.shape, 0))
    probe = replace(effect, name=f"{effect.name}_more")
    model = fit.model.with_effects([probe])
    simulation = fit.record.simulation(model, fit.simulation.params)
    return forcing_of(simulation, fit.linear, dict.fromkeys(model.parameters_of(probe), 1.0), REACH).numpy()


def moved_by(fit: Fit, pushes: Array, start: Tensor | None = None) -> Array:
    """How changes of the state within each step, (T, N - 1, K, C), move the observed angle, (T, N, C); 0 where
    padded.

    Args:
        start: what changes at the first sample, (T, K, C); None for nothing.
    """
    jacobian = fit.linear.jacobian
    if start is None:
        start = jacobian.new_zeros(*jacobian.shape[:-3], jacobian.shape[-1], pushes.shape[-1])
    moved = recur(jacobian, torch.from_numpy(pushes), start)
    answer = derivatives_observed(fit.simulation, fit.linear, {}, moved).movedim(0, -1)
    return answer.numpy() * fit.record.valid[..., None]


def through_sensor(fit: Fit, waves: Tensor) -> Array:
    """Signals (T, N, 2, W) that the joint's angle and velocity are to be multiplied by, of those for the observed
    angle, (T, N, W)."""
    q, v = (x.detach().requires_grad_() for x in fit.sensitive.motion.state[..., :2].unbind(-1))
    observed = observe(fit.simulation, q, v) + 0.0 * v
    by_state = torch.autograd.grad(observed, (q, v), waves.movedim(-1, 0).contiguous(), is_grads_batched=True)
    return torch.stack(by_state, -1).movedim(0, -1).numpy()


def answers(jacobian: Array, forcing: Array, waves: Array) -> Array:
    """Amplitudes of waves in the angle's answer to 1 more in each muscle's excitation within each step,
    (N - 1, T, M, W).

    Args:
        jacobian: of each step, (T, N - 1, K, K), and `forcing` (T, N - 1, K, M).
        waves: that angle and velocity are to be multiplied by, (T, N, 2, W).
    """
    trials, steps, size, muscles = forcing.shape
    found = np.empty((steps, trials, muscles, waves.shape[-1]))
    by_state = np.zeros((trials, size, waves.shape[-1]))  # of what comes after, by the state now
    for n in reversed(range(steps)):
        by_state[:, :2] += waves[:, n + 1]
        found[n] = np.swapaxes(forcing[:, n], -1, -2) @ by_state
        by_state = np.swapaxes(jacobian[:, n], -1, -2) @ by_state
    return found


def by_samples(fit: Fit, by_steps: Tensor) -> Tensor:
    """Of what 1 more in each muscle's excitation within each step does (N - 1, T, M, W), what 1 more in each sample of
    each electrode's noise does, (samples, T, C, W), before any low-pass that the EMG has passed.

    In the EMG a sample lasts from the one before to the one after, the first as long as muscles are late, and drives
    all muscles of the electrode.
    """
    (steps, trials, muscles, waves), model = by_steps.shape, fit.model
    samples = fit.record.emg.shape[-2]
    delay = torch.atleast_2d(fit.simulation.valued.muscle["delay"]).expand(trials, muscles) / fit.record.dt
    found = by_steps.new_zeros(samples, trials, len(model.channels), waves)
    for trial, muscle in np.ndindex(trials, muscles):
        begin = fit.record.lead - float(delay[trial, muscle])
        first = math.floor(begin)
        late = begin - first
        electrode = found[:, trial, model.electrodes[muscle]]
        # The mean over the step of EMG that is linear between samples.
        for place, share in enumerate(((1 - late) ** 2 / 2, 0.5 + late * (1 - late), late**2 / 2)):
            index = (torch.arange(steps) + (first + place)).clamp(0, samples - 1)
            electrode.index_add_(0, index, by_steps[:, trial, muscle], alpha=share)
    if (corner := fit.record.emg_low_pass_hz) is None:
        return found
    return torch.from_numpy(before_low_pass(found.numpy(), 1 / fit.record.dt, corner))


def along_steps(fit: Fit) -> tuple[Tensor, Tensor, Tensor]:
    """Angle and velocity of a fit's motion (T, N - 1) and its activations, behind any lag, (T, N - 1, M) where each
    step begins."""
    simulation, drive = fit.simulation, fit.simulation.drive
    q, v, states = unpack(fit.model, fit.sensitive.motion.state[:, :-1])
    begin = Instant(simulation.along_time, drive.excitation[..., 0, :], drive.activation[..., 0, :])
    activation, _ = late_activation(begin, lambda acting, _: states[acting.effect.name])
    return q, v, activation.expand(*q.shape, -1)


def excitation_of(fit: Fit) -> Array:
    """Of each muscle where each step begins, (T, N - 1, M)."""
    state = fit.sensitive.motion.state
    return fit.simulation.drive.excitation[..., 0, :].expand(state.shape[0], state.shape[1] - 1, -1).numpy()
