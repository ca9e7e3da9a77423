"""From the recordings of a dataset to `Trials`: EMG to excitation, everything onto one grid of times.

The EMG that counts as 1 comes from the training trials, or from recordings of maximum contractions, never from a test
trial: what a test trial holds must not reach the training. EMG above 1 may therefore occur in a test trial. EMG that is
a fraction already stays as it is.
"""

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from typing import Any

import numpy as np

from myowave.data.checks.finding import report
from myowave.data.checks.session import find_faults
from myowave.data.checks.values import beyond_tables, has_sign, value_problems
from myowave.data.problems import say_once
from myowave.data.processing.excitation import Known, RealTime, envelope, known_from
from myowave.data.processing.filters import HIGHEST
from myowave.data.processing.sampled import Sampled, common_grid, sample_at
from myowave.data.reading import braking, read_session
from myowave.data.recording import Prepared, RawTrial, Recording, Session
from myowave.data.trials import MOTOR, Array, Trials
from myowave.settings import MeasuredDataset, PathTable, RecordedDataset, SimulatedDataset, dump
from myowave.settings.data import BY_TRIAL, late_by
from myowave.settings.recording import Processing

_NO_EMG = (
    "the EMG never rises above 0, so there is nothing to divide it by. The electrode was off, or the column is another "
    "one: leave the channel out, or correct it."
)
SHORTEST = 50  # fewest samples of a trial [-]; training needs windows, diagnosis degrees of freedom
Dataset = MeasuredDataset | RecordedDataset
# Settings by which no signal is read, and what is added with a trial.
_BESIDE = {"about", "arm", "identify", "scatter", "changed", "test", "constants", "conditions", "ignore_columns"}
_BESIDE |= {"trials", "files"}


def import_trials(
    dataset: str,
    settings: Dataset,
    tables: Mapping[str, PathTable] | None = None,
    channels: Mapping[str, float] | None = None,
) -> tuple[Prepared, dict[str, Any]]:
    """Read and process the recordings of a dataset, and report on their quality.

    Args:
        tables: paths of the arm that are given by a table, by muscle.
        channels: EMG columns that the physical model needs of tidy files, with the side of the muscles that each
            drives: 1 for flexors, -1 for extensors, 0 for both; None takes what the first file has.

    Returns:
        What was prepared, and the `report` of what is doubtful in it; a ValueError has a line for each problem.
    """
    session = read_session(dataset, settings, None if channels is None else list(channels))
    prepared = prepare(dataset, settings, session)
    findings = list(find_faults(prepared, settings, channels or {}))
    beyond, problems = beyond_tables(prepared.trials, tables or {})
    _refuse(dataset, problems)
    return prepared, report(dataset, [*findings, *beyond], prepared.gains)


def known_constants(settings: Dataset | SimulatedDataset) -> dict[str, float]:
    """Constants of the subject that the settings name, and how its motor brakes where there is one."""
    motor = settings.motor if isinstance(settings, RecordedDataset) else None
    return ({} if motor is None else {"braking": braking(motor)}) | settings.constants


def reading_settings(settings: Dataset | SimulatedDataset, trials: Collection[str]) -> dict[str, str]:
    """Digests of the settings by which these trials are read and processed, {key: sha256}: labels may be names."""
    if isinstance(settings, SimulatedDataset):
        return {}
    there = (*trials, *settings.mvc)
    values = {key: value for key, value in dump(settings).items() if key not in _BESIDE}
    for key in {*BY_TRIAL} & {*values}:
        values[key] = {name: value for name, value in values[key].items() if name in there}
    return {key: sha256(json.dumps(value, sort_keys=True).encode()).hexdigest() for key, value in values.items()}


def prepare(dataset: str, settings: Dataset, session: Session) -> Prepared:
    """Process the session of a dataset, or raise a ValueError with a line for each problem; see `import_trials`."""
    processing, forms = settings.processing, session.forms
    fractions = {*forms.values()} <= {"fraction"}  # then EMG of a trial is what it is without the other trials
    raw = {n: replace(trial, emg=_later(trial.emg, late_by(n, settings))) for n, trial in session.trials.items()}
    maxima = {n: _later(emg, late_by(n, settings)) for n, emg in session.mvc.items()}  # all on the angle's clock
    grids = {name: common_grid(trial.all, trial.angle, processing.rate_hz, trial.cut) for name, trial in raw.items()}
    recorded = {name: trial.emg for name, trial in raw.items()} | maxima
    problems = [*session.problems, *_grid_problems(grids, raw), *_emg_problems(recorded, forms, processing)]
    if not fractions or not raw:
        _refuse(dataset, problems)
    train = [name for name in raw if name not in settings.test]
    # A causal filter may know no more than the training trials tell.
    known = {c: known_from([raw[n].emg[c] for n in train or raw], processing, form) for c, form in forms.items()}
    recordings = {
        name: _recording(name, raw[name], grid, processing, known)
        for name, grid in grids.items()
        if len(grid) >= SHORTEST
    }
    mvc = {
        name: {channel: (one, envelope(one, processing, known[channel])) for channel, one in emg.items()}
        for name, emg in maxima.items()
    }
    gains = _gains(known, mvc, [recordings[name] for name in settings.mvc or train if name in recordings])
    _refuse(dataset, [f"{channel}: {_NO_EMG}" for channel, gain in gains.items() if not gain > 0])
    for name, one in recordings.items():
        # Splines undershoot a little, as the filters of whoever prepared fractions do.
        kept = {c: forms[c] == "fraction" and has_sign(e.min(), e.max()) for c, e in one.emg.items()}
        emg = {c: (e if kept[c] else np.maximum(e, 0.0)) / gains[c] for c, e in one.emg.items()}
        recordings[name] = replace(one, emg=emg)
    # Of a maximum contraction EMG cannot be far above 1; where the training trials count, a test trial may be.
    of_maximum = {c: form for c, form in forms.items() if settings.mvc or form == "fraction"}
    _refuse(dataset, [*problems, *value_problems(recordings, of_maximum, settings.test)])
    known = {channel: one.model_copy(update={"gain": gains[channel]}) for channel, one in known.items()}
    provenance = {
        "source": settings.kind,
        "ignored columns": list(settings.ignore_columns),
        "sha256": dict(session.sha256),
        "settings": reading_settings(settings, recordings),
    }
    real_time = {} if fractions else dump(RealTime(processing=processing, channels=known))
    corners = {processing.low_pass_hz if form == "raw" else settings.envelope_low_pass_hz for form in forms.values()}
    # ASSUME: noise of EMG from electrodes that were smoothed differently is white.
    corner = corners.pop() if len(corners) == 1 else None
    origin = {"provenance": provenance, "real_time": real_time, "emg_low_pass_hz": corner}
    trials = _to_trials(dataset, settings, recordings, **origin)
    return Prepared(trials, recordings, gains, forms, mvc)


def _later(emg: Mapping[str, Sampled], seconds: float) -> dict[str, Sampled]:
    return {channel: replace(one, start=one.start + seconds) for channel, one in emg.items()}


def _emg_problems(
    recorded: Mapping[str, Mapping[str, Sampled]], forms: Mapping[str, str], processing: Processing
) -> Iterator[str]:
    """EMG of trials, {trial: {channel: EMG}}, that is said to be smoothed and goes below 0 by more than a filter's
    undershoot, or that is raw and was sampled too slowly for the filters."""
    corner = max(processing.low_pass_hz, processing.band_pass_hz[0] if processing.band_pass_hz else 0.0)
    for channel, form in forms.items():
        each = {name: emg[channel] for name, emg in recorded.items()}
        below = {n: one.values for n, one in each.items() if has_sign(one.values.min(), one.values.max())}
        if form == "envelope" and below:
            share = np.mean(np.concatenate([*below.values()]) < 0)
            yield (
                f"{channel}: form is envelope, which is never below 0, but {100 * share:.0f} % of the samples of trial "
                f"{', '.join(below)} are. Say form: raw, or correct the file where others are envelopes."
            )
        rates = [one.rate for one in each.values() if len(one.values) > 1]  # one sample stands for what was not read
        if form == "raw" and rates and HIGHEST * min(rates) <= corner:
            yield (
                f"{channel}: sampled at {min(rates):g} Hz; expected more than {corner / HIGHEST:.4g} for a filter of "
                f"{corner:g} Hz (band_pass_hz, low_pass_hz of processing). Raw EMG has 1000 Hz or so: where this was "
                "smoothed, say form: envelope; else correct its rate, or these filters."
            )


def _refuse(dataset: str, problems: Iterable[str]) -> None:
    if problems := say_once(problems):
        count = "1 problem" if len(problems) == 1 else f"{len(problems)} problems"
        raise ValueError(f"dataset {dataset!r} cannot be imported, {count}:\n" + "\n".join(problems))


def _recording(name: str, raw: RawTrial, grid: Array, processing: Processing, known: Mapping[str, Known]) -> Recording:
    """A trial on its grid, its EMG not yet divided by what counts as 1."""
    envelopes = {channel: envelope(sampled, processing, known[channel]) for channel, sampled in raw.emg.items()}
    # ASSUME: the low-pass of the envelope is all that a coarser grid needs; a filter without lag would look ahead.
    ahead = processing.phase == "zero"
    emg = {c: sample_at(e, grid) if ahead else np.interp(grid, e.time, e.values) for c, e in envelopes.items()}
    signals = {key: sample_at(signal, grid) for key, signal in raw.signals.items()}
    return Recording(name, raw, envelopes, grid, emg, sample_at(raw.angle, grid), signals)


def _gains(
    known: Mapping[str, Known], mvc: Mapping[str, Mapping[str, tuple[Sampled, Sampled]]], trials: Sequence[Recording]
) -> dict[str, float]:
    """The envelope of each channel that counts as 1: the largest of all of these; 1 where it is a fraction already."""
    of = [{c: one.values for c, (_, one) in emg.items()} for emg in mvc.values()]
    # ASSUME: in the training trials each muscle was once as active as it can be; where it was not, its EMG is too
    # large by one factor for the whole session, which a fit takes for a weaker muscle.
    of += [{c: e.between(one.time[0], one.time[-1]).values for c, e in one.envelopes.items()} for one in trials]
    return {c: 1.0 if k.form == "fraction" else float(max(e[c].max() for e in of)) for c, k in known.items()}


def _to_trials(dataset: str, settings: Dataset, recordings: Mapping[str, Recording], **origin: Any) -> Trials:
    each = list(recordings.values())
    over_time = {signal.condition: key for key, signal in settings.signals.items() if signal.condition}
    if settings.motor is not None:
        over_time["motor"] = MOTOR
    # ASSUME: a constant that is known over time counts as its median wherever one value stands for a trial.
    medians = {n: {c: float(np.median(one.signals[k])) for c, k in over_time.items()} for n, one in recordings.items()}
    conditions = {name: {**settings.conditions.get(name, {}), **medians[name]} for name in recordings}
    keys = dict.fromkeys(key for one in each for key in one.signals)
    return Trials.from_sequences(
        dataset=dataset,
        dt=float(np.median([one.dt for one in each])),
        names=list(recordings),
        channels=list(each[0].emg),
        emg=[np.stack([*one.emg.values(), one.angle], axis=1)[:, :-1] for one in each],  # of a machine there is none
        angle=[one.angle for one in each],
        signals={key: [one.signals.get(key, np.full(len(one.time), np.nan)) for one in each] for key in keys},
        over_time=over_time,
        test=settings.test,
        conditions={name: values for name, values in conditions.items() if values},
        constants=known_constants(settings),
        **origin,
    )


def _grid_problems(grids: Mapping[str, Array], raw: Mapping[str, RawTrial]) -> Iterator[str]:
    for name, grid in grids.items():
        if len(grid) < SHORTEST:
            angle, file, cut = raw[name].angle, raw[name].file, raw[name].cut
            kept = f" between {cut[0]:.2f} and {cut[1]:.2f} s (cut_s, keep)" if cut else ""
            emg = next((f"EMG was recorded from {x.start:.2f} to {x.end:.2f} s, " for x in raw[name].emg.values()), "")
            yield (
                f"{file[0] if file else f'trial {name}'}: {len(grid)} samples at which all signals were recorded"
                f"{kept}; expected at least {SHORTEST}. {emg}the angle from {angle.start:.2f} to {angle.end:.2f} s: "
                "record longer, correct emg_start_offset_s or cut_s, which is in times of the angle's file, "
                "or leave the trial out."
            )
