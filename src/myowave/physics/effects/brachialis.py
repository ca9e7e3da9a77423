"""A third flexor: the brachialis, driven with the flexor whose EMG is recorded."""

import math

import torch
from torch import Tensor

from myowave.physics.curves import Curves
from myowave.physics.effect import Effect, Parameter
from myowave.physics.muscle import FLEXOR
from myowave.physics.path import StraightPath

# ASSUME: the brachialis has the mean activation of the model's flexors.
# ASSUME: seen from the flexors (mean), it starts 0.4 times as far from the joint and ends 0.7 times as far; its fibres
# are 0.75 times as long and as fast, and optimal at 60 degrees (BRA against BIClong in Holzbaur 2005).
ORIGIN, INSERTION, FIBRE, BEST_ANGLE = 0.4, 0.7, 0.75, math.pi / 3


def brachialis_torque(
    q: Tensor,
    qdot: Tensor,
    activation: Tensor,
    side: Tensor,
    curves: Curves,
    l0: Tensor,
    vmax: Tensor,
    l1: Tensor,
    l2: Tensor,
    *,
    f0: Tensor,
) -> Tensor:
    """Active torque [N m] of a muscle of strength f0 [N] beside the flexors; its passive force is left out."""
    flexors = (side > 0).to(q.dtype)
    share = flexors / flexors.sum().clamp(min=1.0)
    a, l0, vmax, l1, l2 = ((share * x).sum(-1) for x in (activation, l0, vmax, l1, l2))
    l0, vmax, l1, l2 = FIBRE * l0, FIBRE * vmax, ORIGIN * l1, INSERTION * l2
    path = StraightPath(l1, l2, FLEXOR)
    length, arm = path.length_and_arm(q)
    best, _ = path.length_and_arm(torch.full_like(q, BEST_ANGLE))
    fibre_length = 1.0 + (length - best) / l0.clamp(min=1e-6)
    fibre_velocity = -arm * qdot / vmax.clamp(min=1e-6)
    return f0 * curves.active(a, fibre_length, fibre_velocity) * arm


EFFECT = Effect(
    name="brachialis",
    title="a third flexor",
    acts_on="joint",
    equation="f0 a_flexor f_AL f_V R, a path of its own",
    function=brachialis_torque,
    parameters={"f0": Parameter("N", high=1500.0, typical=60.0, meaning="strength of the brachialis")},
    source="Holzbaur, Murray & Delp 2005, Ann. Biomed. Eng. 33 (geometry relative to the biceps)",
)
