"""Doubts about angles."""

from collections.abc import Iterator

import numpy as np

from myowave.data.checks.tables import Beyond
from myowave.data.processing.sampled import Sampled
from myowave.data.quality.finding import Finding

JUMP_DEG, JUMP_DEG_S2 = 2.0, 1.0e4
"""Step beyond its neighbours that is a jump [deg], and the acceleration that an arm may have besides [deg/s^2]."""
STRAIGHT_DEG, BENT_DEG = -15.0, 165.0
"""Ends of the range of an elbow [deg]."""
LITTLE_DEG = 20.0
"""Range of motion below which a trial says little [deg]."""


def jumps(angle: Sampled) -> Iterator[Finding]:
    """Single steps that no arm makes."""
    steps = np.diff(np.degrees(angle.values))
    beyond = np.pad(np.abs(steps[1:-1] - (steps[:-2] + steps[2:]) / 2), 1)
    around = np.lib.stride_tricks.sliding_window_view(np.pad(beyond, 2), 5).max(
        axis=1
    )  # a jump shows in its neighbours
    where = np.flatnonzero((beyond == around) & (beyond > JUMP_DEG + JUMP_DEG_S2 / angle.rate**2))
    if len(where):
        first = where[0]
        when = angle.start + (first + 1) / angle.rate
        yield Finding(
            "jump of the angle",
            f"goes by {steps[first]:.1f} deg from one sample to the next at {when:.2f} s ({len(where)} such steps)",
            "A marker or sensor was lost, or an angle leapt by a turn: cut the trial there with cut_s, or repair it.",
        )


def range_of_motion(angle: Sampled) -> Iterator[Finding]:
    """An elbow that goes where none goes, or hardly moves."""
    low, high = np.degrees(angle.values.min()), np.degrees(angle.values.max())
    span = f"goes from {low:.0f} to {high:.0f} deg"
    if low < STRAIGHT_DEG or high > BENT_DEG:
        yield Finding(
            "range of the angle",
            f"{span}; an elbow from {STRAIGHT_DEG:g} to {BENT_DEG:g} deg",
            "Correct sign or offset_deg of the angle, so that 0 is the straight arm.",
        )
    elif high - low < LITTLE_DEG:
        yield Finding(
            "little motion",
            span,
            "What depends on posture cannot be identified from it: record larger motions.",
        )


def angle_beyond_tables(beyond: Beyond) -> Finding:
    """An elbow that goes farther than the arm's tables of path lengths."""
    return Finding(
        "angle beyond the tables",
        beyond.found,
        "Doubt torques at these angles: extend the tables if the muscles' paths are known there.",
        beyond.trial,
        "angle",
        "note",
    )
