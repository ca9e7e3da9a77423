"""All doubts about a session: of each signal, and of trials and channels side by side."""

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from myowave.data.checks import clocks, emg, motion
from myowave.data.checks.finding import Check, Finding
from myowave.data.checks.values import EMG_LIMIT
from myowave.data.recording import Prepared

GAINS_UV = (3.0, 1e4)
"""Envelope of surface EMG at its largest [uV]: amplifiers have 1 to 3 uV of noise, muscles give 5 mV at most."""
GAINS_APART = 300.0
"""How far apart the largest envelopes of two channels are from which one is in another unit [-]."""
LEAST_FRACTION = 0.01
"""Largest EMG of a channel, as a fraction of a maximum contraction, below which it is in another unit [-]."""
ALIKE = 0.995
"""Correlation of two envelopes over a session from which they hold one signal [-]."""
SAME = 50
"""Different values that a signal has which is in two trials alike, from which it was copied [-]."""
TENTHS_DEG, BENT_DEG = 20.0, 90.0
"""An elbow that no trial takes beyond the first is in another unit; one that none takes below the second [deg]."""
AGAINST, MOST_TRIALS = 0.15, 0.8
"""Share of the acceleration's scatter that EMG explains before its sign says something, and the share of trials that
agree [-]. A person's flexors have 0.27, those of simulated arms, each effect of the catalogue in them, 0.8 or more."""
DELAY_S, SMOOTH_S = 0.08, 0.25
"""Of EMG before the motion, and window of the polynomials that differentiate the angle [s]."""


def find_faults(prepared: Prepared, notch_hz: float | None, sides: Mapping[str, float]) -> Iterator[Finding]:
    """All findings of what was prepared, those about the session last.

    Args:
        notch_hz: of mains hum that the processing takes out [Hz].
        sides: of the muscles that each channel drives, 1 for flexors, -1 for extensors, 0 for both.
    """
    raw, forms = prepared.raw, prepared.forms
    typical = {c: float(np.median([trial.emg[c].values.std() for trial in raw.values()])) for c in forms}
    for name, trial in raw.items():
        for channel, signal in trial.emg.items():
            what = emg.Channel(signal, prepared.envelopes[name][channel], forms[channel], typical[channel], notch_hz)
            dead = list(emg.DEAD_CHANNEL.of(what, name, channel))
            yield from dead
            for check in () if dead else (*emg.CHECKS, *(emg.RAW_CHECKS if what.form == "raw" else ())):
                yield from check.of(what, name, channel)
            yield from clocks.DURATIONS.of((signal, trial.angle), name, channel)
        yield from emg.CROSS_TALK.of({c: s for c, s in trial.emg.items() if forms[c] == "raw"}, name)
        for check in motion.ELBOW if forms else ():  # a machine goes where no elbow does
            yield from check.of(trial.angle, name, "angle")
        for key, signal in trial.signals.items():
            for check in motion.EXTRA:
                yield from check.of(signal, name, key)
    yield from clocks.offset_and_drift(raw, prepared.envelopes)
    for check in SESSION if forms else ():
        yield from check.of(prepared)
    yield from _copied(prepared)
    yield from AGAINST_MOTION.of((prepared, sides))
    yield from _above_one(prepared)


def _gains(prepared: Prepared) -> dict[str, float]:
    """The envelope that counts as 1, of channels in volts."""
    emg_of_first = next(iter(prepared.raw.values())).emg
    return {c: gain for c, gain in prepared.gains.items() if emg_of_first[c].unit == "uV"}


def _unit_of_emg(prepared: Prepared) -> str | None:
    low, high = GAINS_UV
    odd = [f"{c} reaches {gain:.2g} uV" for c, gain in _gains(prepared).items() if not low <= gain <= high]
    return f"the envelope of {', '.join(odd)}; surface EMG from {low:g} to {high:g} uV" if odd else None


def _one_other_unit(prepared: Prepared) -> str | None:
    if _unit_of_emg(prepared):
        return None
    given, forms = prepared.gains, prepared.forms
    fractions = {c: float(prepared.trials.emg[..., i].max()) for i, c in enumerate(forms) if forms[c] == "fraction"}
    if low := [f"{c} reaches {size:.2g} at most" for c, size in fractions.items() if 0 < size < LEAST_FRACTION]:
        return f"{', '.join(low)} of a maximum contraction"
    gains = {c: gain for c, gain in given.items() if c not in fractions}
    if not gains or max(gains.values()) < GAINS_APART * min(gains.values()):
        return None
    return "the largest envelopes are " + ", ".join(f"{gain:.2g} of {c}" for c, gain in gains.items())


def _alike(prepared: Prepared) -> str | None:
    trials = prepared.trials
    values = trials.emg[trials.valid]
    moves = [c for c in range(values.shape[1]) if values[:, c].std() > 0]
    pairs = [(a, b, float(np.corrcoef(values[:, a], values[:, b])[0, 1])) for a, b in combinations(moves, 2)]
    names = trials.channels
    told = [f"{names[a]} and {names[b]} have a correlation of {r:.3f}" for a, b, r in pairs if r > ALIKE]
    return "; ".join(told) + " over all trials" if told else None


def _ends_of_angle(prepared: Prepared) -> tuple[float, float]:
    degrees = np.degrees(prepared.trials.angle)
    return float(degrees.min()), float(degrees.max())


def _tenths(prepared: Prepared) -> str | None:
    low, high = _ends_of_angle(prepared)
    return f"no trial leaves {low:.1f} to {high:.1f} deg" if max(-low, high) < TENTHS_DEG else None


def _never_straight(prepared: Prepared) -> str | None:
    low, high = _ends_of_angle(prepared)
    return f"from {low:.0f} to {high:.0f} deg over all trials, and never below {BENT_DEG:g}" if low > BENT_DEG else None


SESSION = (
    Check("unit of the EMG", _unit_of_emg,
          "Is it uV that is called V or mV, or the other way round? Correct the channel's unit under emg, or the "
          "file."),
    Check("one channel in another unit", _one_other_unit,
          "Name the channel's unit under emg, or bring all channels to one unit in the files."),
    Check("channels alike", _alike,
          "One signal may be there under two names: correct file or column of one of them under emg."),
    Check("unit of the angle", _tenths,
          "An elbow moves farther: is it in tenths, in turns, or of another joint? Correct the column or its unit."),
    Check("never straight", _never_straight,
          "Is this 180 minus the angle? Where 180 is the straight arm, set sign: -1 and offset_deg: 180 of the "
          "angle."),
)  # fmt: skip
"""Of everything that was prepared."""


def _copied(prepared: Prepared) -> Iterator[Finding]:
    """Signals that are, sample for sample, those of an earlier trial."""
    for (one, a), (two, b) in combinations(prepared.raw.items(), 2):
        if a.cut != b.cut:  # parts of one recording
            continue
        for key, x in {**a.emg, "angle": a.angle}.items():
            y = b.angle if key == "angle" else b.emg[key]
            samples = min(len(x.values), len(y.values))
            same = np.array_equal(x.values[:SAME], y.values[:SAME])
            if same and np.array_equal(x.values[:samples], y.values[:samples]) and len(set(x.values)) >= SAME:
                found = f"the same samples as in trial {one}"
                do = "One file may have been taken twice: correct file or column, unless it is what drove the trials."
                yield Finding("same recording again", found, do, two, key)


def effort_along_motion(prepared: Prepared, sides: Mapping[str, float]) -> NDArray[np.float64]:
    """What the EMG of flexors and of extensors does to the motion: of all trials together, then of each, (1 + T, 2).

    The forearm's acceleration is explained by the mean EMG of each group, gravity at any offset of the angle (sin q,
    cos q) and the speed: returned are standardised coefficients, positive towards flexion, 0 where a group has no EMG.
    """
    # ASSUME: EMG is ahead of the motion by 80 ms; that the muscles' force depends on posture changes no sign.
    trials, rows = prepared.trials, []
    side = np.array([sides.get(channel, 0.0) for channel in trials.channels])
    window, late = max(5, round(SMOOTH_S / trials.dt) | 1), round(DELAY_S / trials.dt)
    for i, samples in enumerate(trials.lengths):
        if samples < 4 * window + late:
            continue
        q, speed, acceleration = (
            savgol_filter(trials.angle[i, :samples], window, 3, deriv=n, delta=trials.dt) for n in range(3)
        )
        emg = [trials.emg[i, :samples, group].sum(0) for group in (side > 0, side < 0)]
        force = [np.roll(savgol_filter(each, window, 3), late) for each in emg]
        x = np.stack([*force, np.sin(q), np.cos(q), speed, acceleration], axis=1)[window + late : -window]
        rows.append((x - x.mean(0)) / max(x[:, -1].std(), 1e-12))
    return np.array([_standardised(x)[:2] for x in ([np.concatenate(rows), *rows] if rows else [])]).reshape(-1, 2)


def _standardised(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients of the last column by the others, times these' standard deviations."""
    return np.linalg.lstsq(x[:, :-1], x[:, -1], rcond=None)[0] * x[:, :-1].std(0)


def _against(what: tuple[Prepared, Mapping[str, float]]) -> str | None:
    effort = effort_along_motion(*what)
    # Muscles that pull together may give extensors the sign of flexors, but not more than half of these have then.
    against = effort[:, 0] < effort[:, 1] / 2
    if not len(effort) or not against[0] or np.abs(effort[0]).max() < AGAINST or against[1:].mean() < MOST_TRIALS:
        return None
    (flexors, extensors), (low, high) = effort[0], _ends_of_angle(what[0])
    return (
        f"flexors' EMG explains {flexors:.2f} and extensors' {extensors:.2f} of the acceleration towards flexion, in "
        f"{against[1:].mean():.0%} of the trials the wrong way round; the angle goes from {low:.0f} to {high:.0f} deg"
    )


AGAINST_MOTION = Check(
    "EMG against the motion",
    _against,
    "Are the channels swapped (emg), is the angle counted the other way (sign: -1), or is 180 the straight arm "
    "(sign: -1 and offset_deg: 180)?",
)
"""Of what was prepared, and of the sides of its channels."""


def _above_one(prepared: Prepared) -> Iterator[Finding]:
    """EMG of trials that is more than what counts as 1."""
    trials = prepared.trials
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
