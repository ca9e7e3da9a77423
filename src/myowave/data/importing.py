"""Import of measured trials: from the files a dataset names to `Trials`, or one error that lists all that is wrong.

Reading, checking and converting are apart (`readers`, `checks`, `processing`); here they are put together for files
that hold a trial each, with EMG that is already a fraction of a maximum voluntary contraction.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from myowave.data.checks.across import duplicate_problems, rate_problems, role_problems
from myowave.data.checks.columns import ANGLES, TIME, column_problems, emg_columns, is_ignored
from myowave.data.checks.ranges import angle_problems, emg_problems, torque_problems
from myowave.data.checks.tables import beyond_tables, table_problems
from myowave.data.checks.time import pace_problems, time_problems
from myowave.data.checks.values import length_problems, value_problems
from myowave.data.files import find_files
from myowave.data.processing.units import to_radians
from myowave.data.readers import TABLES, RawRecording, read
from myowave.data.recording import Recording, torques_of
from myowave.data.trials import TORQUE, Trials
from myowave.settings import MeasuredDataset, PathTable


def import_trials(
    dataset: str, settings: MeasuredDataset, root: str | Path = ".", channels: Sequence[str] | None = None
) -> Trials:
    """Read, check and stack the recordings of a dataset.

    Args:
        dataset: its name.
        settings: its block of config.yaml.
        root: folder that relative paths of files start from.
        channels: EMG columns that the physical model needs; None takes what the first file has.

    Returns:
        The trials, named after their files without the ending. Angles in degrees are converted to rad.

    Raises:
        ValueError: one line for each problem found in any of the files.
    """
    files = find_files(dataset, settings.files, TABLES, root)
    recordings: dict[str, Recording] = {}
    problems: list[str] = []
    for name, path in files.items():
        recording, found = read_recording(path, channels, settings.ignore_columns)
        problems += found
        if recording is not None:
            recordings[name] = recording
            channels = channels or recording.channels
    problems += rate_problems(recordings)
    problems += duplicate_problems(recordings)
    problems += role_problems(dataset, list(files), settings.test, settings.conditions)
    refuse(dataset, problems)
    assert channels is not None
    return Trials.from_sequences(
        dataset=dataset,
        dt=float(np.median([recording.dt for recording in recordings.values()])),
        names=list(recordings),
        channels=channels,
        emg=[recording.emg for recording in recordings.values()],
        angle=[recording.angle for recording in recordings.values()],
        signals=torques_of(recordings.values()),
        test=settings.test,
        conditions=settings.conditions,
        constants=settings.constants,
        provenance={
            "source": "measured",
            "ignored columns": list(settings.ignore_columns),
            "sha256": {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files.values()},
        },
    )


def check_tables(trials: Trials, tables: Mapping[str, PathTable]) -> list[str]:
    """What to say of trials whose angles leave the tables of an arm's paths, a line for each.

    Args:
        tables: by muscle.

    Raises:
        ValueError: one line for each trial that goes too far beyond a table.
    """
    found = beyond_tables(trials, tables)
    refuse(trials.dataset, list(table_problems(found)))
    return [f"trial {beyond.trial}: {beyond.describe()}" for beyond in found]


def refuse(dataset: str, problems: Sequence[str]) -> None:
    """Raise a ValueError that lists the problems, if there are any."""
    if problems:
        count = "1 problem" if len(problems) == 1 else f"{len(problems)} problems"
        raise ValueError(f"dataset {dataset!r} cannot be imported, {count}:\n" + "\n".join(problems))


def read_recording(
    path: Path, channels: Sequence[str] | None = None, ignored: Sequence[str] = ()
) -> tuple[Recording | None, list[str]]:
    """Read, check and convert one file.

    Args:
        path: a file of one of `TABLES`' endings.
        channels: the EMG columns there must be; None takes whichever there are.
        ignored: names of columns that are not needed.

    Returns:
        The recording, or None where it cannot be used, and the problems found: exactly one of the two is empty.
    """
    try:
        raw = read(TABLES[path.suffix.lower()], path)
    except ValueError as error:
        return None, [str(error)]
    if problems := list(column_problems(raw, channels, ignored)):
        return None, problems
    needed = {TIME, *ANGLES, TORQUE, *(channels or ())}
    raw = replace(raw, signals=tuple(s for s in raw.signals if s.name in needed or not is_ignored(s.name, ignored)))
    if problems := _problems_of(raw, channels):
        return None, problems
    names = tuple(channels or emg_columns(raw.header))
    time, column = raw[TIME].values, _angle_column(raw)
    return Recording(
        origin=str(path),
        dt=(time[-1] - time[0]) / (len(time) - 1),
        channels=names,
        emg=np.stack([raw[name].values for name in names], axis=1),
        angle=to_radians(raw[column].values, column.removeprefix("angle_")),
        torque=raw[TORQUE].values if TORQUE in raw.header else None,
    ), []


def _problems_of(raw: RawRecording, channels: Sequence[str] | None) -> list[str]:
    """Problems of the first round of checks that finds any: a later round relies on the earlier ones."""
    return next((problems for checks in _rounds(raw, channels) if (problems := list(checks))), [])


def _rounds(raw: RawRecording, channels: Sequence[str] | None) -> Iterator[Iterator[str]]:
    yield value_problems(raw)
    yield length_problems(raw)
    yield _problems_of_signals(raw, channels or emg_columns(raw.header))


def _problems_of_signals(raw: RawRecording, channels: Sequence[str]) -> Iterator[str]:
    yield from time_problems(raw, raw[TIME].values, TIME)
    yield from pace_problems(raw, raw[TIME].values, TIME)
    yield from emg_problems(raw, channels)
    yield from angle_problems(raw, _angle_column(raw))
    if TORQUE in raw.header:
        yield from torque_problems(raw, TORQUE)


def _angle_column(raw: RawRecording) -> str:
    return next(name for name in ANGLES if name in raw.header)
