"""All doubts about a session: of each signal, and of trials and channels side by side."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from myowave.data.checks.cause import CAUSE, Cause
from myowave.data.checks.emg import (
    CHECKS,
    CROSS_TALK,
    DEAD_CHANNEL,
    LIVE_CHECKS,
    MAXIMUM_CHECKS,
    RAW_CHECKS,
    SMOOTHED_CHECKS,
    Channel,
    away_from_peak,
    is_dead,
    level_of,
)
from myowave.data.checks.finding import Check, Finding, find_all
from myowave.data.checks.motion import ELBOW, EXTRA, MACHINE, STILL_LEAN
from myowave.data.recording import Prepared
from myowave.data.trials import Array
from myowave.settings import MeasuredDataset, RecordedDataset
from myowave.settings.data import late_by

GAINS_UV = (3.0, 1e4)  # largest envelope of surface EMG: amplifiers have 1 to 3 uV of noise, muscles give 5 mV
GAINS_APART = 300.0  # how far apart the largest envelopes of two channels are from which one is in another unit [-]
LEAST_FRACTION = 0.01  # largest EMG of a channel as a fraction of a maximum, below which it is in another unit [-]
ALIKE = 0.995  # correlation of two envelopes over a session from which they hold one signal [-]
SAME = 50  # different values that a signal has which is in two trials alike, from which it was copied [-]
TENTHS_DEG, BENT_DEG = 20.0, 90.0
"""An elbow that no trial takes beyond the first is in another unit; one that none takes below the second [deg]."""


def find_faults(
    prepared: Prepared, settings: MeasuredDataset | RecordedDataset, sides: Mapping[str, float]
) -> Iterator[Finding]:
    """All findings of what was prepared, those about the session last.

    Args:
        settings: that it was prepared by.
        sides: of the muscles that each channel drives, 1 for flexors, -1 for extensors, 0 for both.
    """
    notch_hz = settings.processing.notch_hz
    recordings, forms = {name: one.kept for name, one in prepared.recordings.items()}, prepared.forms
    prepared, each = replace(prepared, recordings=recordings), recordings.values()
    typical = {c: float(np.median([one.raw.emg[c].values.std() for one in each])) for c in forms}
    peaks = {c: float(np.median([one.envelopes[c].values.max() for one in each])) for c in forms}
    live = {c: [one.envelopes[c] for one in each if not is_dead(one.raw.emg[c], typical[c])] for c in forms}
    resting = {c: min((level_of(envelope)[0] for envelope in live[c]), default=0.0) for c in forms}
    for n, (name, one) in enumerate(recordings.items()):
        raw, earlier = one.raw, [*each][:n]
        for channel, form in forms.items():
            signal, largest = raw.emg[channel], float(one.emg[channel].max())
            scales = typical[channel], resting[channel], peaks[channel], notch_hz, largest
            what = Channel(signal, one.envelopes[channel], *scales, raw.angle, late_by(name, settings))
            yield from _of_channel(what, LIVE_CHECKS, form, name, channel)
            yield from find_all(CHECKS, what, name, channel)
            yield from COPIED.of((signal.values, {b.name: b.raw.emg[channel].values for b in earlier}), name, channel)
        yield from CROSS_TALK.of({c: s for c, s in raw.emg.items() if forms[c] == "raw"}, name)
        yield from find_all(ELBOW if forms else MACHINE, raw.angle, name, "angle")  # a machine goes where no elbow does
        if forms:
            yield from COPIED.of((raw.angle.values, {b.name: b.raw.angle.values for b in earlier}), name, "angle")
        for key, signal in raw.signals.items():
            yield from find_all(EXTRA if signal.unit == "rad" else (), signal, name, key)
            yield from STILL_LEAN.of((signal, raw.angle), name, key) if forms else ()
    for name, emg in prepared.mvc.items():
        for channel, (signal, envelope) in emg.items():
            scales = typical[channel], resting[channel], away_from_peak(envelope), notch_hz, 1.0
            what = Channel(signal, envelope, *scales, signal, late_by(name, settings))
            yield from _of_channel(what, MAXIMUM_CHECKS, forms[channel], name, channel)
    if forms:
        yield from find_all(SESSION, prepared)
        yield from find_all(CAUSE, Cause(prepared, sides))


def _of_channel(what: Channel, live: Sequence[Check], form: str, trial: str, channel: str) -> Iterator[Finding]:
    """Findings of what goes into the EMG of 1: that nothing was recorded, or else what is wrong with it."""
    dead = list(DEAD_CHANNEL.of(what, trial, channel))
    yield from dead
    if not dead:
        yield from find_all((*live, *(RAW_CHECKS if form == "raw" else SMOOTHED_CHECKS)), what, trial, channel)


def _copied(of: tuple[Array, Mapping[str, Array]]) -> str | None:
    values, earlier = of
    alike = (trial for trial, other in earlier.items() if _goes_on(values, other) or _goes_on(other, values))
    return next((f"the same samples as in trial {trial}" for trial in alike), None)


def _goes_on(values: Array, other: Array) -> bool:
    """Whether others (M,) are, from one of their samples on, as values (N,) begin, until either ends."""
    if min(len(values), len(other)) < SAME:
        return False
    starts = np.flatnonzero((np.lib.stride_tricks.sliding_window_view(other, SAME) == values[:SAME]).all(axis=1))
    both = ((values[: len(other) - n], other[n : n + len(values)]) for n in starts)
    return any(np.array_equal(a, b) and len(np.unique(a)) >= SAME for a, b in both)


COPIED = Check(
    "same recording again",
    _copied,
    "One file may have been taken twice: correct file or column, or cut_s where parts overlap, unless it is what drove "
    "the trials.",
)


def _unit_of_emg(prepared: Prepared) -> str | None:
    """Channels whose largest envelope no surface EMG has, or that are far apart."""
    (low, high), one, forms = GAINS_UV, next(iter(prepared.recordings.values())).raw.emg, prepared.forms
    gains = {c: gain for c, gain in prepared.gains.items() if forms[c] != "fraction"}
    if odd := [f"{c} reaches {g:.2g} uV" for c, g in gains.items() if one[c].unit == "uV" and not low <= g <= high]:
        return f"the envelope of {', '.join(odd)}; surface EMG from {low:g} to {high:g} uV"
    largest = {c: float(prepared.trials.emg[..., i].max()) for i, c in enumerate(forms) if forms[c] == "fraction"}
    if few := [f"{c} reaches {size:.2g} at most" for c, size in largest.items() if 0 < size < LEAST_FRACTION]:
        return f"{', '.join(few)} of a maximum contraction"
    if gains and max(gains.values()) >= GAINS_APART * min(gains.values()):
        return "the largest envelopes are " + ", ".join(f"{gain:.2g} of {c}" for c, gain in gains.items())
    return None


def _alike(prepared: Prepared) -> str | None:
    trials = prepared.trials
    values = trials.emg[trials.valid]
    moves = [c for c in range(values.shape[1]) if values[:, c].std() > 0]
    pairs = [(a, b, float(np.corrcoef(values[:, a], values[:, b])[0, 1])) for a, b in combinations(moves, 2)]
    names = trials.channels
    told = [f"{names[a]} and {names[b]} have a correlation of {r:.3f}" for a, b, r in pairs if r > ALIKE]
    return "; ".join(told) + " over all trials" if told else None


def _tenths(prepared: Prepared) -> str | None:
    low, high = _ends_of_angle(prepared)
    return f"no trial leaves {low:.1f} to {high:.1f} deg" if max(-low, high) < TENTHS_DEG else None


def _never_straight(prepared: Prepared) -> str | None:
    low, high = _ends_of_angle(prepared)
    return f"from {low:.0f} to {high:.0f} deg over all trials, and never below {BENT_DEG:g}" if low > BENT_DEG else None


def _one_trains(prepared: Prepared) -> str | None:
    train, test = prepared.trials.train, prepared.trials.test
    return f"only {train[0]} to train on, and to test {', '.join(test)}" if len(train) == 1 else None


def _no_load(prepared: Prepared) -> str | None:
    trials = prepared.trials
    loads = [trials.conditions.get(name, {}).get("load") for name in trials.names]
    return f"said to be 0 kg in each of the {len(loads)} trials" if set(loads) == {0.0} else None


def _ends_of_angle(prepared: Prepared) -> tuple[float, float]:
    degrees = np.degrees(prepared.trials.angle)
    return float(degrees.min()), float(degrees.max())


SESSION = (
    Check("unit of the EMG", _unit_of_emg,
          "Is it uV that is called V or mV, or the other way round, or one channel in another unit? Correct the "
          "channel's unit under emg, or bring all channels to one unit in the files."),
    Check("channels alike", _alike,
          "One signal may be there under two names: correct file or column of one of them under emg."),
    Check("unit of the angle", _tenths,
          "An elbow moves farther: is it in tenths, in turns, or of another joint? Correct the column or its unit."),
    Check("never straight", _never_straight,
          "Is this 180 minus the angle? Where 180 is the straight arm, set sign: -1 and offset_deg: 180 of the "
          "angle."),
    Check("few trials", _one_trains,
          "What a load or an electrode changes between trials cannot be told from the muscles, and one test trial does "
          "not show how errors scatter: record four trials or more, or name fewer under test."),
    Check("load", _no_load,
          "Was the hand empty? Else say under conditions what was in it [kg]; what is not said is 0.", "note"),
)  # fmt: skip
