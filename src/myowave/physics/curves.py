"""Dimensionless muscle curves: force-length, passive force, force-velocity. All act element-wise.

Lengths are in units of the optimal fibre length l0, velocities in units of v_max and positive when lengthening,
forces in units of the maximum isometric force f0. Literals are floats: torch would convert integers at every call.

Sources: Taneja et al. 2023, Eqs. 49-50 (the paper's own); Hill 1938; Thelen 2003, J. Biomech. Eng. 125, 70, Eqs. 3-7
and Table 1, young adults; De Groote, Kinney, Rao & Fregly 2016, Ann. Biomed. Eng. 44, 2922, with the digits of OpenSim,
which make the curves 1 at length 1 and f_V exactly 0 at -1 and 1 at 0; Millard et al. 2013 in `millard`.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import torch
from torch import Tensor

from myowave.physics.millard import ECCENTRIC_FORCE, millard_curve

Curve = Callable[[Tensor], Tensor]

SHAPE_AF = 0.25  # of Hill's hyperbola; his constant a over f0
THELEN_STEEPER = 2.0  # slope where lengthening begins, over that where shortening begins
THELEN_WIDTH = 0.45  # of the bell, gamma
THELEN_SLOWING = 0.75  # share of v_max that a muscle without activation lacks
# Three bells (height, centre, width, growth of the width with length).
DEGROOTE_BELLS = (
    (0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465),
    (0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188),
    (0.1, 1.0, 0.353553390593274, 0.0),
)
DEGROOTE_VELOCITY = (-0.3211346127989808, -8.149, -0.374, 0.8825327733249912)
NO_FORCE = 1e-30  # keeps the derivative of a power finite
LONG = 1.3  # length at which a passive force that rises more steeply is the same


def active_length_taneja(length: Tensor) -> Tensor:
    """Active force-length curve of three parabolas, peak 1 at length 1; continuous, its slope jumps at 0.6 and 1.4."""
    # ASSUME: no active force outside [0.4, 1.6]; as printed, Eq. 49 rises again there.
    distance = (length - 1.0).abs()
    outer = (0.6 - distance).clamp(min=0.0)
    return torch.where(distance <= 0.4, 1.0 - 4.0 * distance * distance, 9.0 * outer * outer)


def active_length_thelen(length: Tensor) -> Tensor:
    """Active force-length curve, a bell."""
    return torch.exp(-((length - 1.0) ** 2) / THELEN_WIDTH)


def active_length_degroote(length: Tensor) -> Tensor:
    """Active force-length curve, a sum of three bells."""
    # ASSUME: below length 0.2 the curve keeps its value there, about 0; a bell's width is 0 at 0.15.
    length = length.clamp(min=0.2)
    bells = (h * torch.exp(-0.5 * ((length - c) / (w + g * length)) ** 2) for h, c, w, g in DEGROOTE_BELLS)
    return sum(bells, start=torch.zeros_like(length))


def exponential_passive(length: Tensor, *, height: float, rate: float, reach: float) -> Tensor:
    """Passive force-length curve: height (exp(rate strain) - 1) up to the strain `reach`, then straight, C1 there."""
    # ASSUME: no passive force below length 1, where the formulas are slightly negative.
    toe = torch.special.expm1(rate * (length.clamp(1.0, 1.0 + reach) - 1.0))
    beyond = rate * math.exp(rate * reach) * (length - (1.0 + reach)).clamp(min=0.0)
    return height * (toe + beyond)


def force_velocity_hyperbolas(velocity: Tensor, *, steeper: float) -> Tensor:
    """Hill's hyperbola, 0 at -1, 1 at 0, and another one towards 1.4 when lengthening.

    Shortening (1 + v) / (1 - v / Af) and lengthening (1 + v F s) / (1 + v s) both are 1 + k v / (1 + b v).

    Args:
        steeper: slope where lengthening begins over that where shortening begins, 1 + 1 / Af.
    """
    # ASSUME: no force when shortening faster than v_max.
    velocity = velocity.clamp(min=-1.0)
    slope = 1.0 + 1.0 / SHAPE_AF
    lengthening = velocity > 0
    steep = slope if steeper == 1.0 else torch.where(lengthening, steeper * slope, slope)
    bend = torch.where(lengthening, steeper * slope / (ECCENTRIC_FORCE - 1.0), -1.0 / SHAPE_AF)
    return 1.0 + steep * velocity / (1.0 + bend * velocity)


def force_velocity_degroote(velocity: Tensor) -> Tensor:
    """Force-velocity curve, lengthening positive."""
    # ASSUME: no force when shortening faster than v_max, where the formula is negative.
    d1, d2, d3, d4 = DEGROOTE_VELOCITY
    return (d1 * torch.asinh(d2 * velocity + d3) + d4).clamp(min=0.0)


# Eq. 50, of an adult; of the others the force is 1 at their `reach`.
passive_taneja = partial(exponential_passive, height=0.075, rate=6.6, reach=0.4)
passive_thelen = partial(exponential_passive, height=1.0 / math.expm1(5.0), rate=5.0 / 0.6, reach=0.6)
passive_degroote = partial(exponential_passive, height=1.0 / math.expm1(4.0), rate=4.0 / 0.6, reach=0.6)
# The paper cites its curve [67] without a formula: C1 at 0, with the constants of Thelen, whose own is twice as steep.
force_velocity_hill = partial(force_velocity_hyperbolas, steeper=1.0)
force_velocity_thelen = partial(force_velocity_hyperbolas, steeper=THELEN_STEEPER)


@dataclass(frozen=True)
class Curves:
    """The three curves that make a Hill-type muscle."""

    active_length: Curve = active_length_taneja
    passive: Curve = passive_taneja
    force_velocity: Curve = force_velocity_hill
    # how they differ from the published ones, see `shaped`; None for not at all
    shape: Mapping[str, Tensor] | None = field(default=None, hash=False)
    slowing: float = 0.0  # share of v_max that a muscle without activation lacks [-]

    def active(self, activation: Tensor, length: Tensor, velocity: Tensor) -> Tensor:
        """Active force of a fibre in units of f0: a f_AL(l) f_V(v). Source: Taneja et al. 2023, Eq. 46."""
        if self.slowing:
            velocity = velocity / (1.0 - self.slowing * (1.0 - activation))
        return activation * self.active_length(length) * self.force_velocity(velocity)

    def force(self, activation: Tensor, length: Tensor, velocity: Tensor) -> Tensor:
        """Force of a fibre in units of f0: its active force + f_P(l). Source: Taneja et al. 2023, Eqs. 45-46."""
        return self.active(activation, length, velocity) + self.passive(length)

    def shaped(self, shape: Mapping[str, Tensor]) -> "Curves":
        """These curves in another shape. All of it is smooth, keeps force 1 at length 1 and velocity 0, and no force
        when shortening at v_max.

        Args:
            shape: the constants of `constants.CURVE_CONSTANTS`, each broadcastable to the quantities of the muscles.
        """
        # Combined once: these are small, and each of the many operations below costs about the same.
        ascending, descending = 1.0 / (1.0 + shape["ascending"]), 1.0 / (1.0 + shape["descending"])
        logarithms = ("rising", "falling", "sagging", "passive", "stiffening", "concentric", "yielding")
        rising, falling, sagging, stiffer, stretch, concentric, steeper = (torch.exp(shape[n]) for n in logarithms)
        straighter, eccentric = 1.0 - concentric, 1.0 + shape["eccentric"]
        steeper = steeper / eccentric  # what the largest force is does not change the slope where lengthening begins
        bending = (steeper - 1.0) / (ECCENTRIC_FORCE - 1.0)
        stiffer = stiffer * (self.passive(torch.full_like(stretch, LONG)) / self.passive(1.0 + (LONG - 1.0) * stretch))

        def active_length(length: Tensor) -> Tensor:
            off = length - 1.0
            short = off < 0
            force = self.active_length(1.0 + off * torch.where(short, ascending, descending))
            return _raised(force, torch.where(short, rising, falling))

        def passive(length: Tensor) -> Tensor:
            return stiffer * self.passive(1.0 + stretch * (length - 1.0 - shape["onset"]))

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
    return torch.exp(power * force.clamp(min=NO_FORCE).log())  # several times as fast as `**`


TANEJA = Curves()
THELEN = Curves(active_length_thelen, passive_thelen, force_velocity_thelen, slowing=THELEN_SLOWING)
DEGROOTE = Curves(active_length_degroote, passive_degroote, force_velocity_degroote)
MILLARD = Curves(
    partial(millard_curve, "active_length"), partial(millard_curve, "passive"), partial(millard_curve, "force_velocity")
)

# What `physics.curves` in config.yaml may name, curve by curve.
FAMILIES = {"taneja": TANEJA, "hill": TANEJA, "millard": MILLARD, "degroote": DEGROOTE, "thelen": THELEN}
