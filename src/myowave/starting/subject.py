"""Settings of a person's forearm, as text to put into a file of settings."""

import re
from collections.abc import Iterator

from myowave.physics.anthropometry import SEXES, forearm_with_hand
from myowave.physics.constants import JOINT_CONSTANTS
from myowave.settings.section import NAME, NOT_A_NAME

PRESET = "arm26"  # the arm whose muscles and curves a person is given


def subject_settings(mass: float, height: float, sex: str, name: str) -> str:
    """A block `physics.arms.NAME` with the forearm and hand of a person, each value with its standard deviation, by the
    mass of the body [kg], its height [m] and its sex (f or m: whose table of body segments is taken). A ValueError
    where there is no table for them, or for a name that settings do not take."""
    check_name(name, "the arm")
    who = f"a {SEXES.get(sex, 'person')} of {mass:g} kg and {height:g} m"
    lines = [
        f"# Forearm with hand of {who}, as one rigid body.",
        "# sd: standard deviation, how far a person may be from the value; no setting reads it. Measure what you can.",
        "physics:",
        "  arms:",
        f"    {name}:",
        f"      preset: {PRESET} # muscles and curves",
        *(f"      {line}" for line in joint_lines(mass, height, sex)),
    ]
    return "\n".join(lines) + "\n"


def joint_lines(mass: float, height: float, sex: str) -> Iterator[str]:
    """The `joint` block of an arm's, a key each."""
    yield "joint:"
    for constant, e in forearm_with_hand(mass, height, sex).items():
        yield f"  {JOINT_CONSTANTS[constant].key}: {e.value:#.4g} # sd {e.sd:.2g}; {e.source}"


def check_name(name: str, whose: str) -> None:
    """Raise a ValueError where a name is none that settings take."""
    if not re.fullmatch(NAME, name):
        raise ValueError(f"{name!r} cannot be the name of {whose}: {NOT_A_NAME}.")
