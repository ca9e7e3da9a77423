"""From the raw recordings of a session to `Trials`: EMG to excitation, everything onto one grid of times.

The EMG that counts as 1 comes from the training trials, or from recordings of maximum contractions, never from a test
trial: what a test trial holds must not reach the training. EMG above 1 may therefore occur in a test trial, up to
`EMG_LIMIT`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from myowave.data.checks.across import duplicate_problems, rate_problems
from myowave.data.checks.ranges import EMG_LIMIT, STILL, TORQUE_LIMIT
from myowave.data.checks.tables import beyond_tables, table_problems
from myowave.data.checks.values import SHORTEST
from myowave.data.processing.excitation import describe, envelope, lag_of
from myowave.data.processing.filters import has_hum
from myowave.data.processing.grid import common_grid, sample_as_it_comes, sample_at
from myowave.data.processing.real_time import Known, RealTime
from myowave.data.processing.sampled import Sampled
from myowave.data.quality.motion import angle_beyond_tables
from myowave.data.quality.report import find_faults, report
from myowave.data.recording import Recording, torques_of
from myowave.data.session import RawTrial, Session, read_session
from myowave.data.trials import Trials
from myowave.settings import PathTable, RecordedDataset


@dataclass(frozen=True, eq=False)
class Prepared:
    """A session, processed.

    Args:
        trials: like any others.
        raw: {trial: as recorded, on one clock}.
        envelopes: {trial: {channel: in the unit of its EMG}}.
        gains: {channel: the envelope that counts as 1, in the unit of its EMG}.
        grids: {trial: times of its samples [s], (N,)}.
    """

    trials: Trials
    raw: Mapping[str, RawTrial]
    envelopes: Mapping[str, Mapping[str, Sampled]]
    gains: Mapping[str, float]
    grids: Mapping[str, NDArray[np.float64]]


def prepare_recording(
    dataset: str, settings: RecordedDataset, root: str | Path = ".", tables: Mapping[str, PathTable] | None = None
) -> tuple[Prepared, dict[str, Any]]:
    """Read and process a session, and report on its quality.

    Args:
        dataset: its name.
        settings: its block of config.yaml.
        root: folder that relative paths of files start from.
        tables: paths of the arm that are given by a table, by muscle.

    Returns:
        What was prepared, and the report of `quality.report`.

    Raises:
        ValueError: one line for each problem that makes the recordings unusable.
    """
    prepared = prepare(dataset, settings, read_session(dataset, settings, root))
    findings = list(find_faults(settings, prepared.raw, prepared.envelopes, prepared.trials))
    beyond = beyond_tables(prepared.trials, tables or {})
    _refuse(dataset, table_problems(beyond))
    findings += [angle_beyond_tables(found) for found in beyond]
    return prepared, report(dataset, findings, prepared.gains)


def prepare(dataset: str, settings: RecordedDataset, session: Session) -> Prepared:
    """Process a session.

    Args:
        dataset: its name.
        settings: its block of config.yaml.
        session: its recordings.

    Raises:
        ValueError: one line for each problem that the processed trials show.
    """
    offset = settings.processing.emg_start_offset_s
    raw = {name: _on_one_clock(trial, offset) for name, trial in session.trials.items()}
    before = _known_before(raw, settings) if settings.processing.phase == "causal" else {}
    envelopes = {name: _envelopes(trial.emg, settings, before) for name, trial in raw.items()}
    grids = {
        name: common_grid(
            trial.all,
            trial.angle,
            settings.processing.rate_hz,
            settings.cut_s.get(name),
        )
        for name, trial in raw.items()
    }
    _refuse(dataset, _grid_problems(grids, raw))
    gains = _gains(settings, session, envelopes, grids, before)
    _refuse(dataset, _gain_problems(gains))
    phase = settings.processing.phase
    recordings = {name: _recording(name, raw[name], envelopes[name], gains, grids[name], phase) for name in raw}
    problems = [*rate_problems(recordings), *duplicate_problems(recordings), *_value_problems(settings, recordings)]
    _refuse(dataset, problems)
    real_time = _real_time(settings, raw, before, gains)
    signals = {key: [sample_at(raw[name].signals[key], grids[name]) for name in raw] for key in settings.signals}
    trials = Trials.from_sequences(
        dataset=dataset,
        dt=float(np.median([recording.dt for recording in recordings.values()])),
        names=list(recordings),
        channels=list(settings.emg),
        emg=[recording.emg for recording in recordings.values()],
        angle=[recording.angle for recording in recordings.values()],
        signals=signals | torques_of(recordings.values()),
        over_time={s.condition: key for key, s in settings.signals.items() if s.condition},
        test=settings.test,
        conditions=_conditions(settings, signals),
        constants=settings.constants,
        provenance=_provenance(settings, session, gains, envelopes) | {"real_time": real_time.plain()},
    )
    return Prepared(trials, raw, envelopes, gains, grids)


def _refuse(dataset: str, problems: Iterator[str] | list[str]) -> None:
    """Raise a ValueError that lists the problems, if there are any."""
    if problems := list(problems):
        count = "1 problem" if len(problems) == 1 else f"{len(problems)} problems"
        raise ValueError(f"dataset {dataset!r} cannot be prepared, {count}:\n" + "\n".join(problems))


def _on_one_clock(trial: RawTrial, offset: float) -> RawTrial:
    """A trial with the EMG's times told on the angle's clock."""
    emg = {channel: replace(sampled, start=sampled.start + offset) for channel, sampled in trial.emg.items()}
    return replace(trial, emg=emg)


def _known_before(raw: Mapping[str, RawTrial], settings: RecordedDataset) -> dict[str, tuple[float, bool]]:
    """Offset of each channel of raw EMG, and if it hums, by the training trials; a causal filter may know no more."""
    found, notch_hz = {}, settings.processing.notch_hz
    for channel, wanted in settings.emg.items():
        if wanted.form == "raw":
            signals = [raw[name].emg[channel] for name in settings.trials if name not in settings.test]
            hum = notch_hz is not None and any(has_hum(s.values, s.rate, notch_hz) for s in signals)
            found[channel] = (float(np.median(np.concatenate([s.values for s in signals]))), hum)
    return found


def _real_time(
    settings: RecordedDataset,
    raw: Mapping[str, RawTrial],
    before: Mapping[str, tuple[float, bool]],
    gains: Mapping[str, float],
) -> RealTime:
    """What a running prediction needs to make the same of raw EMG."""
    first = next(iter(raw.values())).emg
    channels = {
        channel: Known(
            wanted.form, first[channel].rate, first[channel].unit, *before.get(channel, (0.0, False)), gains[channel]
        )
        for channel, wanted in settings.emg.items()
    }
    return RealTime(settings.processing, channels)


def _envelopes(
    emg: Mapping[str, Sampled], settings: RecordedDataset, before: Mapping[str, tuple[float, bool]]
) -> dict[str, Sampled]:
    return {
        channel: envelope(sampled, settings.processing, *before.get(channel, (None, None)))
        if settings.emg[channel].form == "raw"
        else sampled
        for channel, sampled in emg.items()
    }


def _gains(
    settings: RecordedDataset,
    session: Session,
    envelopes: Mapping[str, Mapping[str, Sampled]],
    grids: Mapping[str, NDArray[np.float64]],
    before: Mapping[str, tuple[float, bool]],
) -> dict[str, float]:
    """The envelope of each channel that counts as 1."""
    if settings.processing.normalise == "mvc":
        contractions = [_envelopes(emg, settings, before) for emg in session.mvc.values()]
        return {channel: max(float(e[channel].values.max()) for e in contractions) for channel in settings.emg}
    # ASSUME: in the training trials each muscle was once as active as it can be; where it was not, its EMG is too
    # large by one factor for the whole session, which a fit takes for a weaker muscle.
    train = [name for name in settings.trials if name not in settings.test]
    return {
        channel: max(float(envelopes[n][channel].within(grids[n][0], grids[n][-1]).max()) for n in train)
        for channel in settings.emg
    }


def _recording(
    name: str,
    raw: RawTrial,
    envelopes: Mapping[str, Sampled],
    gains: Mapping[str, float],
    grid: NDArray[np.float64],
    phase: str,
) -> Recording:
    sample = sample_as_it_comes if phase == "causal" else sample_at
    emg = [np.maximum(sample(sampled, grid), 0.0) / gains[channel] for channel, sampled in envelopes.items()]
    dt = float(grid[-1] - grid[0]) / (len(grid) - 1)
    torque = None if raw.torque is None else sample_at(raw.torque, grid)
    return Recording(f"trial {name}", dt, tuple(envelopes), np.stack(emg, axis=1), sample_at(raw.angle, grid), torque)


def _grid_problems(grids: Mapping[str, NDArray[np.float64]], raw: Mapping[str, RawTrial]) -> Iterator[str]:
    for name, grid in grids.items():
        if len(grid) < SHORTEST:
            emg = next(iter(raw[name].emg.values()))
            yield (
                f"trial {name}: {len(grid)} samples at which all signals were recorded; expected at least {SHORTEST}. "
                f"EMG was recorded from {emg.start:.4g} to {emg.end:.4g} s, the angle from {raw[name].angle.start:.4g} "
                f"to {raw[name].angle.end:.4g} s: correct processing.emg_start_offset_s or cut_s, or leave the trial "
                "out."
            )


def _gain_problems(gains: Mapping[str, float]) -> Iterator[str]:
    for channel, gain in gains.items():
        if not gain > 0:
            yield (
                f"{channel}: the EMG never rises above 0, so there is nothing to divide it by. The electrode was off, "
                "or the column is another one: leave the channel out, or correct it."
            )


def _value_problems(settings: RecordedDataset, recordings: Mapping[str, Recording]) -> Iterator[str]:
    of = "the training trials" if settings.processing.normalise == "session" else "maximum contractions"
    for name, recording in recordings.items():
        for c, channel in enumerate(recording.channels):
            peak = int(recording.emg[:, c].argmax())
            if recording.emg[peak, c] > EMG_LIMIT:
                yield (
                    f"trial {name}: {channel} reaches {recording.emg[peak, c]:.2f} of the largest of {of}, "
                    f"{peak * recording.dt:.1f} s after its start; expected at most {EMG_LIMIT:g}. Look for an "
                    "artefact there and cut it off with cut_s, or train on a trial of such effort."
                )
        if recording.torque is not None:
            yield from _torque_problems(name, recording.torque)
        angle = np.degrees(recording.angle)
        if np.ptp(recording.angle) < STILL:
            yield (
                f"trial {name}: the angle stays at {angle[0]:.4g} deg. The sensor was off, or the column is another "
                "one: correct it, or leave the trial out."
            )
        elif np.abs(angle).max() > 180:
            yield (
                f"trial {name}: the angle goes from {angle.min():.0f} to {angle.max():.0f} deg; expected -180 to 180. "
                "Correct sign, offset_deg or unit of the angle."
            )
        elif np.abs(angle).max() < np.pi:
            yield (
                f"trial {name}: the angle goes from {angle.min():.2g} to {angle.max():.2g} deg, which no elbow motion "
                "does. If it is in rad, say so in its unit."
            )


def _torque_problems(name: str, torque: NDArray[np.float64]) -> Iterator[str]:
    if np.abs(torque).max() > TORQUE_LIMIT:
        yield (
            f"trial {name}: the torque goes from {torque.min():.4g} to {torque.max():.4g} N m; expected "
            f"-{TORQUE_LIMIT:g} to {TORQUE_LIMIT:g}. Correct its unit."
        )
    elif np.ptp(torque) < 1e-6:  # filters leave no more of a constant
        yield (
            f"trial {name}: the torque stays at {torque[0]:.4g} N m. The dynamometer was off: leave the trial out of "
            "torque.trials."
        )


def _conditions(
    settings: RecordedDataset, signals: Mapping[str, list[NDArray[np.float64]]]
) -> dict[str, dict[str, float]]:
    """Known constants of each trial, those included that are the median of a signal."""
    # ASSUME: a constant that is known over time counts as its median wherever one value stands for a trial.
    medians = {
        name: {s.condition: float(np.median(signals[key][i])) for key, s in settings.signals.items() if s.condition}
        for i, name in enumerate(settings.trials)
    }
    known = {name: {**settings.conditions.get(name, {}), **medians[name]} for name in settings.trials}
    return {name: values for name, values in known.items() if values}


def _provenance(
    settings: RecordedDataset,
    session: Session,
    gains: Mapping[str, float],
    envelopes: Mapping[str, Mapping[str, Sampled]],
) -> dict[str, Any]:
    processing = settings.processing
    first = next(iter(envelopes.values()))
    train = [name for name in settings.trials if name not in settings.test]
    whose = "the training trials" if processing.normalise == "session" else "maximum contractions"
    return {
        "source": "recorded",
        "emg": {
            channel: {
                "processing": describe(processing, sampled.rate)
                if settings.emg[channel].form == "raw"
                else "an envelope as recorded",
                "divided by": f"{gains[channel]:.6g} {sampled.unit}, the largest envelope of {whose} "
                f"({', '.join(settings.mvc if processing.normalise == 'mvc' else train)})",
                "recorded at": f"{sampled.rate:g} Hz",
            }
            for channel, sampled in first.items()
        },
        "emg_lag_s": lag_of(processing),
        "emg_start_offset_s": processing.emg_start_offset_s,
        "rate": "the angle's" if processing.rate_hz is None else f"{processing.rate_hz:g} Hz",
        "conditions from signals": {s.condition: f"median of {k}" for k, s in settings.signals.items() if s.condition},
        "ignored columns": list(settings.ignore_columns),
        "sha256": dict(session.sha256),
    }
