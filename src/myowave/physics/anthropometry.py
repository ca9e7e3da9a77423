"""Forearm with hand of an adult from body mass, height and sex, and how far a person may be from that.

Nothing heavy is imported here: the table of subjects is read with it at every start.

Source of the means: de Leva 1996, J. Biomech. 29, 1223-1230, Table 4: young adults, 15 women and 100 men in a gamma-ray
scanner (Zatsiorsky, Seluyanov 1990), adjusted to the centres of the joints. He prints no standard deviations; those
here have two parts, taken as independent:

- Between tables. Of the mass of forearm and hand de Leva has 2.23 %, Winter 2009 (Biomechanics and Motor Control of
  Human Movement, after Dempster 1955) 2.2 % and Plagenhoef et al. 1983 (Res. Q. Exerc. Sport 54) 2.52 % of a man's
  body; their centres of mass are 0.675, 0.682 and 0.661 forearms from the elbow, and the radii of gyration about the
  elbow of the first two 0.800 and 0.827.
- Between people of one height. In the first 29 men listed in ANSUR II (Gordon et al. 2014, NATICK/TR-15/007) forearm
  (radiale to stylion) over stature scatters by 3.8 % of its mean, elbow to grip over stature by 3.4 %.

Women are taken to scatter as men do. How mass scatters between people of one body mass is in none of these: the
standard deviation of the mass is at least what is given.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

SEXES = {"f": "woman", "m": "man"}
LIGHTEST, HEAVIEST = 30.0, 250.0
"""Bounds of a body mass [kg]; what is outside is likely in another unit."""
SHORTEST, TALLEST = 1.2, 2.3
"""Bounds of a height [m]."""

_BETWEEN_TABLES = {"mass": 0.076, "com": 0.016, "gyration": 0.024}
_BETWEEN_PEOPLE = {"forearm": 0.038, "grip": 0.034}
_PALM_M = 0.01  # where in the palm the middle of what it holds is


@dataclass(frozen=True)
class Segment:
    """A segment of the body."""

    mass: float  # fraction of the body's [-]
    length: float  # between its end points, of a person of mean height [m]
    com: float  # distance of its centre of mass from the end next to the trunk, fraction of `length` [-]
    gyration: float  # radius of gyration about its centre of mass and the axis of flexion, fraction of `length` [-]


@dataclass(frozen=True)
class Lower:
    """Forearm (elbow to wrist) and hand (wrist to knuckle of the middle finger) of people of a mean `height` [m]."""

    forearm: Segment
    hand: Segment
    height: float


# ASSUME: the forearm is supinated, as in a curl, so flexion is about the transverse axis of both segments.
DE_LEVA: Mapping[str, Lower] = {
    "f": Lower(Segment(0.0138, 0.2643, 0.4559, 0.257), Segment(0.0056, 0.0780, 0.7474, 0.454), 1.735),
    "m": Lower(Segment(0.0162, 0.2689, 0.4574, 0.265), Segment(0.0061, 0.0862, 0.7900, 0.513), 1.741),
}


@dataclass(frozen=True)
class Estimate:
    """A value with its standard deviation, in SI units, and where both are from."""

    value: float
    sd: float
    source: str


def forearm_with_hand(mass: float, height: float, sex: str) -> dict[str, Estimate]:
    """Forearm and hand as one rigid body.

    Args:
        mass: of the whole body [kg].
        height: of the body [m].
        sex: one of `SEXES`: whose table is taken.

    Returns:
        `mass` [kg], `com` [m], `inertia` about the elbow [kg m^2] and `grip` [m], named as the joint's constants.

    Raises:
        ValueError: for a sex without a table, or a mass or height that no adult has.
    """
    _check(mass, height, sex)
    table = DE_LEVA[sex]
    forearm, hand = table.forearm, table.hand
    # ASSUME: both segments grow in proportion to height (Winter 2009 does the same with 0.146 of it for the forearm).
    scale = height / table.height
    wrist = scale * forearm.length
    # ASSUME: hand and fingers are one body with the forearm, and the middle of what they hold is at the hand's centre
    # of mass, give or take 1 cm.
    grip = wrist + scale * hand.com * hand.length
    masses = (mass * forearm.mass, mass * hand.mass)
    arms = (forearm.com * wrist, grip)
    radii = (forearm.gyration * wrist, hand.gyration * scale * hand.length)
    total = sum(masses)
    com = sum(m * arm for m, arm in zip(masses, arms, strict=True)) / total
    inertia = sum(m * (arm**2 + radius**2) for m, arm, radius in zip(masses, arms, radii, strict=True))
    of_mass, of_com, of_gyration = (_BETWEEN_TABLES[key] for key in ("mass", "com", "gyration"))
    of_length = _BETWEEN_PEOPLE["forearm"]
    both = "sd: published tables, and forearms of one height"
    return {
        "mass": Estimate(total, of_mass * total, "de Leva 1996; sd: between published tables, so at least this"),
        "com": Estimate(com, math.hypot(of_com, of_length) * com, f"de Leva 1996; {both}"),
        "inertia": Estimate(
            inertia,
            math.hypot(of_mass, 2 * of_gyration, 2 * of_length) * inertia,
            f"about the elbow, de Leva 1996; {both}",
        ),
        "grip": Estimate(
            grip,
            math.hypot(_BETWEEN_PEOPLE["grip"] * grip, _PALM_M),
            "the hand's centre of mass, de Leva 1996; sd: ANSUR II, and 1 cm in the palm",
        ),
    }


def _check(mass: float, height: float, sex: str) -> None:
    if sex not in SEXES:
        known = ", ".join(f"{key} ({word})" for key, word in SEXES.items())
        raise ValueError(f"sex is {sex!r}; expected one of {known}: whose table of body segments is taken.")
    if not LIGHTEST <= mass <= HEAVIEST:
        raise ValueError(f"body mass is {mass:g}; expected {LIGHTEST:g} to {HEAVIEST:g} kg. Give it in kg.")
    if not SHORTEST <= height <= TALLEST:
        raise ValueError(f"height is {height:g}; expected {SHORTEST:g} to {TALLEST:g} m. Give it in m, such as 1.75.")
