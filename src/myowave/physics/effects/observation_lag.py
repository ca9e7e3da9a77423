"""A sensor that follows the angle with a lag: a damped goniometer, a causal filter, a slow amplifier."""

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter

SHORTEST = 1e-12  # s; a lag of 0 is then no lag, not a division by 0


def lagging_angle(q: Tensor, qdot: Tensor, dt: float, *, tau: Tensor) -> Tensor:
    """Measured angle y [rad] of tau dy/dt = q - y, from samples (..., N) every `dt` seconds.

    Exact for an angle that is straight between samples; before the first it was straight, too.
    """
    tau = tau.clamp(min=SHORTEST)
    kept = torch.exp(-dt / tau)
    new = 1.0 - tau / dt * (1.0 - kept)  # share of the sample itself, and of the one before
    before = 1.0 - kept - new
    first = q[..., :1] - tau * qdot[..., :1]
    lagging = torch.cat([first, new * q[..., 1:] + before * q[..., :-1]], -1)
    shift = 1
    while shift < lagging.shape[-1]:  # y[n] = kept y[n - 1] + x[n], in steps that double
        late = torch.nn.functional.pad(lagging[..., :-shift], (shift, 0))
        lagging = lagging + kept**shift * late
        shift *= 2
    return lagging


EFFECT = Effect(
    name="observation_lag",
    title="an angle sensor that lags",
    acts_on="observation",
    equation="tau dy/dt = q - y",
    function=lagging_angle,
    parameters={"tau": Parameter("s", high=0.3, typical=0.05, meaning="time constant of the angle sensor's lag")},
    source="first-order lag of a sensor or of its filter",
)
