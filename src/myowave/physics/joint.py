"""The forearm as a rigid body on a hinge: inertia and gravity (Eqs. 54-56)."""

import torch
from torch import Tensor

STANDARD_GRAVITY = 9.80665  # m/s^2


def inertia(*, mass: Tensor, length: Tensor, load: Tensor) -> Tensor:
    """Moment of inertia about the elbow [kg m^2], I = (m + load) l^2.

    Source: Taneja et al. 2023, Eq. 55.
    """
    # ASSUME: the mass of the forearm is a point at the wrist, and so is what the hand holds.
    return (mass + load) * length**2


def weight(*, mass: Tensor, length: Tensor, load: Tensor) -> Tensor:
    """Moment of the weight about the elbow with the forearm level [N m], (m + load) g l."""
    return (mass + load) * (STANDARD_GRAVITY * length)


def gravity_torque(q: Tensor, weight: Tensor, tilt: Tensor | None = None) -> Tensor:
    """Torque of gravity about the elbow [N m], E(q) = -(m + load) g l sin(q + tilt); negative where it extends the arm.

    Args:
        q: elbow angle [rad], any shape; at 0 the arm is straight, positive in flexion.
        weight: moment of the weight with the forearm level [N m], see `weight`.
        tilt: lean of the upper arm [rad], forward positive; None where it hangs vertically.

    Source: Taneja et al. 2023, Eq. 56, with the forearm's angle to the vertical q + tilt.
    """
    return -weight * torch.sin(q if tilt is None else q + tilt)
