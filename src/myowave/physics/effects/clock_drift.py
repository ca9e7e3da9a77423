"""The clocks of EMG and motion do not run alike."""

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter
from myowave.physics.effects.clock_shift import angle_at


def drifting_angle(q: Tensor, qdot: Tensor, dt: float, begin: Tensor, *, d: Tensor) -> Tensor:
    """Measured angle q(t (1 - d)) [rad] from samples (..., N) every `dt` seconds; d > 0 where the motion is recorded
    later and later. The clocks agree where a trial begins, and these samples do so `begin` seconds (..., 1) later."""
    sample = torch.arange(q.shape[-1], dtype=q.dtype, device=q.device)
    return angle_at(sample - d * (sample + begin / dt), q, qdot, dt)


EFFECT = Effect(
    name="clock_drift",
    title="a time drift between EMG and motion",
    acts_on="observation",
    equation="q(t (1 - d))",
    function=drifting_angle,
    parameters={
        "d": Parameter("s/s", low=-0.05, high=0.05, typical=0.003, meaning="delay of the motion that each second adds")
    },
    source="two recorders with clocks of their own, each from the beginning of a trial",
)
