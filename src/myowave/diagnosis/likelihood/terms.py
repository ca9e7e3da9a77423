"""What a model may lack in general: terms of the joint's motion and of the activations, and effects made of them.

Shapes: M muscles; every quantity has samples, and whatever else, on its leading axes.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter
from myowave.physics.effects import angle_offset, angle_scale, clock_shift

FAST = 0.1  # rad/s at which friction has reached its size
LARGEST = 50.0  # N m in units of the term
SOURCE = "a term of what a model may lack in general"

# Of angle, velocity and activations (..., M), by how they are written.
OfJoint = Callable[[Tensor, Tensor, Tensor], Tensor]
OF_MOTION: Mapping[str, OfJoint] = {
    "1": lambda q, v, a: torch.ones_like(q),
    "q": lambda q, v, a: q,
    "q^2": lambda q, v, a: q * q,
    "sin(2 q)": lambda q, v, a: torch.sin(2 * q),
    "qdot": lambda q, v, a: v,
    "qdot |qdot|": lambda q, v, a: v * v.abs(),
    "the sign of qdot": lambda q, v, a: torch.tanh(v / FAST),
    "q qdot": lambda q, v, a: q * v,
}
# The same of the activation of one muscle, by what follows its name.
OF_ACTIVATION: Mapping[str, OfJoint] = {
    "": lambda q, v, a: a,
    "^2": lambda q, v, a: a * a,
    " q": lambda q, v, a: a * q,
    " q^2": lambda q, v, a: a * q * q,
    " qdot": lambda q, v, a: a * v,
    " qdot |qdot|": lambda q, v, a: a * v * v.abs(),
    " the sign of qdot": lambda q, v, a: a * torch.tanh(v / FAST),
}


def torque_terms(muscles: Sequence[str], middle: float) -> dict[str, OfJoint]:
    """Terms that a missing torque may consist of, by how they are written.

    Args:
        muscles: their names, in the order of the activations.
        middle: of the motion [rad], from where the terms count the angle, so that what goes with it is no constant.
    """
    terms: dict[str, OfJoint] = {name: partial(_of_motion, term, middle) for name, term in OF_MOTION.items()}
    for place, muscle in enumerate(muscles):
        own = {f"a_{muscle}{name}": partial(_of_one, term, middle, place) for name, term in OF_ACTIVATION.items()}
        terms.update(own)
    return terms


def _of_motion(term: OfJoint, middle: float, q: Tensor, v: Tensor, a: Tensor) -> Tensor:
    return term(q - middle, v, a)


def _of_one(term: OfJoint, middle: float, place: int, q: Tensor, v: Tensor, a: Tensor) -> Tensor:
    return term(q - middle, v, a[..., place])


def torque_effect(name: str, text: str, term: OfJoint) -> Effect:
    """An effect on the joint that is one such term, with a coefficient c [N m]."""

    def torque(q: Tensor, qdot: Tensor, activation: Tensor, *, c: Tensor) -> Tensor:
        return c * term(q, qdot, activation)

    parameter = Parameter("N m", low=-LARGEST, high=LARGEST, typical=0.5, meaning="coefficient")
    return Effect(name, "joint", f"c {text}", torque, {"c": parameter}, source=SOURCE)


# What a sensor may add to the angle, of angle and velocity, by how it is written, and effects that do.
OF_SENSOR: Mapping[str, tuple[Callable[[Tensor, Tensor], Tensor], Effect]] = {
    "off": (lambda q, v: torch.ones_like(q), replace(angle_offset.EFFECT, name="sensor_off")),
    "off by a share of itself": (lambda q, v: q, replace(angle_scale.EFFECT, name="sensor_scaled")),
    "late": (lambda q, v: -v, replace(clock_shift.EFFECT, name="sensor_late")),
}
