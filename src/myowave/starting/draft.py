"""The draft of a dataset's block: its lines, what was guessed in them, and what is left to the person."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from myowave.starting.arm import StudyArm
from myowave.starting.writing import scalar


@dataclass(frozen=True)
class Draft:
    """A dataset's block of settings.

    Args:
        kind: recorded or measured.
        trials: their names, test trials included.
        lines: below `data.datasets.NAME`.
        guessed: what names of files and columns suggested, one fact each.
        to_do: what only the person knows.
        arm: whose muscles are driven.
    """

    kind: str
    trials: tuple[str, ...]
    lines: tuple[str, ...]
    guessed: tuple[str, ...]
    to_do: tuple[str, ...]
    arm: StudyArm


def shown(path: Path) -> str:
    """A path as settings have it: from this folder on where it is inside, else as it was given."""
    relative = os.path.relpath(path)
    return str(path) if relative.startswith("..") else Path(relative).as_posix()


def held_out_lines(trials: Sequence[str]) -> list[str]:
    """The test trial: the last."""
    return [
        f"      test: [{scalar(trials[-1])}] # GUESSED: the last. Never used for training; best one of each condition"
    ]


def conditions_lines(trials: Sequence[str]) -> list[str]:
    """What the hand held in each trial, to fill in."""
    rows = [f"        {scalar(name)}: {{load: 0.0}}" for name in trials]
    return ["      conditions: # FILL IN the mass in the hand in each trial [kg]; 0 is an empty hand", *rows]


def arm_lines(arm: StudyArm) -> list[str]:
    """The name of the arm, and what it stands for."""
    return [f"      arm: {arm.name}"] if arm.name else []
