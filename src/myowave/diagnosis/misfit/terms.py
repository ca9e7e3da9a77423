"""What a model may lack in general: terms of the joint's motion and of the activations, and effects made of them.

Shapes: M muscles; every quantity has samples, and whatever else, on its leading axes.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import torch
from torch import Tensor

from myowave.physics.effect import Effect, Parameter

FAST = 0.1  # rad/s at which friction has reached its size
LARGEST = 50.0  # N m in units of the term

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
}


def torque_terms(muscles: Sequence[str]) -> dict[str, OfJoint]:
    """Terms that a missing torque may consist of, by how they are written.

    Args:
        muscles: their names, in the order of the activations.
    """
    of_muscles = {
        f"a_{muscle}{name}": partial(_of_one, term, place)
        for place, muscle in enumerate(muscles)
        for name, term in OF_ACTIVATION.items()
    }
    return {**OF_MOTION, **of_muscles}


def _of_one(term: OfJoint, place: int, q: Tensor, v: Tensor, a: Tensor) -> Tensor:
    return term(q, v, a[..., place])


def torque_effect(name: str, text: str, term: OfJoint) -> Effect:
    """An effect on the joint that is one such term, with a coefficient c [N m]."""

    def torque(q: Tensor, qdot: Tensor, activation: Tensor, *, c: Tensor) -> Tensor:
        return c * term(q, qdot, activation)

    parameter = Parameter(unit="N m", low=-LARGEST, high=LARGEST, typical=0.5, meaning="coefficient")
    return Effect(
        name=name,
        acts_on="joint",
        equation=f"c {text}",
        function=torque,
        parameters={"c": parameter},
        source="a term of what a model may lack in general",
    )


def shared_excitation(name: str, of: int, to: int) -> Effect:
    """An effect that adds to one muscle's excitation a share x of another's.

    Args:
        of, to: their places among the muscles.
    """

    def more(excitation: Tensor, side: Tensor, *, x: Tensor) -> Tensor:
        one = torch.zeros_like(side)
        one[..., to] = 1.0
        return excitation + x * one * excitation[..., of : of + 1]

    parameter = Parameter(unit="-", low=-1.0, high=1.0, typical=0.1, meaning="share")
    return Effect(
        name=name,
        acts_on="excitation",
        equation="u_i + x u_j",
        function=more,
        parameters={"x": parameter},
        source="a term of what a model may lack in general",
    )
