"""Dimensionless muscle curves: force-length, passive force, force-velocity. All act element-wise.

Lengths are in units of the optimal fibre length l0, velocities in units of v_max and positive when lengthening,
forces in units of the maximum isometric force f0. Literals are floats: torch would convert integers at every call.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from myowave.physics.degroote import active_length_degroote, force_velocity_degroote, passive_degroote
from myowave.physics.millard import active_length_millard, force_velocity_millard, passive_millard
from myowave.physics.thelen import (
    ECCENTRIC_FORCE,
    SHAPE_AF,
    SLOWING,
    active_length_thelen,
    force_velocity_thelen,
    passive_thelen,
)

Curve = Callable[[Tensor], Tensor]

# Eq. 50: passive curve of an adult.
PASSIVE_GAMMA1 = 0.075
PASSIVE_GAMMA2 = 6.6
NO_FORCE = 1e-30  # keeps the derivative of a power finite
PASSIVE_SLOPE = PASSIVE_GAMMA2 * math.exp(0.4 * PASSIVE_GAMMA2)


def active_length_taneja(length: Tensor) -> Tensor:
    """Active force-length curve of three parabolas, peak 1 at length 1; continuous, its slope jumps at 0.6 and 1.4.

    Source: Taneja et al. 2023, Eq. 49.
    """
    # ASSUME: no active force outside [0.4, 1.6]; as printed, Eq. 49 rises again there.
    distance = (length - 1.0).abs()
    outer = (0.6 - distance).clamp(min=0.0)
    return torch.where(distance <= 0.4, 1.0 - 4.0 * distance * distance, 9.0 * outer * outer)


def passive_taneja(length: Tensor) -> Tensor:
    """Passive force-length curve: zero up to length 1, exponential to 1.4, then straight, C1 at 1.4.

    Source: Taneja et al. 2023, Eq. 50.
    """
    toe = torch.special.expm1(PASSIVE_GAMMA2 * (length.clamp(1.0, 1.4) - 1.0))
    return PASSIVE_GAMMA1 * (toe + PASSIVE_SLOPE * (length - 1.4).clamp(min=0.0))


def force_velocity_hill(velocity: Tensor) -> Tensor:
    """Normalised Hill hyperbola: 0 at -1, 1 at 0, towards 1.4 when lengthening; C1 at 0.

    Shortening (1 + v) / (1 - v / Af) and lengthening (1 + v F s) / (1 + v s) both are 1 + k v / (1 + b v), with the
    same slope k = 1 + 1 / Af and another b on each side.

    Source: Hill 1938 with the constants of Thelen 2003, whose own curve is twice as steep when lengthening and whose
    v_max depends on the activation (`thelen`). The paper cites the curve [67] without a formula.
    """
    slope = 1 + 1 / SHAPE_AF
    velocity = velocity.clamp(min=-1.0)
    bend = torch.where(velocity > 0, slope / (ECCENTRIC_FORCE - 1), -1 / SHAPE_AF)
    return 1.0 + slope * velocity / (1.0 + bend * velocity)


@dataclass(frozen=True)
class Shape:
    """How curves differ from the published ones: the constants of `constants.CURVE_CONSTANTS`, 0 for not at all.

    Each is broadcastable to the quantities of the muscles.
    """

    ascending: Tensor
    descending: Tensor
    rising: Tensor
    falling: Tensor
    sagging: Tensor
    concentric: Tensor
    yielding: Tensor
    eccentric: Tensor
    passive: Tensor
    onset: Tensor


@dataclass(frozen=True)
class Curves:
    """The three curves that make a Hill-type muscle.

    Args:
        shape: how they differ from the published ones; None for not at all.
        slowing: share of v_max that a muscle without activation lacks [-].
    """

    active_length: Curve = active_length_taneja
    passive: Curve = passive_taneja
    force_velocity: Curve = force_velocity_hill
    shape: Shape | None = None
    slowing: float = 0.0

    def active(self, activation: Tensor, length: Tensor, velocity: Tensor) -> Tensor:
        """Active force of a fibre in units of f0: a f_AL(l) f_V(v). Source: Taneja et al. 2023, Eq. 46."""
        if self.slowing:
            velocity = velocity / (1.0 - self.slowing * (1.0 - activation))
        return activation * self.active_length(length) * self.force_velocity(velocity)

    def shaped(self, shape: Shape) -> "Curves":
        """These curves in another shape. All of it is smooth, keeps force 1 at length 1 and velocity 0, and no force
        when shortening at v_max."""

        # Combined once: these are small, and each of the many operations below costs about the same.
        ascending, descending = 1.0 / (1.0 + shape.ascending), 1.0 / (1.0 + shape.descending)
        rising, falling, sagging = torch.exp(shape.rising), torch.exp(shape.falling), torch.exp(shape.sagging)
        stiffer, concentric, steeper = torch.exp(shape.passive), torch.exp(shape.concentric), torch.exp(shape.yielding)
        straighter, eccentric = 1.0 - concentric, 1.0 + shape.eccentric
        bending = (steeper - 1.0) / (ECCENTRIC_FORCE - 1.0)

        def active_length(length: Tensor) -> Tensor:
            off = length - 1.0
            short = off < 0
            force = self.active_length(1.0 + off * torch.where(short, ascending, descending))
            return _raised(force, torch.where(short, rising, falling))

        def passive(length: Tensor) -> Tensor:
            return stiffer * self.passive(length - shape.onset)

        def force_velocity(velocity: Tensor) -> Tensor:
            # Shortening: of Hill's hyperbola with constant Af this changes 1 + 1 / Af by the factor exp(concentric).
            force = self.force_velocity(velocity)
            slow = force.clamp(max=1.0)
            shortening = _raised(slow / (concentric + slow * straighter), sagging)
            # Lengthening: a hyperbola in the force gained, steeper where it begins, the same at the largest force, and
            # beyond that in families that have no largest.
            gained = (force - 1.0).clamp(min=0.0)
            usual = gained.clamp(max=ECCENTRIC_FORCE - 1.0)
            bent = usual * steeper / (1.0 + usual * bending) + (gained - usual)
            return torch.where(velocity > 0, 1.0 + eccentric * bent, shortening)

        return Curves(active_length, passive, force_velocity, shape, self.slowing)

    def in_shape(self, family: "Curves") -> "Curves":
        """Curves of another family, as published, in the shape that these have."""
        return family if self.shape is None else family.shaped(self.shape)


def _raised(force: Tensor, power: Tensor) -> Tensor:
    """A force between 0 and 1 to a power, which keeps both ends, 0 as far as anybody could tell."""
    return force.clamp(min=NO_FORCE) ** power


MILLARD = Curves(active_length_millard, passive_millard, force_velocity_millard)
DEGROOTE = Curves(active_length_degroote, passive_degroote, force_velocity_degroote)
THELEN = Curves(active_length_thelen, passive_thelen, force_velocity_thelen, slowing=SLOWING)

# What `physics.curves` in config.yaml may name, curve by curve.
ACTIVE_LENGTH: dict[str, Curve] = {
    "taneja": active_length_taneja,
    "millard": active_length_millard,
    "degroote": active_length_degroote,
    "thelen": active_length_thelen,
}
PASSIVE: dict[str, Curve] = {
    "taneja": passive_taneja,
    "millard": passive_millard,
    "degroote": passive_degroote,
    "thelen": passive_thelen,
}
FORCE_VELOCITY: dict[str, Curve] = {
    "hill": force_velocity_hill,
    "millard": force_velocity_millard,
    "degroote": force_velocity_degroote,
    "thelen": force_velocity_thelen,
}
