"""The block of a dataset as text: what was found in its files, and FILL IN where only the person knows."""

import glob
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from myowave.data.processing.units import TO_MICROVOLTS
from myowave.data.readers import ENDINGS, ending_of
from myowave.data.session import TIDY_ENDINGS
from myowave.data.trials import ANGLES, EMG_PREFIX
from myowave.settings.keys import TO_FILL_IN
from myowave.settings.recording import TRIAL
from myowave.starting.signals import Found, Recorded
from myowave.starting.writing import inline_list, scalar

_GRID_HZ = 100.0  # of the trials, where the angle was recorded faster
_TOP_HZ, _NYQUIST_SHARE = 450.0, 0.45  # of the band of raw EMG that is kept
_MOST_RAD = 6.3  # an angle without a unit that never exceeds this is taken to be in rad


@dataclass(frozen=True)
class Block:
    """A dataset's block of settings: `recorded` or `measured`, its trials, channels, and lines below its name."""

    kind: str
    trials: tuple[str, ...]
    channels: tuple[str, ...]
    lines: tuple[str, ...]


def shown(path: Path) -> str:
    """A path as settings have it: from this folder on where it is inside, else as it was given."""
    relative = os.path.relpath(path)
    return str(path) if relative.startswith("..") else Path(relative).as_posix()


def is_tidy(recorded: Recorded) -> bool:
    """Whether each trial is one file with time_s, emg_MUSCLE and an angle, ready to be taken as it is."""
    names = [one.signal.name for one in recorded.signals]
    patterns = recorded.naming.patterns
    return (
        len(patterns) == 1
        and patterns[0].endswith(TIDY_ENDINGS)
        and any(name in ANGLES for name in names)
        and any(name.startswith(EMG_PREFIX) for name in names)
        and recorded.signals[0].signal.time is not None
    )


def tidy_block(folder: Path, recorded: Recorded) -> Block:
    """The block of a measured dataset."""
    names = [one.signal.name for one in recorded.signals]
    emg = tuple(name for name in names if name.startswith(EMG_PREFIX))
    spare = [name for name in names if name not in (*emg, *ANGLES)]
    naming = recorded.naming
    files = [naming.patterns[0].replace(TRIAL, trial) for trial in naming.trials]
    trials = tuple(Path(file).stem for file in files)
    lines = [
        "      kind: measured # one file per trial; EMG is a fraction of a maximum contraction",
        f"      files: {inline_list(glob.escape(shown(folder / file)) for file in files)}",
        *_roles(trials),
        *([f"      ignore_columns: {inline_list(spare)}"] if spare else []),
    ]
    return Block("measured", trials, emg, tuple(lines))


def raw_block(folder: Path, recorded: Recorded) -> Block:
    """The block of a recorded dataset."""
    emg, angles, naming = _named(recorded.emg), recorded.angles, recorded.naming
    mvc = [name for name in naming.mvc if all(_file(folder, one, name).is_file() for one in emg.values())]
    used = [*emg.values(), *(angles if len(angles) == 1 else [])]
    unused = [one for one in recorded.signals if one not in used]
    beside = any(not one.alone for one in unused)
    lines = [
        "      kind: recorded # raw EMG and angles, processed here",
        f"      trials: {inline_list(naming.trials)} # GUESSED from the names",
        *([f"      mvc: {inline_list(mvc)} # GUESSED: maximum contractions"] if mvc else []),
        *_emg_lines(folder, emg, recorded),
        *_angle_lines(folder, angles, recorded),
        *_processing_lines(emg.values(), angles, bool(mvc)),
        *_roles(naming.trials),
        *(['      ignore_columns: ["*"] # columns that are named nowhere above'] if beside else []),
    ]
    lines += [f"      # not used: {_where(folder, one)} # {one.facts}" for one in unused[:20]]
    return Block("recorded", naming.trials, tuple(emg), tuple(lines))


def _roles(trials: Sequence[str]) -> list[str]:
    return [
        f"      test: {inline_list(held_out(trials))} # GUESSED: the last of each condition. Never used for training",
        "      conditions: # FILL IN the mass in the hand in each trial [kg]; 0 is an empty hand",
        *(f"        {scalar(name)}: {{load: {TO_FILL_IN}}}" for name in trials),
    ]


def held_out(trials: Sequence[str]) -> list[str]:
    """The last trial of each condition, as names without the number at their end tell them: `light_1`, `light_2`.

    A condition with a single trial keeps it for training; where all are single, the last trial is held out.
    """
    conditions: dict[str, list[str]] = {}
    for name in trials:
        conditions.setdefault(re.sub(r"[\W_]*\d+$", "", name), []).append(name)
    return [names[-1] for names in conditions.values() if len(names) > 1] or [trials[-1]]


def _named(emg: Sequence[Found]) -> dict[str, Found]:
    """EMG by the names of channels: those of their muscles, a muscle that is there twice counted on, or numbers."""
    named: dict[str, Found] = {}
    for number, one in enumerate(emg, start=1):
        name = f"{EMG_PREFIX}{one.muscle or f'channel{number}'}"
        named[name if name not in named else f"{name}_{number}"] = one
    return named


def _file(folder: Path, found: Found, trial: str) -> Path:
    return folder / found.pattern.replace(TRIAL, trial)


def _keys(folder: Path, found: Found) -> list[str]:
    """What says where a signal is."""
    parts = [glob.escape(part) for part in found.pattern.split(TRIAL)]
    pattern = TRIAL.join(part.replace("{", "?").replace("}", "?") for part in parts)
    keys = [f"file: {scalar(f'{glob.escape(shown(folder))}/{pattern}')}"]
    if not found.alone:
        keys.append(f"column: {scalar(found.signal.name)}")
    if ENDINGS.get(ending_of(Path(found.pattern))) != found.form:
        keys.append(f"format: {found.form}")
    return keys


def _where(folder: Path, found: Found) -> str:
    return "{" + ", ".join(_keys(folder, found)) + "}"


def _rate_lines(found: Found) -> Iterator[str]:
    if found.rate is None:
        yield "rate_hz: null # FILL IN samples a second, or under layout the time_column: the file tells neither"


def _emg_lines(folder: Path, emg: Mapping[str, Found], recorded: Recorded) -> Iterator[str]:
    yield "      emg: # GUESSED, all of it" if emg else "      emg: # FILL IN, such as emg_biceps: {...} with one of"
    for found in () if emg else recorded.signals:
        yield f"        # {_where(folder, found)} # {found.facts}"
    for name, found in emg.items():
        yield f"        {name}: # {found.facts}" + ("" if found.muscle else "; FILL IN the muscle instead of channel")
        keys = _keys(folder, found)
        if not found.said_by_file:
            told = (
                f"{found.unit} # GUESSED: its name ends so"
                if found.unit in TO_MICROVOLTS
                else "au # FILL IN uV, mV or V"
            )
            keys.append(f"unit: {told}")
        keys += _rate_lines(found)
        if found.span[0] >= 0:
            keys.append("form: envelope # GUESSED: it is never below 0")
        yield from (f"          {key}" for key in keys)


def _angle_lines(folder: Path, angles: Sequence[Found], recorded: Recorded) -> Iterator[str]:
    if len(angles) != 1:
        yield "      angle: # FILL IN file and column, one of"
        yield from (f"        # {_where(folder, one)} # {one.facts}" for one in angles or recorded.signals)
        return
    (angle,) = angles
    yield "      angle: # GUESSED. FILL IN sign and offset: 0 is the forearm hanging straight, positive in flexion"
    low, high = angle.span
    unit = angle.unit or ("rad" if max(-low, high) <= _MOST_RAD else "deg")
    in_degrees = 57.29578 if unit == "rad" else 1.0
    keys = [*_keys(folder, angle), *([] if angle.said_by_file else [f"unit: {unit} # GUESSED"]), *_rate_lines(angle)]
    keys.append(f"sign: 1 # {in_degrees * low:.0f} to {in_degrees * high:.0f} deg in the first trial")
    keys.append("offset_deg: 0.0 # where 180 is the straight arm: sign: -1, offset_deg: 180")
    yield from (f"        {key}" for key in keys)


def _processing_lines(emg: Any, angles: Sequence[Found], mvc: bool) -> Iterator[str]:
    keys = []
    slowest = min((one.rate for one in emg if one.rate and one.span[0] < 0), default=None)
    if slowest is not None and _NYQUIST_SHARE * slowest < _TOP_HZ:
        keys.append(f"band_pass_hz: [20, {int(_NYQUIST_SHARE * slowest)}]")
    if any(one.rate is not None and one.rate > _GRID_HZ for one in angles[:1]):
        keys.append(f"rate_hz: {_GRID_HZ:g}")
    if mvc:
        keys.append("normalise: mvc")
    if keys:
        yield f"      processing: {{{', '.join(keys)}}}"
