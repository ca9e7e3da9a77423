"""Signals of a dataset's files: found, read, converted and given a clock, or it is said why not.

Only what the settings name is kept, under the names that they give it: labels in files may hold people's names.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from myowave.data.checks.signals import Pace, signal_problems
from myowave.data.files import look_up
from myowave.data.processing.sampled import Sampled
from myowave.data.processing.units import (
    ARBITRARY,
    PERCENT,
    TO_MICROVOLTS,
    TO_NEWTON_METRES,
    TO_RADIANS,
    plain_unit,
    to_microvolts,
    to_radians,
)
from myowave.data.readers import RawRecording, Signal, read_raw
from myowave.settings import RawSignal, TextLayout
from myowave.settings.keys import did_you_mean
from myowave.settings.recording import TRIAL, EmgChannel, RawAngle, RawKeep, RawMotor, RawTorque


class Reading:
    """Files read so far, columns used of them, and problems found: reading goes on, to find all of them.

    Args:
        where: the dataset is in the settings, for messages.
        root: folder that relative paths start from.
        pace: rates and durations that a signal may have.
        ignored: names of columns that are not needed; * stands for anything.
        layout: how tables of text are written.
        recordings: that trials are parts of, where they are not called alike.
    """

    def __init__(
        self,
        where: str,
        root: Path,
        pace: Pace,
        ignored: Sequence[str],
        layout: TextLayout,
        recordings: Mapping[str, str] | None = None,
    ):
        self._where, self._root, self._pace, self._ignored, self._layout = where, root, pace, ignored, layout
        self._recordings = recordings or {}
        self._files: dict[Path, RawRecording | None] = {}
        self._used: dict[Path, set[str]] = {}
        self._digests: dict[Path, str] = {}
        self.said: dict[str, None] = {}  # problems of files and signals in order, each once
        self.sha256: dict[str, str] = {}

    @property
    def problems(self) -> list[str]:
        """What was found wrong, columns included that nobody uses."""
        unused = [_unused(path, raw, self._used.get(path, set()), self._ignored) for path, raw in self._files.items()]
        return [*self.said, *(problem for one in unused for problem in one)]

    def say(self, *problems: str) -> None:
        """Keep what was found wrong."""
        self.said |= dict.fromkeys(problems)

    def file(self, path: Path, form: str | None = None) -> RawRecording | None:
        """What a file holds, in a format or that of its ending; None where it cannot be read."""
        if path not in self._files:
            self._files[path] = None
            try:
                self._files[path] = read_raw(path, form, self._layout)
                self._digests[path] = hashlib.sha256(path.read_bytes()).hexdigest()
            except ValueError as error:
                self.say(str(error))
        return self._files[path]

    def emg(self, trial: str, key: str, channel: EmgChannel) -> Sampled:
        """EMG [uV], or as it is where its unit is arbitrary or it is a fraction.

        Args:
            trial: its name.
            key: of the dataset that names the signal, for messages; the same in `angle` and `torque`.
            channel: its settings.
        """
        if channel.form == "fraction":
            sampled = self._sampled(trial, key, channel, (ARBITRARY, PERCENT), ARBITRARY)
            return sampled if sampled.unit == ARBITRARY else sampled.with_values(sampled.values / 100, ARBITRARY)
        sampled = self._sampled(trial, key, channel, (*TO_MICROVOLTS, ARBITRARY, PERCENT))
        unit = "uV" if sampled.unit in TO_MICROVOLTS else ARBITRARY
        return sampled.with_values(to_microvolts(sampled.values, sampled.unit), unit)

    def angle(self, trial: str, key: str, angle: RawAngle) -> tuple[Sampled, str]:
        """An angle [rad] with sign and offset, and the unit that it was written in."""
        sampled = self._sampled(trial, key, angle, tuple(TO_RADIANS))
        values = angle.sign * to_radians(sampled.values, sampled.unit) + angle.offset_deg * TO_RADIANS["deg"]
        return sampled.with_values(values, "rad"), sampled.unit

    def torque(self, trial: str, key: str, torque: RawTorque) -> Sampled:
        """A torque [N m] with its sign."""
        sampled = self._sampled(trial, key, torque, tuple(TO_NEWTON_METRES))
        return sampled.with_values(torque.sign * sampled.values * TO_NEWTON_METRES[sampled.unit], "Nm")

    def motor(self, trial: str, key: str, motor: RawMotor) -> Sampled:
        """Torque of a motor at rest [N m], recorded or by its duty and the voltage."""
        if motor.volts is None:
            sampled = self._sampled(trial, key, motor, tuple(TO_NEWTON_METRES))
            return sampled.with_values(motor.sign * sampled.values * TO_NEWTON_METRES[sampled.unit], "Nm")
        duty = self._sampled(trial, key, motor, (ARBITRARY,), ARBITRARY)
        volts = self._sampled(trial, key, motor.model_copy(update={"column": motor.volts, "unit": "V"}), ("V",))
        return duty.with_values(motor.sign * motor.per_volt * duty.values * volts.values, "Nm")

    def kept(self, trial: str, key: str, keep: RawKeep) -> tuple[float, float]:
        """From and to [s] on the recorder's clock, the longest time in which a column has the value that is kept."""
        sampled = self._sampled(trial, key, keep, (ARBITRARY,), ARBITRARY)
        inside = np.concatenate([[False], np.isclose(sampled.values, keep.equals), [False]]).astype(int)
        begin, end = np.flatnonzero(np.diff(inside) > 0), np.flatnonzero(np.diff(inside) < 0)
        if not len(begin):
            self.say(
                f"{self._where}.{key}: {keep.column} is never {keep.equals:g} in trial {trial}. Correct the value."
            )
            return sampled.start, sampled.end
        longest = int(np.argmax(end - begin))
        return float(sampled.time[begin[longest]]), float(sampled.time[end[longest] - 1])

    def _sampled(self, trial: str, key: str, settings: RawSignal, units: tuple[str, ...], unit: str = "") -> Sampled:
        """One signal in one of `units`, which is `unit` where nobody names one; a stand-in where there is a problem."""
        where, stand_in = f"{self._where}.{key}", Sampled(np.zeros(1), 1.0, 0.0, units[0])
        raw = self._one_file(trial, where, settings)
        if raw is None or (signal := self._column(raw, where, settings)) is None:
            return stand_in
        self._used.setdefault(raw.path, set()).add(signal.name)
        self.sha256[f"{trial}/{key}"] = self._digests[raw.path]
        said = plain_unit(settings.unit or "")
        written = plain_unit(signal.unit or (signal.angle_unit if signal.angle_unit in units else ""))
        problems = [
            *_unit_problems(raw, signal.name, where, written, said or ("" if written else unit), units),
            *signal_problems(raw, signal, settings.rate_hz, self._pace),
        ]
        self.say(*problems)
        rate = signal.rate or settings.rate_hz or signal.rate_by_time  # a stated rate is exact, times are rounded
        if problems or rate is None:
            return stand_in
        return Sampled(
            signal.values, rate, 0.0 if signal.time is None else float(signal.time[0]), written or said or unit
        )

    def _one_file(self, trial: str, where: str, settings: RawSignal) -> RawRecording | None:
        pattern = settings.file.replace(TRIAL, self._recordings.get(trial, trial))
        try:
            found = look_up(pattern, self._root)
        except ValueError as error:
            self.say(f"{where}.file: {error}")
            return None
        if len(found) > 1:
            many = ", ".join(map(str, found[:3]))
            self.say(f"{where}.file: {pattern}: {len(found)} files match ({many}, ...); expected one.")
            return None
        return self.file(found[0], settings.format)

    def _column(self, raw: RawRecording, where: str, settings: RawSignal) -> Signal | None:
        header, name = raw.header, settings.column
        if name is None and len(header) == 1:
            return raw.signals[0]
        if name is None:
            self.say(f"{raw.path}: holds {', '.join(header)}; name one of them in {where}.column.")
        elif (times := header.count(name)) != 1:
            hint = f"is there {times} times" if times else f"is not there{did_you_mean(name, header)}".removesuffix(".")
            self.say(f"{raw.path}: column {name!r} {hint} (found {', '.join(header)}). See {where}.")
        else:
            return raw[name]
        return None


def _unused(path: Path, raw: RawRecording | None, used: set[str], ignored: Sequence[str]) -> Iterator[str]:
    header = [] if raw is None else dict.fromkeys(raw.header)
    names = [name for name in header if name not in used and not any(fnmatchcase(name, one) for one in ignored)]
    if names and used:
        yield (
            f"{path}: column {', '.join(names)} is not used. Name it under emg, angle or signals, or under "
            "ignore_columns; EMG of a dataset that is measured needs a muscle in physics.muscles that it drives."
        )


def _unit_problems(
    raw: RawRecording, name: str, where: str, written: str, said: str, units: tuple[str, ...]
) -> Iterator[str]:
    if written and said and written != said:
        yield f"{raw.path}: {name} is in {written}, but {where} says {said}. Correct one of them."
    elif (written or said) not in units:
        found = f"in {written or said!r}" if written or said else "without a unit"
        yield f"{raw.path}: {name} is {found}; expected {', '.join(units)}. Name it as unit in {where}."
