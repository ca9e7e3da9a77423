"""Motion by fixed steps of one sample, each with the EMG at its sample: what a pointwise residual assumes.

    I (q_(n+1) - 2 q_n + q_(n-1)) / dt^2 = torque at sample n, with the velocity (q_(n+1) - q_(n-1)) / (2 dt)

Along such a motion the residual of Taneja et al. 2023, Eq. 38, with central differences is 0, which it is not along the
motion of `motion.simulate`, the exact one for EMG that is linear between samples.

Shapes: ... batch, T trials, N samples.
"""

import torch
from torch import Tensor

from myowave.physics.dynamics import acceleration
from myowave.physics.motion import batch_shape, observe
from myowave.physics.simulation import Simulation

NUDGE = 1e-6  # of the velocity [rad/s], for its slope
TOLERANCE = 1e-12  # rad/s
MOST_STEPS = 50


def simulate_sample_and_hold(simulation: Simulation, q0: Tensor | float) -> Tensor:
    """Angle (..., T, N) [rad] from rest at `q0` [rad], broadcastable to (..., T), as a sensor sees it.

    Raises:
        ValueError: for a model with an effect that has a state of its own, or where a step has no solution.
    """
    model, emg, dt = simulation.model, simulation.emg, simulation.dt
    if model.stateful:
        raise ValueError(
            f"solver: sample_and_hold cannot take {', '.join(effect.name for effect in model.stateful)}, which has a "
            "state of its own; use solver: exact."
        )
    assert simulation.sway is None, "only simulated arms move so, and they lean the same all the time"
    start = torch.as_tensor(q0, dtype=emg.dtype, device=emg.device)
    q = start.expand(batch_shape(simulation, start, start))
    sample = torch.arange(emg.shape[-2], dtype=emg.dtype, device=emg.device)
    _, activation = simulation.activate(sample[:, None, None])
    at = activation.squeeze(-2).unbind(-2)
    valued = simulation.valued
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
            raise ValueError(f"solver: sample_and_hold finds no velocity after a step of {dt:g} s; use a smaller dt_s.")
        angles.append(before + 2 * dt * velocity)
    motion = torch.stack(angles, -1)
    return observe(simulation.along_time, motion, torch.gradient(motion, dim=-1)[0] / dt, dt)
