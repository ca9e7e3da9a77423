"""The clocks of EMG and motion are apart."""

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter


def shifted_angle(q: Tensor, qdot: Tensor, dt: float, *, d: Tensor) -> Tensor:
    """Measured angle q(t - d) [rad] from samples (..., N) every `dt` seconds; d > 0 where that is late."""
    return angle_at(torch.arange(q.shape[-1], dtype=q.dtype, device=q.device) - d / dt, q, qdot, dt)


def angle_at(position: Tensor, q: Tensor, qdot: Tensor, dt: float) -> Tensor:
    """The angle (..., N) at positions in samples (..., N): cubic between samples, from angle and velocity; straight
    before the first sample and after the last."""
    samples = q.shape[-1]
    cell = position.detach().floor().clamp(0, max(samples - 2, 0))
    q, qdot, position, cell = torch.broadcast_tensors(q, qdot, position, cell)
    left, right = cell.long(), (cell.long() + 1).clamp(max=samples - 1)
    q0, q1 = torch.take_along_dim(q, left, -1), torch.take_along_dim(q, right, -1)
    v0, v1 = (dt * torch.take_along_dim(qdot, index, -1) for index in (left, right))
    beyond = position - cell
    s = beyond.clamp(0.0, 1.0)
    inside = q0 + s * (v0 + s * (3.0 * (q1 - q0) - 2.0 * v0 - v1 + s * (v0 + v1 - 2.0 * (q1 - q0))))
    return inside + (beyond - s) * torch.where(beyond < 0, v0, v1)


EFFECT = Effect(
    name="clock_shift",
    title="a time shift between EMG and motion",
    acts_on="observation",
    equation="q(t - d)",
    function=shifted_angle,
    parameters={
        "d": Parameter("s", low=-0.2, high=0.2, typical=0.02, meaning="how much later motion is recorded than EMG")
    },
    source="two recorders started by hand or by different triggers",
)
