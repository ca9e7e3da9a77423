"""The recordings of a dataset: each signal found, read, converted and given a clock, or it is said why not.

Only what the settings name is kept, under the names that they give it: labels in files may hold people's names. A tidy
file holds a whole trial: `time_s`, `emg_MUSCLE` as a fraction of a maximum contraction, `angle_rad` or `angle_deg`, and
`torque_Nm` where a dynamometer was there. It is a recording whose EMG is an envelope on one grid.
"""

import glob
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from myowave.data.checks.signals import RAW, TIDY, Pace, signal_problem
from myowave.data.files import all_files, look_up, name_trials
from myowave.data.processing.sampled import Sampled, runs_of
from myowave.data.processing.units import (
    ARBITRARY,
    TO_EMG,
    TO_FRACTION,
    TO_NEWTON_METRES,
    TO_NUMBER,
    TO_RADIANS,
    UNITS,
    plain_unit,
    unit_here,
)
from myowave.data.readers import RawRecording, Signal, read_raw
from myowave.data.recording import RawTrial, Session
from myowave.data.trials import ANGLES, EMG_PREFIX, MOTOR, TIME, TORQUE
from myowave.settings import MeasuredDataset, RawSignal, RecordedDataset, TextLayout
from myowave.settings.data import late_by, role_problems
from myowave.settings.keys import did_you_mean
from myowave.settings.recording import TRIAL, EmgChannel, RawAngle, RawKeep, RawMotor, RawTorque, Signed

MOST_DUTY = 1.02  # share of the supply's voltage on a motor, and rounding [-]
TIDY_ENDINGS = (".csv", ".parquet")
Cut = tuple[float, float] | None  # from and to on a signal's clock [s], what is kept of it; None for all


def read_session(
    dataset: str, settings: MeasuredDataset | RecordedDataset, channels: Sequence[str] | None = None
) -> Session:
    """Read all recordings of a dataset; tidy files need `channels` of EMG, where None those of the first file."""
    where = f"data.datasets.{dataset}"
    if isinstance(settings, MeasuredDataset):
        return _read_tidy(where, settings, channels)
    reading = Reading(where, RAW, settings.ignore_columns, settings.layout, settings.recordings)
    trials = {name: trial for name in settings.trials if (trial := reading.trial(name, settings))}
    unused = reading.unused  # of trials: a maximum contraction may hold an angle that nobody needs
    mvc = {name: reading.maximum(name, settings) for name in settings.mvc if name not in settings.trials}
    forms = {channel: one.form for channel, one in settings.emg.items()}
    return Session(trials, forms, mvc, reading.sha256, [*reading.said, *unused])


def _read_tidy(where: str, settings: MeasuredDataset, channels: Sequence[str] | None) -> Session:
    reading = Reading(where, TIDY, settings.ignore_columns, TextLayout(), key="files")
    paths = name_trials(all_files(f"{where}.files", settings.files), TIDY_ENDINGS)
    trials = {}
    for name, path in paths.items():
        if (raw := reading.file(path)) is None:
            continue
        said, listed = len(reading.said), ", ".join(raw.header)
        if channels is None:
            channels = [column for column in raw.header if column.startswith(EMG_PREFIX)] or None
        if all(signal.time is None for signal in raw.signals):
            reading.say(f"{path}, header: no column {TIME!r} of times among {listed}.")
        if channels is None:
            reading.say(f"{path}, header: no EMG column among {listed}; expected emg_<muscle>, such as emg_biceps.")
        if len(angles := [column for column in ANGLES if column in raw.header]) != 1:
            found = " and ".join(angles) or f"no angle among {listed}"
            reading.say(f"{path}, header: found {found}; expected either {' or '.join(ANGLES)}.")
        if len(reading.said) == said:
            file = glob.escape(str(path))
            columns = RecordedDataset.model_construct(  # what settings of raw recordings say of one
                trials=(name,),
                emg={column: EmgChannel(file=file, column=column, form="fraction") for column in channels or ()},
                angle=RawAngle(file=file, column=angles[0], unit=ANGLES[angles[0]], **dict(settings.angle)),
                torque=RawTorque(file=file, column=TORQUE, unit="Nm") if TORQUE in raw.header else None,
            )
            if trial := reading.trial(name, columns):
                trials[name] = replace(trial, file=(path, raw.first_row))
    reading.say(*(f"{where}.{problem}" for problem in role_problems(list(paths), settings)))
    problems = [*reading.said, *reading.unused]
    return Session(trials, dict.fromkeys(channels or (), "fraction"), {}, reading.sha256, problems)


def torque_per_volt(motor: RawMotor) -> float:
    """Torque of a motor at rest for 1 V, kt / R [N m]; 0 where torque was recorded."""
    return (motor.kt_Nm_A or 0.0) / (motor.resistance_ohm or 1.0)


def braking(motor: RawMotor) -> float:
    """By how much a motor's torque falls with speed, kt^2 / R [N m s/rad]; 0 where torque was recorded."""
    return torque_per_volt(motor) * (motor.kt_Nm_A or 0.0)


def _on_clock_of_emg(cut: Cut, late: float) -> Cut:
    """A cut, which is on the clock of an angle though none may be there, as the recorder of the EMG counts."""
    return None if cut is None else (cut[0] - late, cut[1] - late)


@dataclass
class Reading:
    """Files read so far, columns used of them, and problems found: reading goes on, to find all of them."""

    where: str  # the dataset is in the settings, for messages
    pace: Pace  # rates and durations that a signal may have
    ignored: Sequence[str]  # names of columns that are not needed; * stands for anything
    layout: TextLayout  # how tables of text are written
    recordings: Mapping[str, str] = field(default_factory=dict)  # that trials are parts of, where not called alike
    key: str | None = None  # of the dataset that names all signals; None where each has its own
    said: dict[str, None] = field(default_factory=dict, init=False)  # problems of files and signals in order, each once
    sha256: dict[str, str] = field(default_factory=dict, init=False)  # of each signal's file, by trial and signal
    _files: dict[Path, RawRecording | None] = field(default_factory=dict, init=False)
    _used: dict[RawRecording, set[str]] = field(default_factory=dict, init=False)  # columns of a file, by name

    @property
    def unused(self) -> list[str]:
        """Columns that nobody uses, of files of which others are used."""
        problems = []
        for raw, used in self._used.items():
            needless = [n for n in dict.fromkeys(raw.header) if not any(fnmatchcase(n, one) for one in self.ignored)]
            if names := [name or "''" for name in needless if name not in used]:
                problems.append(
                    f"{raw.path}: column {', '.join(names)} is not used. Name it under emg, angle or signals, or under "
                    "ignore_columns; EMG of a dataset that is measured needs a muscle of its arm that it drives."
                )
        return problems

    def say(self, *problems: str) -> None:
        self.said |= dict.fromkeys(problems)

    def file(self, path: Path, form: str | None = None) -> RawRecording | None:
        """What a file holds, in a format or that of its ending; None where it cannot be read."""
        if path not in self._files:
            self._files[path] = None
            try:
                self._files[path] = read_raw(path, form, self.layout)
            except ValueError as error:
                self.say(str(error))
        return self._files[path]

    def trial(self, name: str, settings: RecordedDataset) -> RawTrial | None:
        """All signals of a trial; None where there is a problem with one."""
        cut = settings.cut_s.get(name)
        if settings.keep is not None:
            low, high = self._kept(name, settings.keep)
            cut = (low, high) if cut is None else (max(low, cut[0]), min(high, cut[1]))
        angle = self._read(name, "angle", settings.angle, TO_RADIANS, cut)
        extra = settings.signals.items()
        signals = {key: self._read(name, f"signals.{key}", one, TO_RADIANS, cut) for key, one in extra}
        if settings.motor is not None:
            signals[MOTOR] = self._motor(name, settings.motor, cut)
        if settings.torque is not None and name in settings.torque_trials:
            signals[TORQUE] = self._read(name, "torque", settings.torque, TO_NEWTON_METRES, cut)
        trial = RawTrial(self.emg(name, settings, cut), angle, signals, cut=cut)
        return None if any(len(signal.values) == 1 for signal in trial.all) else trial

    def emg(self, trial: str, settings: RecordedDataset, cut: Cut) -> dict[str, Sampled]:
        """EMG of each channel [uV]; as it is where its unit is arbitrary, a fraction of 1 where it is one."""
        cut = _on_clock_of_emg(cut, late_by(trial, settings))
        factors = {channel: TO_FRACTION if one.form == "fraction" else TO_EMG for channel, one in settings.emg.items()}
        return {c: self._read(trial, f"emg.{c}", one, factors[c], cut) for c, one in settings.emg.items()}

    def maximum(self, name: str, settings: RecordedDataset) -> dict[str, Sampled]:
        """EMG of a maximum contraction that is no trial, as far as `cut_s` keeps it."""
        emg, late = self.emg(name, settings, settings.cut_s.get(name)), late_by(name, settings)
        cut = _on_clock_of_emg(settings.cut_s.get(name), late)
        if cut is None or any(len(one.values) == 1 for one in emg.values()):
            return emg
        kept = {channel: one.between(*cut) for channel, one in emg.items()}
        for channel, one in kept.items():
            whole, left = emg[channel], len(one.values) / one.rate
            if left < self.pace.shortest_s:
                self.say(
                    f"{self.where}.cut_s: keeps {left:.3g} s of {channel} in {name}, which was recorded from "
                    f"{whole.start + late:.2f} to {whole.end + late:.2f} s; expected at least "
                    f"{self.pace.shortest_s:g} s. Correct it, or leave {name} out of mvc."
                )
                return emg
        return kept

    def _motor(self, trial: str, motor: RawMotor, cut: Cut) -> Sampled:
        """Torque of a motor at rest [N m], recorded or by its duty and the voltage."""
        if motor.volts is None:
            return self._read(trial, "motor", motor, TO_NEWTON_METRES, cut)
        duty = self._read(trial, "motor", motor, TO_FRACTION, cut)
        if (most := np.abs(duty.values).max()) > MOST_DUTY:
            self.say(
                f"{self.where}.motor: {motor.column} reaches {most:.3g} in trial {trial}; expected the share of "
                "the voltage, -1 to 1. Name % as its unit, or divide it in the files."
            )
        supply = motor.model_copy(update={"column": motor.volts, "unit": "V", "sign": 1})
        volts = self._read(trial, "motor", supply, {"V": 1.0}, cut)
        # ASSUME: where the voltage was not recorded, it is what it was nearest to that time.
        at_duty = np.interp(duty.time, volts.time, volts.values)
        return replace(duty, values=torque_per_volt(motor) * duty.values * at_duty, unit="Nm")

    def _kept(self, trial: str, keep: RawKeep) -> tuple[float, float]:
        """From and to [s] on the recorder's clock, the longest time in which a column has the value that is kept."""
        sampled = self._read(trial, "keep", keep, TO_NUMBER)
        runs = runs_of(np.isclose(sampled.values, keep.equals))
        if not runs:
            if len(sampled.values) > 1:  # one stands for what was not read
                low, high = sampled.values.min(), sampled.values.max()
                column = f"trial {trial}: {keep.column or 'the column'} is never {keep.equals:g}"
                self.say(f"{column}, but from {low:g} to {high:g}. Correct {self.where}.keep.")
            return sampled.start, sampled.end
        begin, length = max(runs, key=lambda run: run[1])
        return float(sampled.time[begin]), float(sampled.time[begin + length - 1])

    def _read(
        self, trial: str, key: str, settings: RawSignal, factors: Mapping[str, float], cut: Cut = None
    ) -> Sampled:
        """One signal with its sign and offset, in the unit that is used here, by factors of the units that it may be
        written in; only what a cut keeps of it where there is a problem with the whole; one sample where there is one
        with what is kept."""
        where, units = f"{self.where}.{self.key or key}", tuple(factors)
        stand_in = Sampled(np.zeros(1), 1.0, 0.0, unit_here(units[0]), units[0])
        raw = self._one_file(trial, where, settings)
        if raw is None or (signal := self._column(raw, where, settings)) is None:
            return stand_in
        self._used.setdefault(raw, set()).add(signal.name)
        self.sha256[f"{trial}/{self.key or key}"] = raw.sha256
        said = plain_unit(settings.unit or "")
        written = plain_unit(signal.unit or (signal.angle_unit if signal.angle_unit in units else ""))
        ending = plain_unit(signal.name.rpartition("_")[2])  # of `angle_rad`
        named = ending if ending in units else ""
        known = written if written in UNITS else ""
        unit = known or said or written or named or (ARBITRARY if units[0] == ARBITRARY else "")
        problem = signal_problem(raw, signal, settings.rate_hz, self.pace)
        if problem and cut and len((kept := raw.between(signal, *cut, settings.rate_hz)).values):
            signal, problem = kept, signal_problem(raw, kept, settings.rate_hz, self.pace)
        problems = [problem] if problem else []
        if known and said and known != said:
            problems.append(f"{raw.path}: {signal.name} is in {written}, but {where} says {said}. Correct one of them.")
        elif unit not in units:
            found = f"{signal.name} is {f'in {unit!r}' if unit else 'without a unit'}; expected {', '.join(units)}"
            do = "Correct the file, or what is named" if known else "Name it as unit"
            problems.append(f"{raw.path}: {found}. {do} in {where}.")
        self.say(*problems)
        rate = signal.rate or settings.rate_hz or signal.rate_by_time  # a stated rate is exact, times are rounded
        if problems or rate is None:
            return stand_in
        values = signal.values * factors[unit]
        values = settings.sign * values if isinstance(settings, Signed) else values
        values = values + settings.offset_deg * TO_RADIANS["deg"] if isinstance(settings, RawAngle) else values
        start = 0.0 if signal.time is None else float(signal.time[0])
        return Sampled(values, rate, start, unit_here(unit), unit)

    def _one_file(self, trial: str, where: str, settings: RawSignal) -> RawRecording | None:
        pattern = settings.file.replace(TRIAL, self.recordings.get(trial, trial))
        try:
            found = look_up(pattern)
        except ValueError as error:
            self.say(f"{error} See {where}.file.")
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
            return None
        if (times := header.count(name)) == 1:
            return raw[name]
        hint = f"is there {times} times" if times else f"is not there{did_you_mean(name, header)}"
        self.say(f"{raw.path}: column {name!r} {hint} (found {', '.join(header)}). See {where}.")
        self._used.setdefault(raw, set()).update(header)  # it may be one of those that are not used
        return None
