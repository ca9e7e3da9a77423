"""The recordings of a dataset, trial by trial: of raw files, each signal where the settings say; or of tidy files.

A tidy file holds a whole trial: `time_s`, `emg_MUSCLE` as a fraction of a maximum contraction, `angle_rad` or
`angle_deg`, and `torque_Nm` where a dynamometer was there. It is a recording whose EMG is an envelope on one grid.
"""

from __future__ import annotations

import glob
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from myowave.data.checks.signals import RAW, TIDY
from myowave.data.checks.values import role_problems
from myowave.data.files import all_files, name_trials
from myowave.data.processing.sampled import Sampled
from myowave.data.reading import Reading
from myowave.data.recording import RawTrial, Session
from myowave.data.trials import ANGLES, EMG_PREFIX, TIME, TORQUE
from myowave.settings import MeasuredDataset, RecordedDataset, TextLayout
from myowave.settings.recording import Cut, EmgChannel, ExtraAngle, RawAngle, RawKeep, RawMotor, RawTorque

TIDY_ENDINGS = (".csv", ".parquet")
_TIDY_LAYOUT = TextLayout(time_column=TIME)


def read_session(
    dataset: str,
    settings: MeasuredDataset | RecordedDataset,
    root: str | Path = ".",
    channels: Sequence[str] | None = None,
) -> Session:
    """Read all recordings of a dataset.

    Args:
        dataset: its name, for messages.
        settings: its block of config.yaml.
        root: folder that relative paths start from.
        channels: EMG columns that there must be in tidy files; None takes those of the first file.
    """
    where, root = f"data.datasets.{dataset}", Path(root)
    if isinstance(settings, RecordedDataset):
        reading = Reading(where, root, RAW, settings.ignore_columns, settings.layout, settings.recordings)
        trials = {name: _read_trial(reading, name, _raw_signals(settings, name)) for name in settings.trials}
        mvc = {name: _read_emg(reading, name, _raw_signals(settings, name)) for name in settings.mvc}
        forms = {channel: one.form for channel, one in settings.emg.items()}
        return Session(trials, forms, mvc, reading.sha256, reading.problems)
    reading = Reading(where, Path(), TIDY, settings.ignore_columns, _TIDY_LAYOUT)
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
        trial = replace(_read_trial(reading, name, _tidy_signals(path, header, emg)), file=(path, raw.first_row))
        if len(reading.said) == known:
            trials[name] = trial
    reading.say(*role_problems(dataset, list(paths), settings.test, settings.conditions))
    return Session(trials, dict.fromkeys(channels or (), "fraction"), {}, reading.sha256, reading.problems)


@dataclass(frozen=True)
class _Signals:
    """Where the signals of a trial are, and the keys of the dataset that say so."""

    emg: Mapping[str, EmgChannel]
    angle: RawAngle
    signals: Mapping[str, ExtraAngle] = field(default_factory=dict)
    torque: RawTorque | None = None
    motor: RawMotor | None = None
    keep: RawKeep | None = None
    cut: Cut | None = None
    tidy: bool = False

    def key(self, key: str) -> str:
        return "files" if self.tidy else key


def _raw_signals(settings: RecordedDataset, trial: str) -> _Signals:
    torque = settings.torque if trial in settings.torque_trials else None
    cut = settings.cut_s.get(trial)
    return _Signals(settings.emg, settings.angle, settings.signals, torque, settings.motor, settings.keep, cut)


def _tidy_signals(path: Path, header: Sequence[str], channels: Sequence[str]) -> _Signals:
    file = glob.escape(str(path))
    angle = next(name for name in ANGLES if name in header)
    return _Signals(
        {name: EmgChannel(file=file, column=name, form="fraction") for name in channels},
        RawAngle(file=file, column=angle, unit=ANGLES[angle]),
        torque=RawTorque(file=file, column=TORQUE, unit="Nm") if TORQUE in header else None,
        tidy=True,
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


def _read_emg(reading: Reading, trial: str, of: _Signals) -> dict[str, Sampled]:
    return {name: reading.emg(trial, of.key(f"emg.{name}"), channel) for name, channel in of.emg.items()}


def _read_trial(reading: Reading, trial: str, of: _Signals) -> RawTrial:
    angle, unit = reading.angle(trial, of.key("angle"), of.angle)
    signals = {key: reading.angle(trial, f"signals.{key}", signal)[0] for key, signal in of.signals.items()}
    torque = None if of.torque is None else reading.torque(trial, of.key("torque"), of.torque)
    motor = None if of.motor is None else reading.motor(trial, of.key("motor"), of.motor)
    cut = of.cut
    if of.keep is not None:
        kept = reading.kept(trial, of.key("keep"), of.keep)
        low, high = (at - angle.start for at in kept)
        cut = (low, high) if cut is None else (max(low, cut[0]), min(high, cut[1]))
    return RawTrial(_read_emg(reading, trial, of), angle, signals, torque, unit, motor=motor, cut=cut)
