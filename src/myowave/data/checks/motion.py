"""Doubts about angles: of the elbow, of a machine, and of whatever leans."""

import numpy as np

from myowave.data.checks.finding import Check
from myowave.data.checks.values import HALF_TURN_DEG
from myowave.data.processing.sampled import Sampled

JUMP_DEG, JUMP_DEG_S2, JUMP_NOISE = 2.0, 1.0e4, 9.0
"""Step beyond its neighbours that is a jump [deg], the acceleration that an arm may have besides [deg/s^2], and how
many medians of such steps noise may have: six of its standard deviations."""
NEAR_TURN_DEG = 15.0  # how near to half a turn or a whole one a jump is that an angle makes by itself [deg]
STRAIGHT_DEG, BENT_DEG = -15.0, 165.0  # ends of the range of an elbow [deg]
LITTLE_DEG = 20.0  # range of motion below which a trial says little [deg]
LEAN_DEG = 100.0  # lean of an upper arm beyond which it is raised above the shoulder [deg]
# ASSUME: a forearm held out weighs on the shoulder by 1.5 N m more than one that hangs, and no shoulder is stiffer than
# 100 N m/rad (Perreault et al. 2001, cited from memory): so much an upper arm gives way that nothing holds [deg].
GIVES_WAY_DEG = 0.8


def _jumps(of: Sampled) -> str | None:
    steps = np.diff(np.degrees(of.values))
    beyond = np.pad(np.abs(steps[1:-1] - (steps[:-2] + steps[2:]) / 2), 1)
    # A jump shows in its neighbours.
    around = np.lib.stride_tricks.sliding_window_view(np.pad(beyond, 2), 5).max(axis=1)
    least = JUMP_DEG + JUMP_DEG_S2 / of.rate**2 + JUMP_NOISE * np.median(beyond)
    where = np.flatnonzero((beyond == around) & (beyond > least))
    if not len(where):
        return None
    step, when = steps[where[0]], of.start + (where[0] + 1) / of.rate
    turn = next((name for name, deg in _TURNS.items() if abs(abs(step) - deg) < NEAR_TURN_DEG), "")
    return f"goes by {step:.1f} deg{turn} from one sample to the next at {when:.2f} s ({len(where)} such steps)"


_TURNS = {", half a turn,": 180.0, ", a turn,": 360.0}


def _span(of: Sampled) -> tuple[float, float, str]:
    """Smallest and largest angle [deg], also in words."""
    low, high = (float(np.degrees(end)) for end in (of.values.min(), of.values.max()))
    return low, high, f"goes from {low:.0f} to {high:.0f} deg"


def _turned_over(of: Sampled) -> str | None:
    low, high, span = _span(of)
    return span if max(-low, high) > HALF_TURN_DEG else None


def _negated(of: Sampled) -> str | None:
    low, high, span = _span(of)
    return span if low < STRAIGHT_DEG and high <= -STRAIGHT_DEG else None


def _beyond(of: Sampled) -> str | None:
    low, high, span = _span(of)
    told = (low < STRAIGHT_DEG or high > BENT_DEG) and not _negated(of)
    return f"{span}; an elbow from {STRAIGHT_DEG:g} to {BENT_DEG:g} deg" if told else None


def _still(of: Sampled) -> str | None:
    low, high, span = _span(of)
    return span if high - low < LITTLE_DEG and not _beyond(of) and not _negated(of) else None


def _leaning(of: Sampled) -> str | None:
    low, high, span = _span(of)
    return span if max(-low, high) > LEAN_DEG else None


def _still_lean(of: tuple[Sampled, Sampled]) -> str | None:
    """A lean that is stiller than the weight of the forearm allows, and one of a hanging arm if it were in rad."""
    lean, elbow = of
    degrees = np.degrees(lean.values)
    in_rad = lean.written == "deg" and np.abs(degrees).max() < np.radians(LEAN_DEG)
    still = 0 < np.ptp(degrees) < GIVES_WAY_DEG * np.ptp(np.sin(elbow.values))  # one that never changes was said
    span = f"from {degrees.min():.2f} to {degrees.max():.2f} deg, while the elbow {_span(elbow)[2]}"
    return span if in_rad and still else None


JUMP = Check(
    "jump of the angle",
    _jumps,
    "A marker or sensor was lost, or an angle leapt by a turn: cut the trial there with cut_s, or repair it.",
)
ELBOW = (
    JUMP,
    Check("sign of the angle", _negated,
          "Flexion counts positive, and 0 is the straight arm: set sign: -1 of the angle, or correct its offset_deg."),
    Check("range of the angle", _beyond, "Correct sign or offset_deg of the angle, so that 0 is the straight arm."),
    Check("little motion", _still,
          "What depends on posture cannot be identified from it: record larger motions, or correct the unit where "
          "it is in rad."),
)  # fmt: skip
MACHINE = (
    JUMP,
    Check("more than half a turn", _turned_over,
          "If the machine did not turn over, correct unit (deg or rad), sign or offset_deg of the angle."),
)  # fmt: skip
EXTRA = (
    JUMP,
    Check("tilt of the upper arm", _leaning,
          "An upper arm that hangs has a tilt of 0: correct unit (deg or rad), sign or offset_deg of the signal."),
)  # fmt: skip
STILL_LEAN = Check(
    "stillness of the upper arm",
    _still_lean,
    "An upper arm that nothing holds gives way more to the forearm's weight. Is it in rad? Correct the signal's unit.",
)
