"""From the recordings of a dataset to `Trials`: EMG to excitation, everything onto one grid of times.

The EMG that counts as 1 comes from the training trials, or from recordings of maximum contractions, never from a test
trial: what a test trial holds must not reach the training. EMG above 1 may therefore occur in a test trial. EMG that is
a fraction already stays as it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from myowave.data.checks.finding import report
from myowave.data.checks.session import find_faults
from myowave.data.checks.tables import beyond_tables
from myowave.data.checks.values import (
    angle_problems,
    duplicate_problems,
    emg_problems,
    lean_problems,
    rate_problems,
    torque_problems,
)
from myowave.data.processing.excitation import describe, envelope, lag_of
from myowave.data.processing.filters import has_hum
from myowave.data.processing.grid import common_grid, sample_as_it_comes, sample_at
from myowave.data.processing.real_time import Known, RealTime
from myowave.data.processing.sampled import Sampled
from myowave.data.recording import Prepared, RawTrial, Recording, Session
from myowave.data.session import read_session
from myowave.data.trials import MOTOR, TORQUE, Trials
from myowave.settings import MeasuredDataset, PathTable, RecordedDataset
from myowave.settings.recording import Processing

SHORTEST = 50
"""Fewest samples of a trial [-]; training needs windows, diagnosis degrees of freedom."""
Dataset = MeasuredDataset | RecordedDataset


def import_trials(
    dataset: str,
    settings: Dataset,
    root: str | Path = ".",
    tables: Mapping[str, PathTable] | None = None,
    channels: Mapping[str, float] | None = None,
) -> tuple[Prepared, dict[str, Any]]:
    """Read and process the recordings of a dataset, and report on their quality.

    Args:
        dataset: its name.
        settings: its block of config.yaml.
        root: folder that relative paths of files start from.
        tables: paths of the arm that are given by a table, by muscle.
        channels: EMG columns that the physical model needs of tidy files, with the side of the muscles that each
            drives: 1 for flexors, -1 for extensors, 0 for both; None takes what the first file has.

    Returns:
        What was prepared, and the `report` of what is doubtful in it.

    Raises:
        ValueError: one line for each problem that makes the recordings unusable.
    """
    session = read_session(dataset, settings, root, None if channels is None else list(channels))
    prepared = prepare(dataset, settings, session)
    findings = list(find_faults(prepared, settings.processing.notch_hz, channels or {}))
    beyond, problems = beyond_tables(prepared.trials, tables or {})
    _refuse(dataset, problems)
    return prepared, report(dataset, [*findings, *beyond], prepared.gains)


def prepare(dataset: str, settings: Dataset, session: Session) -> Prepared:
    """Process a session.

    Args:
        dataset: its name.
        settings: its block of config.yaml.
        session: its recordings.

    Raises:
        ValueError: one line for each problem that the recordings or the processed trials show.
    """
    processing, tidy = settings.processing, isinstance(settings, MeasuredDataset)
    if not tidy:  # what counts as 1 needs all of them, where tidy files are checked each by itself
        _refuse(dataset, session.problems)
    raw = {name: _on_one_clock(trial, processing.emg_start_offset_s) for name, trial in session.trials.items()}
    train = [name for name in raw if name not in settings.test]
    steps = _Steps(processing, session.forms, _known_before(processing, session.forms, [raw[name] for name in train]))
    envelopes = {name: steps.envelopes(trial.emg) for name, trial in raw.items()}
    grids = {name: common_grid(trial.all, trial.angle, processing.rate_hz, trial.cut) for name, trial in raw.items()}
    problems = [*session.problems, *_grid_problems(grids, raw)]
    if not tidy:
        _refuse(dataset, problems)
    gains = _gains(steps, session.mvc, {name: envelopes[name] for name in train}, grids)
    _refuse(dataset, _gain_problems(gains))
    recordings = {
        name: _recording(name, raw[name], envelopes[name], gains, grid, steps)
        for name, grid in grids.items()
        if len(grid) >= SHORTEST
    }
    problems += [*rate_problems(recordings), *duplicate_problems(recordings)]
    problems += emg_problems(recordings, steps.known_scale, settings.test)
    for one in recordings.values():
        problems += [*angle_problems(one), *torque_problems(one)]
    problems += [problem for name, trial in raw.items() for problem in lean_problems(name, trial.signals)]
    _refuse(dataset, problems)
    signals = {key: [sample_at(raw[name].signals[key], grids[name]) for name in raw] for key in settings.signals}
    over_time = {s.condition: key for key, s in settings.signals.items() if s.condition}
    constants = settings.constants
    if settings.motor is not None:
        motors = {name: trial.motor for name, trial in raw.items() if trial.motor is not None}
        signals[MOTOR] = [sample_at(motor, grids[name]) for name, motor in motors.items()]
        over_time["motor"] = MOTOR
        constants = {"braking": settings.motor.braking, **constants}
    trials = Trials.from_sequences(
        dataset=dataset,
        dt=float(np.median([recording.dt for recording in recordings.values()])),
        names=list(recordings),
        channels=list(session.forms),
        emg=[recording.emg for recording in recordings.values()],
        angle=[recording.angle for recording in recordings.values()],
        signals=signals | _torques(list(recordings.values())),
        over_time=over_time,
        test=settings.test,
        conditions=_conditions(settings, list(raw), signals, over_time),
        constants=constants,
        provenance=_provenance(settings, session, steps, gains, next(iter(raw.values())).emg, over_time),
    )
    return Prepared(trials, raw, envelopes, gains, grids, session.forms)


def _torques(recordings: Sequence[Recording]) -> dict[str, list[NDArray[np.float64]]]:
    """The torque of each trial, NaN where none was measured; nothing where that is so in all."""
    measured = [one.torque for one in recordings]
    filled = [np.full(len(r.angle), np.nan) if t is None else t for r, t in zip(recordings, measured, strict=True)]
    return {} if all(torque is None for torque in measured) else {TORQUE: filled}


def _refuse(dataset: str, problems: Iterable[str]) -> None:
    """Raise a ValueError that lists the problems, if there are any."""
    if problems := list(problems):
        count = "1 problem" if len(problems) == 1 else f"{len(problems)} problems"
        raise ValueError(f"dataset {dataset!r} cannot be imported, {count}:\n" + "\n".join(problems))


def _on_one_clock(trial: RawTrial, offset: float) -> RawTrial:
    """A trial with the EMG's times told on the angle's clock."""
    emg = {channel: replace(sampled, start=sampled.start + offset) for channel, sampled in trial.emg.items()}
    return replace(trial, emg=emg)


def _known_before(
    processing: Processing, forms: Mapping[str, str], train: Sequence[RawTrial]
) -> dict[str, tuple[float, bool]]:
    """Offset of each channel of raw EMG, and if it hums, by the training trials; a causal filter may know no more."""
    found, notch_hz = {}, processing.notch_hz
    for channel in (c for c, form in forms.items() if form == "raw" and processing.phase == "causal"):
        signals = [trial.emg[channel] for trial in train]
        hum = notch_hz is not None and any(has_hum(s.values, s.rate, notch_hz) for s in signals)
        found[channel] = (float(np.median(np.concatenate([s.values for s in signals]))), hum)
    return found


@dataclass(frozen=True)
class _Steps:
    """What is done to EMG: its processing, the form of each channel, and what is known of it before."""

    processing: Processing
    forms: Mapping[str, str]
    before: Mapping[str, tuple[float, bool]]

    @property
    def known_scale(self) -> dict[str, str]:
        """Channels of which a maximum contraction counts as 1, with their forms: their EMG cannot be far above.

        Where the training trials count, a test trial may be of any effort.
        """
        mvc = self.processing.normalise == "mvc"
        return {channel: form for channel, form in self.forms.items() if mvc or form == "fraction"}

    def envelopes(self, emg: Mapping[str, Sampled]) -> dict[str, Sampled]:
        """Envelopes of all channels, in the unit of their EMG."""
        return {
            channel: envelope(sampled, self.processing, *self.before.get(channel, (None, None)))
            if self.forms[channel] == "raw"
            else sampled
            for channel, sampled in emg.items()
        }

    def real_time(self, emg: Mapping[str, Sampled], gains: Mapping[str, float]) -> RealTime:
        """What a running prediction needs to make the same of raw EMG."""
        channels = {
            channel: Known(form, emg[channel].rate, emg[channel].unit, *self.before.get(channel, (0.0, False)), gain)
            for (channel, form), gain in zip(self.forms.items(), gains.values(), strict=True)
        }
        return RealTime(self.processing, channels)


def _gains(
    steps: _Steps,
    mvc: Mapping[str, Mapping[str, Sampled]],
    train: Mapping[str, Mapping[str, Sampled]],
    grids: Mapping[str, NDArray[np.float64]],
) -> dict[str, float]:
    """The envelope of each channel that counts as 1; `train` has the envelopes of the training trials."""
    if steps.processing.normalise == "mvc":
        peaks = {c: [e[c].values.max() for e in map(steps.envelopes, mvc.values())] for c in steps.forms}
    else:
        # ASSUME: in the training trials each muscle was once as active as it can be; where it was not, its EMG is too
        # large by one factor for the whole session, which a fit takes for a weaker muscle.
        peaks = {c: [e[c].within(grids[n][0], grids[n][-1]).max() for n, e in train.items()] for c in steps.forms}
    return {c: 1.0 if form == "fraction" else float(max(peaks[c])) for c, form in steps.forms.items()}


def _recording(
    name: str,
    raw: RawTrial,
    envelopes: Mapping[str, Sampled],
    gains: Mapping[str, float],
    grid: NDArray[np.float64],
    steps: _Steps,
) -> Recording:
    sample = sample_as_it_comes if steps.processing.phase == "causal" else sample_at
    emg = {channel: sample(sampled, grid) for channel, sampled in envelopes.items()}
    emg = {
        c: values if steps.forms[c] == "fraction" else np.maximum(values, 0.0) / gains[c] for c, values in emg.items()
    }
    angle = sample_at(raw.angle, grid)
    origin, first_row = (f"trial {name}", None) if raw.file is None else raw.file
    return Recording(
        origin=str(origin),
        dt=float(grid[-1] - grid[0]) / (len(grid) - 1),
        channels=tuple(emg),
        emg=np.stack([*emg.values(), angle], axis=1)[:, :-1],  # of an arm without muscles there is none
        angle=angle,
        torque=None if raw.torque is None else sample_at(raw.torque, grid),
        angle_unit=raw.angle_unit,
        first_row=first_row,
    )


def _grid_problems(grids: Mapping[str, NDArray[np.float64]], raw: Mapping[str, RawTrial]) -> Iterator[str]:
    for name, grid in grids.items():
        if len(grid) < SHORTEST:
            angle, file = raw[name].angle, raw[name].file
            emg = next((f"EMG was recorded from {x.start:.4g} to {x.end:.4g} s, " for x in raw[name].emg.values()), "")
            yield (
                f"{file[0] if file else f'trial {name}'}: {len(grid)} samples at which all signals were recorded; "
                f"expected at least {SHORTEST}. {emg}the angle from {angle.start:.4g} to {angle.end:.4g} s: record "
                "longer, correct processing.emg_start_offset_s or cut_s, or leave the trial out."
            )


def _gain_problems(gains: Mapping[str, float]) -> Iterator[str]:
    for channel, gain in gains.items():
        if not gain > 0:
            yield (
                f"{channel}: the EMG never rises above 0, so there is nothing to divide it by. The electrode was off, "
                "or the column is another one: leave the channel out, or correct it."
            )


def _conditions(
    settings: Dataset,
    names: Sequence[str],
    signals: Mapping[str, list[NDArray[np.float64]]],
    over_time: Mapping[str, str],
) -> dict[str, dict[str, float]]:
    """Known constants of each trial, those included that are the median of a signal."""
    # ASSUME: a constant that is known over time counts as its median wherever one value stands for a trial.
    known = {}
    for i, name in enumerate(names):
        medians = {constant: float(np.median(signals[key][i])) for constant, key in over_time.items()}
        known[name] = {**settings.conditions.get(name, {}), **medians}
    return {name: values for name, values in known.items() if values}


def _provenance(
    settings: Dataset,
    session: Session,
    steps: _Steps,
    gains: Mapping[str, float],
    emg: Mapping[str, Sampled],
    over_time: Mapping[str, str],
) -> dict[str, Any]:
    """Where the trials are from and what was done to them; `emg` is that of a trial as recorded."""
    processing = settings.processing
    which = list(session.mvc) or [name for name in session.trials if name not in settings.test]
    whose = "maximum contractions" if processing.normalise == "mvc" else "the training trials"
    real_time = {} if set(steps.forms.values()) <= {"fraction"} else steps.real_time(emg, gains).plain()
    return {
        "source": settings.kind,
        "emg": {
            channel: "a fraction of a maximum contraction as recorded"
            if steps.forms[channel] == "fraction"
            else {
                "processing": describe(processing, sampled.rate)
                if steps.forms[channel] == "raw"
                else "an envelope as recorded",
                "divided by": f"{gains[channel]:.6g} {sampled.unit}, the largest envelope of {whose} "
                f"({', '.join(which)})",
                "recorded at": f"{sampled.rate:g} Hz",
            }
            for channel, sampled in emg.items()
        },
        "emg_lag_s": lag_of(processing),
        "emg_start_offset_s": processing.emg_start_offset_s,
        "rate": "the angle's" if processing.rate_hz is None else f"{processing.rate_hz:g} Hz",
        "conditions from signals": {constant: f"median of {key}" for constant, key in over_time.items()},
        "ignored columns": list(settings.ignore_columns),
        "sha256": dict(session.sha256),
        "real_time": real_time,
    }
