"""The signals of a folder's recordings: what each trial's files hold, and which of it is EMG or the elbow's angle.

What a unit or a word says is a guess, and whoever uses it says so; what they do not say is left to the person.
"""

import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path, PurePosixPath

import numpy as np

from myowave.data.problems import say_once
from myowave.data.processing.units import ARBITRARY, PERCENT, TO_MICROVOLTS, TO_RADIANS, plain_unit, unit_here
from myowave.data.readers import RawRecording, Signal, read_raw
from myowave.settings.recording import TRIAL
from myowave.starting.files import Naming, format_of, ways_to_name

# By what their names have in them.
MUSCLES = {"brachiorad": "brachioradialis", **{m: m for m in ("biceps", "triceps", "brachialis", "anconeus")}}
MUSCLES |= {"bizeps": "biceps", "trizeps": "triceps"}
ANGLE_WORDS = ("angle", "elbow", "flexion", "gonio", "winkel", "ellbogen")
# The biceps and triceps that are not the arm's.
LEG = re.compile(r"femoris|surae|bi[cz]eps[\W_]*fem(?!ale)|tri[cz]eps[\W_]*sur(?![a-z])")
_TRIED = 6  # ways to name trials whose files are read


@dataclass(frozen=True, eq=False)
class Found:
    """One signal of a trial's files."""

    pattern: str  # of its file, with {trial}
    form: str  # format of the file
    signal: Signal  # as the first trial has it
    alone: bool  # whether it is the only one in its file, which then needs no name of a column

    @property
    def unit(self) -> str:
        """The unit that the file or the end of the signal's name says (`biceps_uV`); empty for none."""
        ends = {unit.lower(): unit for unit in (*TO_MICROVOLTS, *TO_RADIANS)}
        last = re.split("[_ ]+", self.signal.name.strip())[-1]
        return self.said_by_file or ("" if last == self.signal.name else ends.get(plain_unit(last).lower(), ""))

    @property
    def said_by_file(self) -> str:
        """The unit that the file itself says, in the spelling used here."""
        return plain_unit(self.signal.unit) or ("" if self.says("emg", *MUSCLES) else self.signal.angle_unit)

    @property
    def rate(self) -> float | None:
        """Samples a second [Hz], stated or by its times; None where the file has neither."""
        return self.signal.rate or self.signal.rate_by_time

    @property
    def muscle(self) -> str | None:
        """The muscle of the arm that its name speaks of, or that of its file where it is alone there."""
        text = f"{self.signal.name} {self.pattern if self.alone else ''}".lower()
        if LEG.search(text):
            return None
        return next((muscle for part, muscle in MUSCLES.items() if part in text), None)

    @property
    def span(self) -> tuple[float, float]:
        values = self.signal.values[np.isfinite(self.signal.values)]
        return (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)

    @property
    def facts(self) -> str:
        """Unit, rate and range, in words."""
        rate = "unknown rate" if self.rate is None else f"{self.rate:g} Hz"
        return f"{self.unit or 'unknown unit'}, {rate}, {self.span[0]:.3g} to {self.span[1]:.3g}"

    def says(self, *words: str) -> bool:
        """Whether its name or that of its file has one of these words."""
        text = f"{self.signal.name} {self.pattern}".lower()
        return any(word in text for word in words)

    def may_be(self, units: Collection[str], named: object) -> bool:
        """Whether its unit is one of these, or, where it has none or is a share, it is named so."""
        return self.unit in units or bool(self.unit in ("", PERCENT, ARBITRARY) and named)


@dataclass(frozen=True, eq=False)
class Recorded:
    """What a folder holds: its trials, their signals, and why files were not read."""

    naming: Naming
    signals: tuple[Found, ...]
    skipped: tuple[str, ...]

    @property
    def emg(self) -> list[Found]:
        """Signals in volts, or that speak of EMG or a muscle; those only that name a muscle where any does."""
        likely = [one for one in self.signals if one.may_be(TO_MICROVOLTS, one.muscle or one.says("emg"))]
        return [one for one in likely if one.muscle] or likely

    @property
    def angles(self) -> list[Found]:
        """What may be the elbow's angle: of those in rad or deg, or that speak of one, those that name the elbow."""
        others = [one for one in self.signals if one not in self.emg]
        likely = [one for one in others if one.may_be(TO_RADIANS, one.says(*ANGLE_WORDS))]
        named = [one for one in likely if "elbow" in one.signal.name.lower()]
        return named or [one for one in likely if one.says("elbow")] or likely


def read_folder(folder: Path, files: Sequence[PurePosixPath]) -> Recorded:
    """The trials of a folder and the signals of the first one.

    Names make trials in several ways; right is the first by which files hold the same signals in all trials, as
    `curl1_emg.csv` and `curl1_angle.csv` look like two trials until they are read; or else in most trials. Where that
    way gives a trial all its signals twice, these are repetitions in a folder. A ValueError if no way makes two
    trials.
    """
    skipped: list[str] = []

    @cache
    def read(file: str) -> tuple[str, RawRecording] | None:
        try:
            form = format_of(folder / file)
            return form, read_raw(folder / file, form)
        except ValueError as error:
            skipped.append(str(error))
            return None

    def reads(naming: Naming, trial: str) -> list[tuple[str, tuple[str, RawRecording] | None]]:
        return [(pattern, read(pattern.replace(TRIAL, trial))) for pattern in naming.patterns]

    def contents(naming: Naming, trial: str) -> tuple[tuple[object, ...] | None, ...]:
        """What files of a trial hold: formats, names and kinds of signals, in whatever order and unit of a kind."""
        return tuple(
            r and (r[0], *sorted((s.name, unit_here(plain_unit(s.unit))) for s in r[1].signals))
            for _, r in reads(naming, trial)
        )

    def alike(naming: Naming) -> bool:
        """Whether the first two trials and the last hold the same."""
        return len({contents(naming, trial) for trial in (*naming.trials[:2], naming.trials[-1])}) == 1

    def repeats(naming: Naming) -> bool:
        """Whether a trial has all its signals twice or more, and these are not all called alike, as by a `value`."""
        held = Counter(contents(naming, naming.trials[0]))
        return min(held.values()) > 1 and sum(len(one) - 1 for one in held if one) > 1

    def recorded(naming: Naming) -> Recorded:
        first = [(pattern, *r) for pattern, r in reads(naming, naming.trials[0]) if r]
        found = [Found(p, form, signal, len(raw.signals) == 1) for p, form, raw in first for signal in raw.signals]
        return Recorded(naming, tuple(found), tuple(skipped))

    namings = ways_to_name(files)[:_TRIED]
    first = next(filter(alike, namings), None)
    if first and repeats(first):
        first = next(filter(alike, ways_to_name(files, in_folders=True)), first)
    if first:
        return recorded(first)
    for naming in namings:
        usual, count = Counter(contents(naming, trial) for trial in naming.trials).most_common(1)[0]
        if count >= 2 and 2 * count > len(naming.trials):
            trials = tuple(trial for trial in naming.trials if contents(naming, trial) == usual)
            others = [p.replace(TRIAL, t) for t in naming.trials if t not in trials for p in naming.patterns]
            return recorded(replace(naming, trials=trials, left_out=(*naming.left_out, *others)))
    listed = ", ".join(map(str, files[:3])) + (", ..." if len(files) > 3 else "")
    raise ValueError(
        f"{len(files)} recordings ({listed}), but not two trials: expected the same files for each trial, with the "
        "same signals, such as trial1.csv and trial2.csv, or trial1/emg.csv and trial2/emg.csv. Rename them, or put "
        "each trial into a folder of its own. One long recording is cut into trials by cut_s, see docs/real_arm.md."
        + "".join(f"\n{reason}" for reason in say_once(skipped))
    )
