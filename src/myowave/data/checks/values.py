"""Whether EMG, angles and torque are those of an elbow, and whether trials go together.

What is found makes an answer wrong.
"""

import math
from collections.abc import Collection, Iterator, Mapping

import numpy as np

from myowave.data.checks.finding import Finding
from myowave.data.checks.signals import RATE_TOLERANCE
from myowave.data.recording import Recording
from myowave.data.trials import TORQUE, Array, Trials
from myowave.physics.path import read_path
from myowave.settings import PathTable

EMG_LIMIT = 1.5  # largest EMG taken as a fraction of a maximum contraction [-]; more was not normalised
UNSEEN_LIMIT = 5.0
"""The same of a trial held out, or of a stream: light loads may train and a heavy one test; percent would be more."""
UNDERSHOOT = 0.1  # of rectified EMG below 0, as a share of its largest value, that filters and splines leave [-]
PERCENT_LIMIT = 200.0  # largest EMG that may be in percent [-]
HALF_TURN_DEG = 180.0
STILL = 5e-5
"""An angle [deg] or a torque [N m] that stays within this was not measured: an arm trembles even where it holds
still, and filters leave no more of a constant."""
TORQUE_LIMIT = 300.0  # largest torque about an elbow [N m]; more is in another unit


def has_sign(lowest: float, largest: float) -> bool:
    """Whether EMG with these values goes farther below 0 than rectified EMG does, of which such samples count as 0."""
    return lowest < -UNDERSHOOT * largest


def value_problems(
    recordings: Mapping[str, Recording], forms: Mapping[str, str], test: Collection[str]
) -> Iterator[str]:
    """What no recordings of an arm hold.

    Args:
        forms: {channel: raw, envelope or fraction} of those whose maximum contraction is known.
        test: trials that are held out; they may be of more effort than those which train.
    """
    yield from _rate_problems(recordings)
    yield from _duplicate_problems(recordings)
    for channel, form in forms.items():
        yield from _emg_problems(recordings, channel, form, test)
    for one in recordings.values():
        yield from _odd_problems(one)


def _rate_problems(recordings: Mapping[str, Recording]) -> Iterator[str]:
    common = float(np.median([recording.dt for recording in recordings.values()])) if recordings else 0.0
    for recording in recordings.values():
        if abs(recording.dt / common - 1) > RATE_TOLERANCE:
            yield (
                f"{recording.origin}: sampled every {recording.dt:.4g} s; expected {common:.4g} s like the other "
                "trials. Resample all trials to one rate."
            )


def _duplicate_problems(recordings: Mapping[str, Recording]) -> Iterator[str]:
    seen: dict[bytes, Recording] = {}
    for recording in recordings.values():
        content = b"".join(values.tobytes() for values in (*recording.emg.values(), recording.angle))
        first = seen.setdefault(content, recording)
        if first is not recording:
            yield (
                f"{recording.origin}: the same samples as {first.origin}. A trial that is there twice counts twice, "
                "and may both train and test; remove one."
            )


def _emg_problems(recordings: Mapping[str, Recording], channel: str, form: str, test: Collection[str]) -> Iterator[str]:
    """EMG that is no fraction of a maximum: in one line where it is so in most trials, else in each trial."""
    typical = float(np.median([one.emg[channel].max() for one in recordings.values()])) if recordings else 0.0
    if form == "fraction" and typical > EMG_LIMIT:
        # Percent and a weak contraction in uV are as large.
        percent = _PERCENT if typical <= PERCENT_LIMIT else ""
        yield (
            f"{channel} reaches {typical:.3g} of a maximum contraction in most of the {len(recordings)} trials; "
            f"expected 0 to {EMG_LIMIT:g}. {percent}{_NORMALISE}"
        )
        return
    for name, one in recordings.items():
        emg = one.emg[channel]
        limit = UNSEEN_LIMIT if name in test and form == "fraction" else EMG_LIMIT
        outside = np.maximum(-emg, emg - limit)
        n = int(outside.argmax())
        if outside[n] > 0:
            yield (
                f"{one.at(n)}: {channel} is {emg[n]:.3g} of a maximum contraction ({(outside > 0).sum()} samples "
                f"outside; it spans {emg.min():.3g} to {emg.max():.3g}); expected 0 to {limit:g}. "
                f"{_NORMALISE if form == 'fraction' else _ARTEFACT}"
            )


_NORMALISE = "Rectify and smooth the EMG, and divide it by its value at maximum contraction (percent by 100)."
_PERCENT = "If it is in percent, divide it by 100, or write [%] behind its column's name. Else it is not normalised: "
_ARTEFACT = "Look for an artefact there and cut it off with cut_s, or name a stronger contraction under mvc."


def _odd_problems(one: Recording) -> Iterator[str]:
    """An arm beyond half a turn, an angle that is still or looks like the other unit, a torque that no elbow gives."""
    angle, unit = np.degrees(one.angle), one.raw.angle.written
    named = "If it was written in deg, name that unit (or call the column angle_deg); else correct sign or offset_deg."
    straight = "Correct its unit, sign or offset_deg; where 180 is the straight arm, sign: -1 and offset_deg: 180."
    far = straight if unit == "deg" else named
    still = "The sensor was off, or the column is another one: correct it, or leave the trial out."
    most = HALF_TURN_DEG if one.emg else math.inf  # a machine may turn over
    odd = list(_odd(one, "the angle", angle, "deg", most, far, still))
    yield from odd
    if not odd and unit == "deg" and np.abs(angle).max() < math.pi:
        yield (
            f"{one.origin}: the angle goes from {angle.min():.4g} to {angle.max():.4g} deg, which no elbow motion does."
            " If it was written in rad, name that unit (or call the column angle_rad)."
        )
    for key, values in one.signals.items():
        if one.raw.signals[key].unit == "rad":
            far = "Correct its unit (deg or rad), sign or offset_deg."
            yield from _odd(one, key, np.degrees(values), "deg", HALF_TURN_DEG, far)
        elif key == TORQUE:
            far = "Correct its unit: N cm and N mm are others."
            still = "The dynamometer was off: remove the column, or leave the trial out of torque.trials."
            yield from _odd(one, "the torque", values, "N m", TORQUE_LIMIT, far, still)


def _odd(
    one: Recording, what: str, values: Array, unit: str, limit: float, far: str, still: str | None = None
) -> Iterator[str]:
    """Values (N,) beyond a limit, or that never change; `far` and `still` say what to do, None lets them be still."""
    n, span = int(np.abs(values).argmax()), f"it goes from {values.min():.4g} to {values.max():.4g}"
    if abs(values[n]) > limit:
        found = f"{what} is {values[n]:.4g} {unit} ({span})"
        yield f"{one.at(n)}: {found}; expected -{limit:g} to {limit:g}. {far}"
    elif still and np.ptp(values) < STILL:
        yield f"{one.origin}: {what} stays at {values[0]:.4g} {unit} in all {len(values)} samples. {still}"


def beyond_tables(trials: Trials, tables: Mapping[str, PathTable]) -> tuple[list[Finding], list[str]]:
    """What is found of trials that leave the range of a table of a muscle's path, and problems of those that leave one
    too far; a ValueError for a faulty table."""
    ranges = {muscle: np.degrees(read_path(table.file, table.muscle).range) for muscle, table in tables.items()}
    findings, problems = [], []
    for trial, angles, length in zip(trials.names, np.degrees(trials.angle), trials.lengths, strict=True):
        angle = angles[:length]
        outside = {muscle: np.maximum(low - angle, angle - high) for muscle, (low, high) in ranges.items()}
        if not any((out > 0).any() for out in outside.values()):
            continue
        muscle = max(outside, key=lambda m: outside[m].max() - tables[m].margin_deg)
        n, table, (low, high) = int(outside[muscle].argmax()), tables[muscle], ranges[muscle]
        share, distance = np.any([out > 0 for out in outside.values()], axis=0).mean(), outside[muscle][n]
        found = f"{100 * share:.2g} % of the samples are beyond the tables of path lengths, up to {distance:.3g} deg"
        found += "; moment arms there are those at the tables' ends"
        do = "Doubt torques at these angles: extend the tables if the muscles' paths are known there."
        findings.append(Finding("angle beyond the tables", found, do, trial, "angle", "note"))
        if distance - table.margin_deg > 1e-9:  # rounding of degrees decides nothing
            problems.append(
                f"trial {trial}: the angle is {angle[n]:.4g} deg, {distance:.3g} deg beyond the table of muscle "
                f"{muscle} ({table.file}, {low:.4g} to {high:.4g} deg); expected at most {table.margin_deg:g} deg "
                "beyond. Is it in rad (unit), or is 180 the straight arm (sign: -1, offset_deg: 180)? Correct it. Else "
                "cut the trial, extend the table, or raise the path's margin_deg if the moment arm may be taken as "
                "constant so far."
            )
    return findings, problems
