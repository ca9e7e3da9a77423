"""The forearm as a rigid body on a hinge: inertia and gravity (Eqs. 54-56)."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

STANDARD_GRAVITY = 9.80665  # m/s^2


@dataclass(frozen=True)
class Forearm:
    """A forearm on its hinge. It holds tensors that broadcast."""

    # ASSUME: what the hand holds is a point at the grip.
    mass: Tensor  # without what the hand holds [kg]
    com: Tensor  # distance of its centre of mass from the elbow [m]
    inertia: Tensor  # its moment of inertia about the elbow [kg m^2]
    grip: Tensor  # distance of what the hand holds from the elbow [m]

    def inertia_with(self, load: Tensor | float) -> Tensor:
        """Moment of inertia about the elbow with a load in the hand [kg m^2]."""
        return self.inertia + load * self.grip**2

    def weight_with(self, load: Tensor | float) -> Tensor:
        """Moment of the weight about the elbow with a load in the hand and the forearm level [N m]."""
        return STANDARD_GRAVITY * (self.mass * self.com + load * self.grip)


def kind_of_forearm(constants: Collection[str]) -> str:
    """`point` or `body`: the kind of forearm that the names of a joint's constants describe."""
    return "point" if "length" in constants else "body"


def forearm(constants: Mapping[str, Tensor]) -> Forearm:
    """The forearm that the constants of a joint describe; a point mass is Eqs. 55-56 of Taneja et al. 2023."""
    c = constants
    if kind_of_forearm(c) == "body":
        return Forearm(c["mass"], c["com"], c["inertia"], c["grip"])
    # ASSUME: the mass of the forearm is a point at the wrist, and so is what the hand holds.
    return Forearm(c["mass"], c["length"], c["mass"] * c["length"] ** 2, c["length"])


def gravity_torque(q: Tensor, weight: Tensor, tilt: Tensor) -> Tensor:
    """Torque of gravity about the elbow [N m], E(q) = -weight sin(q + tilt); negative where it extends the arm.

    Args:
        q: elbow angle [rad], any shape; at 0 the arm is straight, positive in flexion.
        weight: moment of the weight with the forearm level [N m], see `Forearm.weight_with`.
        tilt: tilt of the upper arm [rad], forward positive.

    Source: Taneja et al. 2023, Eq. 56, with the forearm's angle to the vertical q + tilt.
    """
    return -weight * torch.sin(q + tilt)
