"""The recordings of a dataset, trial by trial: of raw files, each signal where the settings say; or of tidy files.

A tidy file holds a whole trial: `time_s`, `emg_MUSCLE` as a fraction of a maximum contraction, `angle_rad` or
`angle_deg`, and `torque_Nm` where a dynamometer was there. It is a recording whose EMG is an envelope on one grid.
"""

from __future__ import annotations

import glob
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from myowave.data.checks.signals import RAW, TIDY
from myowave.data.checks.values import role_problems
from myowave.data.files import all_files, name_trials
from myowave.data.reading import Reading
from myowave.data.recording import Session
from myowave.data.trials import ANGLES, EMG_PREFIX, TIME, TORQUE
from myowave.settings import MeasuredDataset, RecordedDataset, TextLayout
from myowave.settings.recording import EmgChannel, RawAngle, RawTorque

TIDY_ENDINGS = (".csv", ".parquet")


def read_session(
    dataset: str,
    settings: MeasuredDataset | RecordedDataset,
    root: str | Path = ".",
    channels: Sequence[str] | None = None,
) -> Session:
    """Read all recordings of a dataset; tidy files need `channels` of EMG, where None those of the first file."""
    where, root = f"data.datasets.{dataset}", Path(root)
    if isinstance(settings, MeasuredDataset):
        return _read_tidy(dataset, where, settings, root, channels)
    reading = Reading(where, root, RAW, settings.ignore_columns, settings.layout, settings.recordings)
    trials = {name: reading.trial(name, settings) for name in settings.trials}
    mvc = {name: reading.emg(name, settings) for name in settings.mvc}
    forms = {channel: one.form for channel, one in settings.emg.items()}
    return Session(trials, forms, mvc, reading.sha256, reading.problems)


def _read_tidy(
    dataset: str, where: str, settings: MeasuredDataset, root: Path, channels: Sequence[str] | None
) -> Session:
    reading = Reading(where, Path(), TIDY, settings.ignore_columns, TextLayout(time_column=TIME), key="files")
    paths = name_trials(all_files(f"{where}.files", settings.files, root), TIDY_ENDINGS)
    trials = {}
    for name, path in paths.items():
        raw = reading.file(path)
        header = [] if raw is None else raw.header
        emg = tuple(name for name in header if name.startswith(EMG_PREFIX)) if channels is None else channels
        problems = list(_tidy_problems(path, header, emg if channels is None else None)) if raw else []
        channels = emg or channels
        reading.say(*problems)
        if raw is None or problems:
            continue
        known = len(reading.said)
        trial = replace(reading.trial(name, _as_recorded(path, header, emg)), file=(path, raw.first_row))
        if len(reading.said) == known:
            trials[name] = trial
    reading.say(*role_problems(dataset, list(paths), settings.test, settings.conditions))
    return Session(trials, dict.fromkeys(channels or (), "fraction"), {}, reading.sha256, reading.problems)


def _as_recorded(path: Path, header: Sequence[str], channels: Sequence[str]) -> RecordedDataset:
    """Where the signals of a tidy file are, as a dataset of raw recordings says it."""
    file = glob.escape(str(path))
    angle = next(name for name in ANGLES if name in header)
    return RecordedDataset.model_construct(
        trials=(path.stem,),
        emg={name: EmgChannel(file=file, column=name, form="fraction") for name in channels},
        angle=RawAngle(file=file, column=angle, unit=ANGLES[angle]),
        torque=RawTorque(file=file, column=TORQUE, unit="Nm") if TORQUE in header else None,
    )


def _tidy_problems(path: Path, header: Sequence[str], channels: Sequence[str] | None) -> Iterator[str]:
    """Columns that a tidy file lacks; `channels` are its own, None where others are needed, or none."""
    listed = ", ".join(header)
    if channels is not None and not channels:
        yield f"{path}, header: no EMG column among {listed}; expected emg_<muscle>, such as emg_biceps."
    angles = [name for name in ANGLES if name in header]
    if len(angles) != 1:
        found = " and ".join(angles) or f"no angle among {listed}"
        yield f"{path}, header: found {found}; expected either {' or '.join(ANGLES)}."
