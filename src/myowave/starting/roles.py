"""What the signals of a trial are: which is EMG, of which muscle, and which is the elbow's angle. All is guessed."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from myowave.data.processing.units import ARBITRARY, TO_MICROVOLTS, TO_RADIANS, plain_unit
from myowave.data.readers import RawRecording, Signal
from myowave.starting.words import elbow_score, muscle_in, plain, says_angle, says_emg, says_other

_MOST_RAD = 2 * np.pi  # an angle without a unit that never exceeds this is taken to be in rad


@dataclass(frozen=True, eq=False)
class Found:
    """One signal of a trial's files.

    Args:
        pattern: of its file, with {trial}.
        form: format of the file.
        signal: as the first trial has it.
        alone: whether it is the only one in its file, which then needs no name of a column.
    """

    pattern: str
    form: str
    signal: Signal
    alone: bool

    @property
    def unit(self) -> str:
        """The unit that the file names for it, in the spelling used here; empty for none."""
        unit = plain_unit(self.signal.unit)
        return unit or self.signal.angle_unit

    @property
    def rate(self) -> float | None:
        """Samples a second [Hz], stated or by its times; None where the file has neither."""
        time = self.signal.time
        if self.signal.rate is not None or time is None or len(time) < 2 or not time[-1] > time[0]:
            return self.signal.rate
        return float((len(time) - 1) / (time[-1] - time[0]))


@dataclass(frozen=True, eq=False)
class Role:
    """A signal and what it is taken for.

    Args:
        name: what the settings call it, such as emg_biceps, angle or tilt_rad.
        found: the signal.
        unit: to write where the file names none, apart from the end of the signal's name; empty where it does.
        form: raw or envelope, of EMG.
    """

    name: str
    found: Found
    unit: str = ""
    form: str = "raw"


@dataclass(frozen=True, eq=False)
class Roles:
    """The signals that are used, and angles that might be the elbow's or the upper arm's lean as well."""

    emg: tuple[Role, ...]
    angle: Role | None
    lean: Role | None
    unused: tuple[Found, ...]


def signals_of(pattern: str, form: str, raw: RawRecording) -> list[Found]:
    """The signals of one file."""
    return [Found(pattern, form, signal, len(raw.signals) == 1) for signal in raw.signals]


def guess_roles(found: Sequence[Found]) -> Roles:
    """What each signal of a trial is, by names of files, of columns, and units."""
    emg = list(_named([one for one in found if _is_emg(one)]))
    angles = [one for one in found if not _is_emg(one) and _may_be_angle(one)]
    best = max(angles, key=_angle_score, default=None)
    angle = None if best is None or _angle_score(best) <= 0 else Role("angle", best, _angle_unit(best))
    rest = [one for one in angles if angle is None or one is not angle.found]
    lean = next((Role("tilt_rad", one, _angle_unit(one)) for one in rest if _is_lean(one)), None)
    used = {id(role.found) for role in (*emg, angle, lean) if role is not None}
    return Roles(tuple(emg), angle, lean, tuple(one for one in found if id(one) not in used))


def _is_emg(one: Found) -> bool:
    label, unit = one.signal.name, plain_unit(one.signal.unit)
    if unit in TO_RADIANS or says_other(label) or (says_angle(label) and not says_emg(label)):
        return False
    if unit in TO_MICROVOLTS or says_emg(label):
        return True
    return unit in ("", ARBITRARY) and says_emg(one.pattern) and not says_angle(one.pattern)


def _may_be_angle(one: Found) -> bool:
    unit = plain_unit(one.signal.unit)
    return unit in TO_RADIANS or (unit == "" and not says_other(one.signal.name))


def _angle_score(one: Found) -> int:
    """By the column's name, and that of the file, which counts where the column's says nothing."""
    own = elbow_score(one.signal.name)
    of_file = elbow_score(one.pattern) if one.alone or own == 0 else 0
    known = plain_unit(one.signal.unit) in TO_RADIANS
    return own + of_file + (1 if known and own >= 0 and of_file >= 0 else 0)


def _is_lean(one: Found) -> bool:
    words = plain(f"{one.pattern} {one.signal.name}")
    return "upper arm" in words and "pitch" in words


def said_by_name(one: Found) -> str:
    """The unit that a signal's name ends in, as `biceps_uV` and `elbow_deg` do; empty for none."""
    words = one.signal.name.replace("_", " ").split()
    last = plain_unit(words[-1]).lower() if len(words) > 1 else ""
    return next((unit for unit in (*TO_MICROVOLTS, *TO_RADIANS) if last == unit.lower()), "")


def _angle_unit(one: Found) -> str:
    if one.unit in TO_RADIANS:
        return ""
    if (said := said_by_name(one)) in TO_RADIANS:
        return said
    values = one.signal.values[np.isfinite(one.signal.values)]
    return "rad" if len(values) and np.abs(values).max() <= _MOST_RAD else "deg"


def _named(found: Sequence[Found]) -> Iterator[Role]:
    """EMG channels with names of their muscles; a muscle that is there twice is counted on."""
    taken: set[str] = set()
    for number, one in enumerate(found, start=1):
        muscle = muscle_in(one.signal.name) or (muscle_in(one.pattern) if one.alone else None) or f"channel{number}"
        name = next(n for n in (f"emg_{muscle}", *(f"emg_{muscle}_{k}" for k in range(2, 999))) if n not in taken)
        taken.add(name)
        said = said_by_name(one)
        unit = "" if one.unit in (*TO_MICROVOLTS, ARBITRARY) else said if said in TO_MICROVOLTS else ARBITRARY
        yield _as_recorded(Role(name, one, unit))


def _as_recorded(role: Role) -> Role:
    """Raw EMG swings about 0, an envelope does not."""
    values = role.found.signal.values[np.isfinite(role.found.signal.values)]
    return replace(role, form="envelope") if len(values) and values.min() >= 0 else role
