"""Doubts about EMG as the cause of motion: its clock, and the side of its muscle. Nothing is corrected in silence."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.signal import savgol_filter

from myowave.data.checks.finding import Check
from myowave.data.processing.sampled import sample_at
from myowave.data.recording import Prepared
from myowave.data.trials import TORQUE, Array

AHEAD_S = (0.0, 0.25)  # of EMG to the motion it causes [s]: delays of 30 to 150 ms, and what smoothing hides
LIKELIER_S = 4.0  # log of how much less variance another time leaves, times seconds; 2 % of good 30 s have more
_RATE_HZ = 50.0
_STEP_S = 0.02
LAGS_S = np.arange(-0.6, 0.6 + _STEP_S / 2, _STEP_S)
AGAINST, MOST_TRIALS = 0.15, 0.8
"""Share of the acceleration's scatter that EMG explains before its sign says something, and the share of trials that
agree [-]. A person's flexors have 0.21 to 0.24, those of simulated arms, each effect of the catalogue in them, 0.8 or
more."""
SIGNS = np.array([[1.0, 1.0, 1.0], [-1.0, -1.0, -1.0], [1.0, -1.0, -1.0]])
"""Of what EMG goes with in a trial, weight, speed and acceleration: as it should, with channels swapped or the angle's
sign turned, and with 180 minus the angle, whose sine is that of the angle."""
LIFTS = 0.5  # share of a measured torque that the weight and motion of any forearm explain, where muscles alone move it
SURE = 19.0  # to 1: what is told of one trial
ALL = ""
DELAY_S, SMOOTH_S = 0.08, 0.25  # of EMG before the motion, and of polynomials that differentiate the angle [s]


@dataclass(frozen=True, eq=False)
class Cause:
    """A session, and which way its EMG should move the forearm."""

    prepared: Prepared
    sides: Mapping[str, float]  # of the muscles that each channel drives, 1 for flexors, -1 for extensors, 0 for both


def _offset(of: Cause) -> str | None:
    """EMG that fits the motion best at a time by which it cannot cause it."""
    whole, seconds = _r2_by_lag(of.prepared)
    best = int(whole.argmax())
    likely = whole[np.abs(LAGS_S - np.mean(AHEAD_S)) <= np.ptp(AHEAD_S) / 2 + 1e-9].max()
    less, more = (max(1 - float(r2), 1e-9) for r2 in (whole[best], likely))  # variance that is left
    if seconds * np.log(more / less) <= LIKELIER_S:
        return None
    return (
        f"EMG fits the motion best {1000 * LAGS_S[best]:.0f} ms ahead of it (R² {whole[best]:.2f}, at "
        f"{1000 * AHEAD_S[0]:.0f} to {1000 * AHEAD_S[1]:.0f} ms {likely:.2f})"
    )


def _r2_by_lag(prepared: Prepared) -> tuple[Array, float]:
    """R2 of EMG by posture, speed and acceleration, and what the load needs for each, at each of `LAGS_S`, (lags,), of
    all trials in one fit for each channel and the mean of these; and how long the trials are together [s]."""
    motion, emg = [], []
    for name, one in prepared.recordings.items():
        angle, envelopes = one.raw.angle, one.envelopes.values()
        start = max([angle.start, *(e.start + LAGS_S[-1] for e in envelopes)])
        end = min([angle.end, *(e.end - LAGS_S[-1] for e in envelopes)])
        if len(time := np.arange(start, end, 1 / _RATE_HZ)) > 1:
            q = sample_at(angle, time)
            speed = np.gradient(q, 1 / _RATE_HZ)
            rate = np.gradient(speed, 1 / _RATE_HZ)  # of the speed
            needed = np.stack([q**0, q, q**2, q**3, speed, speed * q, speed**2, rate, rate * q], axis=1)
            load = prepared.trials.conditions.get(name, {}).get("load", 0.0)
            motion.append(np.concatenate([needed, load * needed], axis=1))
            emg.append(np.stack([np.interp(time - LAGS_S[:, None], e.time, e.values).T for e in envelopes]))
    if not motion:
        return np.zeros(len(LAGS_S)), 0.0
    x, channels = np.concatenate(motion), np.concatenate(emg, axis=1)
    return np.mean([_r2(x, y) for y in channels], axis=0), len(x) / _RATE_HZ


def _r2(x: Array, y: Array) -> Array:
    """Explained variance of each column of y (N, K) by the columns of x (N, P), (K,)."""
    left = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
    scatter = y.var(axis=0)
    return 1 - left.var(axis=0) / np.where(scatter > 0, scatter, 1.0)


def _against(of: Cause) -> str | None:
    """Flexors and extensors whose EMG moves the forearm as that of the other side would."""
    names, degrees = of.prepared.trials.channels, np.degrees(of.prepared.trials.angle)
    flexors, extensors = ([c for c in names if of.sides.get(c, 0) * side > 0] for side in (1, -1))
    told = [text for pair in product(flexors or [""], extensors or [""]) for text in _pair_against(of.prepared, *pair)]
    return "; ".join(told) + f"; the angle goes from {degrees.min():.0f} to {degrees.max():.0f} deg" if told else None


def _pair_against(prepared: Prepared, flexor: str, extensor: str) -> Iterator[str]:
    effort = effort_along_motion(prepared, flexor, extensor)
    together = effort.pop(ALL, np.zeros(2))
    # Muscles that pull together may give extensors the sign of flexors, but not more than half of these have then.
    swapped, *each = (flexed < extended / 2 for flexed, extended in (together, *effort.values()))
    share = np.mean(each or [False])
    where = ""
    if odd := _unlike_the_others(prepared, flexor, extensor, effort):
        where = f"in trial {', '.join(odd)} and no other"
    elif np.abs(together).max() >= AGAINST and swapped and share >= MOST_TRIALS:
        where = f"in {100 * share:.0f} % of the trials"
    if where:
        names = " and ".join(filter(None, (flexor, extensor)))
        yield f"EMG of {names} goes with the motion the wrong way round {where}"


def _unlike_the_others(prepared: Prepared, flexor: str, extensor: str, effort: Mapping[str, Array]) -> list[str]:
    """Trials whose flexor goes with the motion as extensors do in the others, and the other way round: with these
    turned back, in one of the ways of `SIGNS`, that all trials are alike is `SURE` times as likely."""
    if len(effort) < 3:  # of two nobody can say which
        return []
    ways, trials = np.empty((len(effort), 3)), prepared.trials
    leaning = trials.change_over_time("tilt")
    for way, (name, (flexing, extending)) in zip(ways, effort.items(), strict=True):
        one, place = prepared.recordings[name], trials.index([name])[0]
        vertical = one.angle + trials.condition("tilt", 0.0)[place]
        if leaning is not None:
            vertical = vertical + leaning[place, : len(vertical)]
        flexed, extended = (one.emg.get(channel, 0 * one.angle) for channel in (flexor, extensor))
        x = np.stack([np.sin(vertical), np.gradient(one.angle), flexed, extended])
        x = (x - x.mean(1, keepdims=True)) / x.std(1, keepdims=True).clip(1e-12)
        way[:] = *(x[:2] @ (x[2] - x[3]) / x.shape[1]), flexing - extending

    def evidence(signs: Array) -> float:
        # ASSUME: trials scatter normally, in weight, speed and acceleration by themselves; that one is odd, in either
        # way, is beforehand as likely as that none is.
        spread, odd = (signs * ways).std(0).clip(1e-12), (signs < 0).any(1).sum()
        return float(-(len(signs) - 1) * np.log(spread).sum() - odd * np.log(len(signs) * (len(SIGNS) - 1)))

    as_is = best = np.ones(ways.shape)
    trial = np.eye(len(ways), dtype=bool)[..., None]
    for _ in ways:
        best = max((np.where(one, sign, best) for one in trial for sign in SIGNS), key=evidence)
    sure = evidence(best) - evidence(as_is) > np.log(SURE)
    return [name for name, sign in zip(effort, best, strict=True) if sure and (sign < 0).any()]


def effort_along_motion(prepared: Prepared, flexor: str, extensor: str) -> dict[str, Array]:
    """What the EMG of a flexor and of an extensor does to the motion, in all trials together (`ALL`) and in each.

    The forearm's acceleration is explained by both, gravity at any offset of the angle (sin q, cos q) and the speed:
    returned are standardised coefficients, positive towards flexion, 0 of a muscle that is not there ("").
    """
    # ASSUME: EMG is ahead of the motion by 80 ms; that the muscles' force depends on posture changes no sign.
    rows = {}
    for name, one in prepared.recordings.items():
        window, late = max(5, round(SMOOTH_S / one.dt) | 1), round(DELAY_S / one.dt)
        if len(one.angle) < 4 * window + late:
            continue
        q, speed, acceleration = (savgol_filter(one.angle, window, 3, deriv=n, delta=one.dt) for n in range(3))
        emg = [savgol_filter(one.emg.get(channel, 0 * q), window, 3) for channel in (flexor, extensor)]
        force = [np.roll(each, late) for each in emg]
        x = np.stack([*force, np.sin(q), np.cos(q), speed, acceleration], axis=1)[window + late : -window]
        rows[name] = (x - x.mean(0)) / max(x[:, -1].std(), 1e-12)
    parts = {ALL: np.concatenate([*rows.values()]), **rows} if rows else {}
    known = {name: (x[:, :-1], x[:, -1]) for name, x in parts.items()}
    return {name: (np.linalg.lstsq(x, y, rcond=None)[0] * x.std(0))[:2] for name, (x, y) in known.items()}


def _torque(of: Cause) -> str | None:
    """A measured torque that does not lift and speed up a forearm; weight may pull from any side."""
    turned, apart = [], []
    for name, one in of.prepared.recordings.items():
        torque, window = one.signals.get(TORQUE), max(5, round(SMOOTH_S / one.dt) | 1)
        if torque is None or len(torque) < 4 * window:
            continue
        q, speed, acceleration = (savgol_filter(one.angle, window, 3, deriv=n, delta=one.dt) for n in range(3))
        x = np.stack([np.sin(q), np.cos(q), acceleration, speed, q**0], axis=1)[window:-window]
        y = savgol_filter(torque, window, 3)[window:-window]
        weight, _, inertia, *_ = np.linalg.lstsq(x, y, rcond=None)[0]
        if _r2(x, y[:, None])[0] < LIFTS:
            apart.append(name)
        elif weight < 0 and inertia < 0:
            turned.append(name)
    told = "the torque falls where weight and acceleration need more, in trial " + ", ".join(turned) if turned else ""
    other = "weight and motion say little of the torque in trial " + ", ".join(apart) if apart else ""
    return "; ".join(filter(None, (told, other))) or None


CAUSE = (
    Check("synchronisation", _offset,
          "EMG and angle may be recorded apart in time, or motion and EMG may simply go on alike: clap or tap at the "
          "start of a recording to see it, and say processing.emg_start_offset_s. Nothing was shifted here."),
    Check("torque against the motion", _torque,
          "Is it counted the other way (torque: sign: -1)? If a dynamometer held or moved the arm, leave the trial "
          "out: in the model muscles alone move it."),
    Check("EMG against the motion", _against,
          "Are the channels swapped (emg), is the angle counted the other way (sign: -1), or is 180 the straight arm "
          "(sign: -1 and offset_deg: 180)? If only in some trials, correct their files. Or was the upper arm held "
          "otherwise there (conditions: tilt)? Or did EMG begin 0.3 s or more before or after the angle "
          "(processing.emg_start_offset_s)?"),
)  # fmt: skip
