"""Motion by fixed steps of one sample, each with the EMG at its sample: what a pointwise residual assumes.

    I (q_(n+1) - 2 q_n + q_(n-1)) / dt^2 = torque at sample n, with the velocity (q_(n+1) - q_(n-1)) / (2 dt)

Along such a motion the residual of Taneja et al. 2023, Eq. 38, with central differences is 0, which it is not along the
motion of `physics.motion.simulate`, the exact one for EMG that is linear between samples.
"""

from dataclasses import replace

import torch

from myowave.data.trials import Trials
from myowave.physics.dynamics import acceleration
from myowave.physics.model import Model
from myowave.physics.simulation import Simulation, channels_of

NUDGE = 1e-6  # of the velocity [rad/s], for its slope
TOLERANCE = 1e-12  # rad/s
MOST_STEPS = 50


def sampled(model: Model, trials: Trials) -> Trials:
    """Trials with the same EMG and first angle, from rest, whose motion obeys the sampled equation of a model without
    effects.

    Raises:
        ValueError: where a step has no solution.
    """
    assert not model.effects
    dt = trials.dt
    emg = channels_of(model, trials.channels, torch.from_numpy(trials.emg))
    simulation = Simulation(model, {}, emg, dt)
    sample = torch.arange(emg.shape[-2], dtype=emg.dtype)
    _, activation = simulation.activate(sample[:, None, None])
    at = activation.squeeze(-2).unbind(-2)
    valued, q = simulation.valued, torch.from_numpy(trials.angle)[..., 0]
    pull = acceleration(valued, q, torch.zeros_like(q), at[0], {})
    angles = [q, q + dt**2 / 2 * pull]
    for a in at[1:-1]:
        before, now = angles[-2:]
        back = (now - before) / dt
        velocity = back + dt / 2 * pull
        for _ in range(MOST_STEPS):  # Newton on velocity = back + dt / 2 qddot(velocity)
            pull, bumped = acceleration(valued, now, torch.stack([velocity, velocity + NUDGE]), a, {}).unbind()
            gap = back + dt / 2 * pull - velocity
            velocity = velocity + gap / (1 - dt / 2 * (bumped - pull) / NUDGE)
            if not bool((gap.abs() > TOLERANCE).any()):
                break
        else:
            raise ValueError(f"{trials.dataset}: no velocity solves a step of {dt:g} s; use a smaller dt_s.")
        angles.append(before + 2 * dt * velocity)
    return replace(trials, dataset=f"{trials.dataset}_sampled", angle=torch.stack(angles, -1).numpy())
