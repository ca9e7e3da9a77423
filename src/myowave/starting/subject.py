"""Settings of a person's forearm, as text to put into a file of settings."""

import re
from dataclasses import dataclass

from myowave.physics.anthropometry import SEXES, forearm_with_hand
from myowave.physics.constants import JOINT_CONSTANTS

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_NOTE = "sd: standard deviation, how far a person may be from the value; no setting reads it. Measure what you can."


@dataclass(frozen=True)
class Body:
    """A person: mass [kg], height [m], and f or m, whose table of body segments is taken."""

    mass: float
    height: float
    sex: str


def subject_settings(body: Body, name: str = "me") -> str:
    """A block `physics.arms.NAME` with the forearm and hand of a person, each value with its standard deviation.

    Raises:
        ValueError: for a mass, height or sex that there is no table for, or a name that settings do not take.
    """
    check_name(name, "the arm")
    who = f"a {SEXES.get(body.sex, 'person')} of {body.mass:g} kg and {body.height:g} m"
    lines = [
        f"# Forearm with hand of {who}, as one rigid body.",
        f"# {_NOTE}",
        "physics:",
        "  arms:",
        f"    {name}:",
        "      preset: arm26 # muscles and curves",
        *joint_lines(body),
    ]
    return "\n".join(lines) + "\n"


def joint_lines(body: Body) -> list[str]:
    """The `joint` block of an arm's, a key each."""
    estimates = forearm_with_hand(body.mass, body.height, body.sex)
    return [
        "      joint:",
        *(
            f"        {JOINT_CONSTANTS[constant].key}: {e.value:#.4g} # sd {e.sd:.2g}; {e.source}"
            for constant, e in estimates.items()
        ),
    ]


def check_name(name: str, whose: str) -> None:
    """Raise a ValueError where a name is none that settings take."""
    if not _NAME.fullmatch(name):
        raise ValueError(f"{name!r} cannot be the name of {whose}: expected letters, digits and _, a letter first.")
