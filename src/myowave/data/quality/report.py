"""The quality report of a session: what is doubtful in it, and what to do about each doubt."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from myowave.data.checks.ranges import EMG_LIMIT
from myowave.data.quality import clocks, emg, motion
from myowave.data.quality.finding import Finding
from myowave.data.recording import Prepared
from myowave.data.trials import Trials


def find_faults(prepared: Prepared, notch_hz: float | None) -> Iterator[Finding]:
    """All findings of what was prepared, with hum at `notch_hz` taken out, those about the session last."""
    raw, envelopes, forms = prepared.raw, prepared.envelopes, prepared.forms
    typical = {c: float(np.median([trial.emg[c].values.std() for trial in raw.values()])) for c in forms}
    for name, trial in raw.items():
        for channel, signal in trial.emg.items():
            of = partial(_about, name, channel)
            if dead := list(of(emg.dead_channel(signal, typical[channel]))):
                yield from dead
                continue
            yield from of(emg.silent_channel(envelopes[name][channel]))
            if forms[channel] == "raw":
                yield from of(emg.clipping(signal))
                yield from of(emg.mains_hum(signal, notch_hz))
                yield from of(emg.slow_power(signal))
                yield from of(emg.filled_gaps(signal))
        yield from _about(name, "", emg.crosstalk({c: s for c, s in trial.emg.items() if forms[c] == "raw"}))
        yield from _about(name, "angle", motion.jumps(trial.angle))
        yield from _about(name, "angle", motion.range_of_motion(trial.angle))
        for key, signal in trial.signals.items():
            yield from _about(name, key, motion.jumps(signal))
        for channel, signal in trial.emg.items():
            yield from _about(name, channel, clocks.durations(signal, trial.angle))
    yield from clocks.offset_and_drift(raw, envelopes)
    yield from _above_one(prepared.trials)


def _about(trial: str, signal: str, findings: Iterator[Finding]) -> Iterator[Finding]:
    return (replace(finding, trial=trial, signal=signal) for finding in findings)


def _above_one(trials: Trials) -> Iterator[Finding]:
    """EMG of trials that is more than what counts as 1."""
    for i, name in enumerate(trials.names):
        for c, channel in enumerate(trials.channels):
            largest = float(trials.emg[i, :, c].max())
            if largest > 1.001:  # resampled, the largest may move by a little
                yield Finding(
                    "EMG above 1",
                    f"reaches {largest:.2f} of what counts as 1",
                    "The scale comes from trials of less effort: train on one of such effort, or name maximum "
                    "contractions under mvc. If it is a moment only, look for an artefact and cut it off with cut_s.",
                    name,
                    channel,
                    "warning" if largest > EMG_LIMIT else "note",
                )


def report(dataset: str, findings: list[Finding], gains: Mapping[str, float]) -> dict[str, Any]:
    """The report as plain data, with a summary in a sentence."""
    warnings = [finding for finding in findings if finding.severity == "warning"]
    kinds = list(dict.fromkeys(finding.check for finding in warnings))
    count = f"{len(warnings)} warning" + "s" * (len(warnings) != 1)
    return {
        "dataset": dataset,
        "summary": f"{count} ({', '.join(kinds)})" if warnings else "no warnings",
        "findings": [finding.to_json() for finding in findings],
        "counts_as_1": dict(gains),
    }
