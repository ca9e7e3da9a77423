"""The forearm as a rigid body on a hinge: inertia and gravity (Eqs. 54-56).

A forearm holds tensors that broadcast.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor

from myowave.physics.constants import JOINT_CONSTANTS, names_of

STANDARD_GRAVITY = 9.80665  # m/s^2


@dataclass(frozen=True)
class PointMass:
    """All mass at one distance from the elbow.

    Source: Taneja et al. 2023, Eqs. 55-56: I = (m + load) l^2, and (m + load) g l.
    """

    # ASSUME: the mass of the forearm is a point at the wrist, and so is what the hand holds.
    mass: Tensor
    length: Tensor
    kind: ClassVar[str] = "point"

    def inertia_with(self, load: Tensor | float) -> Tensor:
        """Moment of inertia about the elbow with a load in the hand [kg m^2]."""
        return (self.mass + load) * self.length**2

    def weight_with(self, load: Tensor | float) -> Tensor:
        """Moment of the weight about the elbow with a load in the hand and the forearm level [N m]."""
        return (self.mass + load) * (STANDARD_GRAVITY * self.length)


@dataclass(frozen=True)
class RigidBody:
    """Mass, distance of its centre `com`, moment of inertia about the elbow, distance of the hand's `grip` [SI].

    A point mass is com = grip = length, inertia = mass length^2.
    """

    # ASSUME: what the hand holds is a point at the grip.
    mass: Tensor
    com: Tensor
    inertia: Tensor
    grip: Tensor
    kind: ClassVar[str] = "body"

    def inertia_with(self, load: Tensor | float) -> Tensor:
        """As of a point mass."""
        return self.inertia + load * self.grip**2

    def weight_with(self, load: Tensor | float) -> Tensor:
        """As of a point mass."""
        return STANDARD_GRAVITY * (self.mass * self.com + load * self.grip)


Forearm = PointMass | RigidBody
_OF_ANY = {name for name, constant in JOINT_CONSTANTS.items() if constant.default is not None}


def kind_of_forearm(constants: Collection[str]) -> type[Forearm]:
    """The kind of forearm that the names of a joint's constants describe.

    Raises:
        ValueError: if they are those of no kind.
    """
    for kind in (PointMass, RigidBody):
        if set(constants) - _OF_ANY == _own_constants(kind):
            return kind
    raise ValueError(f"joint: found {', '.join(constants)}; expected mass and either length or com, inertia and grip.")


def forearm(constants: Mapping[str, Tensor]) -> Forearm:
    """The forearm that the constants of a joint describe; see `kind_of_forearm`."""
    kind = kind_of_forearm(constants)
    return kind(**{name: constants[name] for name in _own_constants(kind)})


def _own_constants(kind: type[Forearm]) -> set[str]:
    return {"mass", *names_of(JOINT_CONSTANTS, kind.kind)}


def gravity_torque(q: Tensor, weight: Tensor, tilt: Tensor | None = None) -> Tensor:
    """Torque of gravity about the elbow [N m], E(q) = -weight sin(q + tilt); negative where it extends the arm.

    Args:
        q: elbow angle [rad], any shape; at 0 the arm is straight, positive in flexion.
        weight: moment of the weight with the forearm level [N m], see `PointMass.weight_with`.
        tilt: lean of the upper arm [rad], forward positive; None where it hangs vertically.

    Source: Taneja et al. 2023, Eq. 56, with the forearm's angle to the vertical q + tilt.
    """
    return -weight * torch.sin(q if tilt is None else q + tilt)
