"""The block of a dataset as text: what was found in its files, and FILL IN where only the person knows."""

import glob
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from myowave.data.checks.signals import RATE_TOLERANCE, RAW
from myowave.data.checks.values import has_sign
from myowave.data.processing.filters import HIGHEST
from myowave.data.processing.units import PERCENT, TO_MICROVOLTS
from myowave.data.readers import ENDINGS, ending_of
from myowave.data.readers.delimited import timed_in
from myowave.data.reading import TIDY_ENDINGS
from myowave.data.trials import ANGLES, EMG_PREFIX
from myowave.settings.keys import TO_FILL_IN
from myowave.settings.recording import TRIAL
from myowave.starting.signals import Found, Recorded

_GRID_HZ = 100.0  # of the trials, where the angle was recorded faster, or may have been
_LOW_HZ, _TOP_HZ = 20, 450.0  # of the band of raw EMG that is kept
_ANGLE = "angle: # GUESSED. FILL IN sign and offset: 0 is the forearm hanging straight, positive in flexion"
LOAD = re.compile(r"((?<![^\W_])\d+[_-])?(\d+(?:[.,]\d+)?) ?kg", re.IGNORECASE)
_MOST_RAD = 6.3  # an angle without a unit that never exceeds this is taken to be in rad


class Block(NamedTuple):
    """A dataset's block of settings: `recorded` or `measured`, its trials, channels, lines below its name, and whether
    it says what EMG of 1 is: a maximum contraction."""

    kind: str
    trials: Sequence[str]
    channels: Sequence[str]
    lines: Sequence[str]
    of_maximum: bool


def dataset_block(folder: Path, recorded: Recorded, *, machine: bool = False) -> Block:
    """The block of a measured dataset where each trial is one file of its own name with times, emg_MUSCLE that is not
    raw and an angle, ready to be taken as it is; else that of a recorded one. A machine has no muscles, and maybe a
    motor."""
    names, patterns = [one.signal.name for one in recorded.signals], recorded.naming.patterns
    emg = [one for one in recorded.signals if one.signal.name.startswith(EMG_PREFIX)]
    raw = any(one.unit in TO_MICROVOLTS or has_sign(*one.span) for one in emg)
    timed = recorded.signals[0].signal.time is not None
    single = len(patterns) == 1 and patterns[0].endswith(TIDY_ENDINGS)
    tidy = bool(single and emg and not raw and timed and {*names} & {*ANGLES})
    files = [patterns[0].replace(TRIAL, trial) for trial in recorded.naming.trials]
    if tidy and len({Path(file).stem for file in files}) == len(files):
        return _tidy_block(folder, recorded, files, [one.signal.name for one in emg])
    return _raw_block(folder, recorded, tidy, machine)


def shown(path: Path) -> str:
    """A path as settings have it: from this folder on where it is inside, else as it was given."""
    relative = os.path.relpath(path)
    return str(path) if relative.startswith("..") else Path(relative).as_posix()


def flow(value: Any) -> str:
    """A value as YAML on one line, quoted where it must be."""
    text = yaml.safe_dump([value], default_flow_style=True, width=float("inf"), allow_unicode=True, sort_keys=False)
    return text.strip()[1:-1]


def kind_of(trial: str) -> str:
    """A trial's name without the number at its end: `light_1` and `light_2` are of one kind, `load2.5` and `load2.75`
    are not."""
    a_size = re.search(r"\d\.[1-9]\d*$", trial)  # and no count
    return trial if a_size else re.sub(r"[\W_]*\d+$", "", trial)


def held_out(trials: Sequence[str]) -> list[str]:
    """The last trial of each condition, as the kinds of their names tell them, or else the loads in these: `2kg_a` and
    `2kg_b` have one.

    A condition with a single trial keeps it for training; where all are single, the last trial is held out.
    """
    for condition_of in (kind_of, load_of):
        conditions: dict[str, list[str]] = {}
        for name in trials:
            conditions.setdefault(condition_of(name), []).append(name)
        if last := [names[-1] for names in conditions.values() if len(names) > 1]:
            return last
    return [trials[-1]]


def load_of(trial: str) -> str:
    """The load in a trial's name [kg] as it stands there; empty where it tells none, or 2_5kg may be 2.5 kg or 5."""
    load = LOAD.search(trial)
    return load[2] if load and not load[1] else ""


def _tidy_block(folder: Path, recorded: Recorded, files: Sequence[str], emg: Sequence[str]) -> Block:
    spare = [one.signal.name for one in recorded.signals if one.signal.name not in (*emg, *ANGLES)]
    trials = [Path(file).stem for file in files]
    angle = next(one for one in recorded.signals if one.signal.name in ANGLES)
    lines = [
        "kind: measured # one file per trial; EMG is a fraction of a maximum contraction",
        f"files: {flow([glob.escape(shown(folder / file)) for file in files])}",
        _ANGLE,
        *_turn_lines(angle, ANGLES[angle.signal.name]),
        *_role_lines(trials),
        *([f"ignore_columns: {flow(spare)}"] if spare else []),
    ]
    return Block("measured", trials, emg, lines, of_maximum=True)


def _raw_block(folder: Path, recorded: Recorded, of_maximum: bool, machine: bool) -> Block:
    recorded, layout = _in_seconds(recorded)
    emg, angles, naming = _named([] if machine else recorded.emg), recorded.angles, recorded.naming
    motor = [one for one in recorded.signals if machine and one.says("torque") and one not in angles][:1]
    mvc = [
        name
        for name in naming.mvc
        if all((folder / one.pattern.replace(TRIAL, name)).is_file() for one in emg.values())
    ]
    used = [*emg.values(), *motor, *(angles if len(angles) == 1 else [])]
    unused = [one for one in recorded.signals if one not in used]
    trials, mvc, in_folders = _plain(naming.trials), _plain(mvc), [n for n in (*naming.trials, *mvc) if "/" in n]
    lines = [
        "kind: recorded # raw EMG and angles, processed here",
        f"trials: {flow(trials)} # GUESSED from the names",
        *([f"mvc: {flow(mvc)} # GUESSED: maximum contractions"] if mvc else []),
        *([f"recordings: {flow(dict(zip(_plain(in_folders), in_folders, strict=True)))}"] if in_folders else []),
        *layout,
        *(_motor_lines(folder, motor) if machine else _emg_lines(folder, emg, recorded, of_maximum)),
        *_angle_lines(folder, angles, recorded),
        *_processing_lines(emg.values(), angles),
        *_role_lines(trials),
    ]
    if not all(one.alone for one in unused):
        lines.append('ignore_columns: ["*"] # columns that are named nowhere above')
    lines += _choices(folder, unused[:20], "# not used:")
    of_maximum = of_maximum or bool(mvc) or any(one.unit == PERCENT for one in emg.values())
    return Block("recorded", trials, list(emg), lines, of_maximum)


def _plain(names: Sequence[str]) -> list[str]:
    """Names of trials, which name no folder: that of `2kg/rep1` is `2kg_rep1`."""
    return [name.replace("/", "_") for name in names]


def _in_seconds(recorded: Recorded) -> tuple[Recorded, list[str]]:
    """The same, and what to say of its tables' times where nothing is recorded as slowly as if they were in s."""
    tables = [one for one in recorded.signals if one.form == "csv" and one.rate is not None]
    rates = [one.rate or 0.0 for one in tables]
    if not rates or max(rates) >= RAW.slowest:
        return recorded, []
    if any(abs(rate - 1) < RATE_TOLERANCE for rate in rates):  # ms at 1000 Hz, or the numbers of samples
        return recorded, ["layout: {time_unit: null} # FILL IN ms, or sample, with rate_hz of each signal below"]
    signals = [replace(one, signal=timed_in(one.signal, "ms")) if one in tables else one for one in recorded.signals]
    line = f"layout: {{time_unit: ms}} # GUESSED: in s it would be {max(rates):.3g} Hz"
    return replace(recorded, signals=tuple(signals)), [line]


def _role_lines(trials: Sequence[str]) -> Iterator[str]:
    yield f"test: {flow(held_out(trials))} # GUESSED: the last of each condition. Never used for training"
    yield "conditions: # FILL IN the mass in the hand in each trial [kg]; 0 is an empty hand"
    yield from (f"  {flow(name)}: {{load: {TO_FILL_IN}}}" for name in trials)


def _named(emg: Sequence[Found]) -> dict[str, Found]:
    """EMG by the names of channels: those of their muscles, a muscle that is there twice counted on, or numbers."""
    named: dict[str, Found] = {}
    for number, one in enumerate(emg, start=1):
        name = f"{EMG_PREFIX}{one.muscle or f'channel{number}'}"
        named[name if name not in named else f"{name}_{number}"] = one
    return named


def _keys(folder: Path, found: Found) -> dict[str, str]:
    parts = [glob.escape(part) for part in f"{shown(folder)}/{found.pattern}".split(TRIAL)]
    keys = {"file": TRIAL.join(part.replace("{", "?").replace("}", "?") for part in parts)}
    if not found.alone:
        keys["column"] = found.signal.name
    if ENDINGS.get(ending_of(Path(found.pattern))) != found.form:
        keys["format"] = found.form
    return keys


def _choices(folder: Path, signals: Sequence[Found], before: str = "  #") -> Iterator[str]:
    """Comments that say where signals are and what is known of them."""
    yield from (f"{before} {flow(_keys(folder, one))} # {one.facts}" for one in signals)


def _key_lines(folder: Path, found: Found, unit: str) -> Iterator[str]:
    """Lines of where a signal is, of its unit where the file does not say it, and its rate where nothing does."""
    yield from (f"{key}: {flow(value)}" for key, value in _keys(folder, found).items())
    if not found.said_by_file:
        yield f"unit: {unit}"
    if found.rate is None:
        yield "rate_hz: null # FILL IN samples a second, or under layout the time_column: the file tells neither"


def _emg_lines(folder: Path, emg: Mapping[str, Found], recorded: Recorded, of_maximum: bool) -> Iterator[str]:
    if not emg:
        yield "emg: # FILL IN, such as emg_biceps: {...} with one of"
        yield from _choices(folder, recorded.signals)
        return
    yield "emg: # GUESSED, all of it"
    for name, found in emg.items():
        again = f"GUESSED: it drives no muscle until physics.arms says which, as BICshort: {{emg: {name}}}"
        note = "FILL IN the muscle instead of channel" if not found.muscle else again if name[-1].isdigit() else ""
        yield f"  {name}: # {'; '.join(filter(None, (found.facts, note)))}"
        by_name = found.unit in TO_MICROVOLTS
        unit = f"{found.unit} # GUESSED: its name ends so" if by_name else "au # FILL IN uV, mV or V"
        yield from (f"    {line}" for line in _key_lines(folder, found, "au" if of_maximum else unit))
        if found.unit == PERCENT or of_maximum:
            yield f"    form: fraction # GUESSED: {found.unit or 'share'} of a maximum contraction"
        elif found.span[0] >= 0:
            yield "    form: envelope # GUESSED: it is never below 0"


def _motor_lines(folder: Path, motor: Sequence[Found]) -> Iterator[str]:
    for found in motor:
        yield "motor: # GUESSED. FILL IN sign: 1 where its torque turns the angle up"
        yield from (f"  {line}" for line in (*_key_lines(folder, found, "Nm # GUESSED"), "sign: 1"))
        yield "scatter: {drive: {absolute: 0.05}} # GUESSED: how well that torque is known, as a share of it"


def _angle_lines(folder: Path, angles: Sequence[Found], recorded: Recorded) -> Iterator[str]:
    if len(angles) != 1:
        yield "angle: # FILL IN file and column, one of"
        yield from _choices(folder, angles or recorded.signals)
        return
    (angle,) = angles
    low, high = angle.span
    unit = angle.unit or ("rad" if max(-low, high) <= _MOST_RAD else "deg")
    yield _ANGLE
    yield from (f"  {line}" for line in _key_lines(folder, angle, f"{unit} # GUESSED"))
    yield from _turn_lines(angle, unit)


def _turn_lines(angle: Found, unit: str) -> Iterator[str]:
    low, high = angle.span
    in_degrees = 57.29578 if unit == "rad" else 1.0
    yield f"  sign: 1 # {in_degrees * low:.0f} to {in_degrees * high:.0f} deg in the first trial"
    yield "  offset_deg: 0.0 # where 180 is the straight arm: sign: -1, offset_deg: 180"


def _processing_lines(emg: Any, angles: Sequence[Found]) -> Iterator[str]:
    keys: dict[str, Any] = {}
    slowest = min((one.rate for one in emg if one.rate and one.span[0] < 0), default=None)
    if slowest is not None and _LOW_HZ < HIGHEST * slowest < _TOP_HZ:  # slower ones are refused on import
        keys["band_pass_hz"] = [_LOW_HZ, int(HIGHEST * slowest)]
    if any(one.rate is None or one.rate > _GRID_HZ for one in angles[:1]):
        keys["rate_hz"] = _GRID_HZ
    if keys:
        yield f"processing: {flow(keys)}"
