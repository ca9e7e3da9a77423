"""Dry friction that is larger near rest than in motion (Stribeck effect)."""

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter
from myowave.physics.effects.coulomb_friction import grown

# ASSUME: of what rest adds a share of 1/e is left at about this angular velocity [rad/s], of 0.1 (slower than friction
# usually grows from rest it cannot be) to 2.5.
USUAL = 0.5


def stribeck_torque(qdot: Tensor, *, tau: Tensor, s: Tensor) -> Tensor:
    """Torque [N m] against the motion, -tau exp(-(qdot / v)^2) tanh(qdot / 0.03), v = 0.5 exp(s)."""
    share = torch.exp(-((qdot / USUAL) ** 2) * torch.exp(-2.0 * s))
    return -tau * share * grown(qdot)


EFFECT = Effect(
    name="stribeck_friction",
    title="dry friction that is largest near rest",
    acts_on="joint",
    equation="-tau exp(-(qdot / v)^2) tanh(qdot / 0.03 rad/s), v = 0.5 rad/s exp(s)",
    function=stribeck_torque,
    parameters={
        "tau": Parameter("N m", high=5.0, typical=0.5, meaning="what friction near rest has beyond that in motion"),
        "s": Parameter("-", low=-1.6, high=1.6, typical=1.0, meaning="logarithm of v over 0.5 rad/s", alone=False),
    },
    source="Armstrong-Helouvry, Dupont & Canudas de Wit 1994, Automatica 30; of servos Duclusaud et al. 2024, "
    "arXiv 2410.08650, with other exponents",
)
