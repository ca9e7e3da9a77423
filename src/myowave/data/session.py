"""The raw recordings of a session: every signal that the settings name, found, read and given a clock.

Only what the settings name is kept, under the names that they give it: labels in files may hold people's names.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from myowave.data.checks.columns import is_ignored
from myowave.data.checks.time import FASTEST_RAW, SLOWEST, time_problems
from myowave.data.checks.values import value_problems
from myowave.data.files import broken_link, match_files, nothing_found
from myowave.data.processing.sampled import Sampled
from myowave.data.processing.units import (
    ARBITRARY,
    TO_MICROVOLTS,
    TO_NEWTON_METRES,
    TO_RADIANS,
    plain_unit,
    to_microvolts,
    to_radians,
)
from myowave.data.readers import RawRecording, Signal, read_raw
from myowave.settings import RawSignal, RecordedDataset
from myowave.settings.keys import did_you_mean
from myowave.settings.recording import TRIAL, RawAngle

RATE_TOLERANCE = 0.005
"""Largest relative difference of a stated rate and that of the times which counts as rounding."""
SHORTEST_S = 2.0
"""Shortest recording that is processed [s]."""
_NOTHING = np.zeros(1)


@dataclass(frozen=True, eq=False)
class RawTrial:
    """One trial as recorded.

    Args:
        emg: {channel: [uV], or any unit where it is arbitrary}.
        angle: elbow angle [rad], with the sign and offset of the settings.
        signals: further angles [rad].
        torque: of the muscles, flexing positive [N m]; None where it was not measured.
    """

    emg: Mapping[str, Sampled]
    angle: Sampled
    signals: Mapping[str, Sampled]
    torque: Sampled | None = None

    @property
    def all(self) -> list[Sampled]:
        """Every signal."""
        return [*self.emg.values(), self.angle, *self.signals.values(), *([self.torque] if self.torque else [])]


@dataclass(frozen=True, eq=False)
class Session:
    """All recordings of a dataset: `trials` and `mvc` by name (of `mvc` the EMG only), and what the files were."""

    trials: Mapping[str, RawTrial]
    mvc: Mapping[str, Mapping[str, Sampled]]
    sha256: Mapping[str, str] = field(default_factory=dict)


def read_session(dataset: str, settings: RecordedDataset, root: str | Path = ".") -> Session:
    """Read all recordings of a dataset.

    Args:
        dataset: its name, for messages.
        settings: its block of config.yaml.
        root: folder that relative paths start from.

    Raises:
        ValueError: one line for each problem in any of the files.
    """
    reading = _Reading(dataset, settings, Path(root))
    trials = {}
    for name in settings.trials:
        emg = {channel: reading.emg(name, channel) for channel in settings.emg}
        angle = reading.angle(name, "angle", settings.angle)
        signals = {key: reading.angle(name, f"signals.{key}", signal) for key, signal in settings.signals.items()}
        trials[name] = RawTrial(emg, angle, signals, reading.torque(name))
    mvc = {name: {channel: reading.emg(name, channel) for channel in settings.emg} for name in settings.mvc}
    reading.close()
    return Session(trials, mvc, reading.sha256)


class _Reading:
    """Files read so far, columns used of them, and problems found."""

    def __init__(self, dataset: str, settings: RecordedDataset, root: Path):
        self._dataset, self._settings, self._root = dataset, settings, root
        self._files: dict[Path, RawRecording | None] = {}
        self._used: dict[Path, set[str]] = {}
        self._problems: dict[str, None] = {}  # in order, each once
        self.sha256: dict[str, str] = {}

    def emg(self, trial: str, channel: str) -> Sampled:
        sampled = self._sampled(trial, f"emg.{channel}", self._settings.emg[channel], (*TO_MICROVOLTS, ARBITRARY))
        unit = ARBITRARY if sampled.unit == ARBITRARY else "uV"
        return sampled.with_values(to_microvolts(sampled.values, sampled.unit), unit)

    def angle(self, trial: str, key: str, settings: RawAngle) -> Sampled:
        sampled = self._sampled(trial, key, settings, tuple(TO_RADIANS))
        values = settings.sign * to_radians(sampled.values, sampled.unit) + settings.offset_deg * TO_RADIANS["deg"]
        return sampled.with_values(values, "rad")

    def torque(self, trial: str) -> Sampled | None:
        settings = self._settings.torque
        if settings is None or trial not in self._settings.torque_trials:
            return None
        sampled = self._sampled(trial, "torque", settings, tuple(TO_NEWTON_METRES))
        return sampled.with_values(settings.sign * sampled.values * TO_NEWTON_METRES[sampled.unit], "Nm")

    def close(self) -> None:
        """Raise what was found wrong in any file, columns included that nobody uses."""
        for path, raw in self._files.items():
            self._say(*_unused(raw, self._used.get(path, set()), self._settings.ignore_columns) if raw else ())
        if self._problems:
            count = "1 problem" if len(self._problems) == 1 else f"{len(self._problems)} problems"
            raise ValueError(f"dataset {self._dataset!r} cannot be read, {count}:\n" + "\n".join(self._problems))

    def _sampled(self, trial: str, key: str, settings: RawSignal, units: tuple[str, ...]) -> Sampled:
        """One signal, or a stand-in where there is a problem: reading goes on, to find all of them."""
        where = f"data.datasets.{self._dataset}.{key}"
        stand_in = Sampled(_NOTHING, 1.0, 0.0, units[0])
        path, raw = self._file(trial, where, settings)
        if raw is None or (signal := self._column(raw, where, settings)) is None:
            return stand_in
        self._used.setdefault(path, set()).add(signal.name)
        if not signal.unit and signal.angle_unit in units:
            signal = replace(signal, unit=signal.angle_unit)
        self.sha256[f"{trial}/{key}"] = hashlib.sha256(path.read_bytes()).hexdigest()
        problems = [*_unit_problems(raw, signal, where, settings, units), *_clock_problems(raw, signal, settings)]
        self._say(*problems)
        if problems:
            return stand_in
        rate, start = _clock(signal, settings)
        return Sampled(signal.values, rate, start, plain_unit(signal.unit or settings.unit or ""))

    def _file(self, trial: str, where: str, settings: RawSignal) -> tuple[Path, RawRecording | None]:
        pattern = settings.file.replace(TRIAL, trial)
        found = match_files(self._root, pattern)
        if len(found) != 1:
            many = f"{pattern}: {len(found)} files match ({', '.join(map(str, found[:3]))}, ...); expected one."
            self._say(f"{where}.file: {many if found else nothing_found(self._root, pattern)}")
            return Path(pattern), None
        path = found[0]
        if broken := broken_link(path):
            self._say(f"{where}.file: {broken}")
            return path, None
        if path not in self._files:
            try:
                self._files[path] = read_raw(path, settings.format, self._settings.layout)
            except ValueError as error:
                self._files[path] = None
                self._say(str(error))
        return path, self._files[path]

    def _column(self, raw: RawRecording, where: str, settings: RawSignal) -> Signal | None:
        header, name = raw.header, settings.column
        if name is None and len(header) == 1:
            return raw.signals[0]
        if name is None:
            self._say(f"{raw.path}: holds {', '.join(header)}; name one of them in {where}.column.")
        elif header.count(name) != 1:
            hint = (
                f"is there {header.count(name)} times"
                if name in header
                else f"is not there{did_you_mean(name, header)}"
            )
            self._say(f"{raw.path}: column {name!r} {hint.removesuffix('.')} (found {', '.join(header)}). See {where}.")
        else:
            return raw[name]
        return None

    def _say(self, *problems: str) -> None:
        self._problems |= dict.fromkeys(problems)


def _unused(raw: RawRecording, used: set[str], ignored: tuple[str, ...]) -> Iterator[str]:
    names = [name for name in raw.header if name not in used and not is_ignored(name, ignored)]
    if names and used:
        yield (
            f"{raw.path}: column {', '.join(dict.fromkeys(names))} is not used. Name it under emg, angle or signals, "
            "or under ignore_columns."
        )


def _unit_problems(
    raw: RawRecording, signal: Signal, where: str, settings: RawSignal, units: tuple[str, ...]
) -> Iterator[str]:
    written, said = plain_unit(signal.unit), plain_unit(settings.unit or "")
    if written and said and written != said:
        yield f"{raw.path}: {signal.name} is in {written}, but {where}.unit says {said}. Correct or remove the latter."
    elif (written or said) not in units:
        found = f"in {written or said!r}" if written or said else "without a unit"
        yield f"{raw.path}: {signal.name} is {found}; expected {', '.join(units)}. Name it in {where}.unit."


def _clock_problems(raw: RawRecording, signal: Signal, settings: RawSignal) -> Iterator[str]:
    raw = RawRecording(raw.path, (signal,), signal.first_row or raw.first_row)
    yield from value_problems(raw)
    if signal.odd:
        return
    rates = {"the file": signal.rate, "rate_hz": settings.rate_hz}
    if signal.time is not None:
        if len(signal.time) < 2:
            yield _too_short(raw, signal)
            return
        problems = list(time_problems(raw, signal.time, "time"))
        yield from problems
        if problems:
            return
        rates["its times"] = _rate_of(signal)
    stated = {name: rate for name, rate in rates.items() if rate is not None}
    if not stated:
        yield f"{raw.path}: {signal.name} has neither times nor a rate; give its samples a second as rate_hz."
        return
    for name, rate in stated.items():
        if not 1 / SLOWEST <= rate <= 1 / FASTEST_RAW:
            yield (
                f"{raw.path}: {signal.name} has {rate:g} Hz by {name}; expected {1 / SLOWEST:g} to "
                f"{1 / FASTEST_RAW:g}. "
                "If its times are in ms or minutes, convert them to seconds; else correct the rate."
            )
            return
    if max(stated.values()) / min(stated.values()) - 1 > RATE_TOLERANCE:
        said = ", ".join(f"{rate:g} Hz by {name}" for name, rate in stated.items())
        yield f"{raw.path}: {signal.name} has {said}; expected one rate. Correct rate_hz, or export the file again."
    elif len(signal.values) < SHORTEST_S * min(stated.values()):
        yield _too_short(raw, signal)


def _too_short(raw: RawRecording, signal: Signal) -> str:
    return f"{raw.path}: {len(signal.values)} samples of {signal.name}; expected at least {SHORTEST_S:g} s of them."


def _clock(signal: Signal, settings: RawSignal) -> tuple[float, float]:
    """Rate [Hz] and time of the first sample [s]: a stated rate is exact, times are rounded."""
    start = 0.0 if signal.time is None else float(signal.time[0])
    return signal.rate or settings.rate_hz or _rate_of(signal), start


def _rate_of(signal: Signal) -> float:
    assert signal.time is not None
    return (len(signal.time) - 1) / float(signal.time[-1] - signal.time[0])
