"""Doubts about the clocks of EMG and motion. They are told, never corrected in silence."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from myowave.data.checks.finding import Check, Finding
from myowave.data.processing.grid import sample_at
from myowave.data.processing.sampled import Sampled
from myowave.data.recording import RawTrial

ENDS_S, ENDS_SHARE = 0.05, 0.001
"""Difference of the durations of EMG and angle that is told: at least 50 ms, and 0.1 % of them."""
AHEAD_S = (0.0, 0.25)
"""Time by which EMG is ahead of the motion it causes [s]: delays of 30 to 150 ms, and what smoothing hides."""
DRIFT_S = 0.2
"""Change of that time from the first to the last part of a trial that is told [s]."""
BETTER = 0.02
"""Explained variance that another time has to add [-]."""
_RATE_HZ = 50.0
_STEP_S = 0.02
_LAGS_S = np.arange(-0.6, 0.6 + _STEP_S / 2, _STEP_S)


def _durations(both: tuple[Sampled, Sampled]) -> str | None:
    emg_s, angle_s = (len(s.values) / s.rate for s in both)
    apart = abs(emg_s - angle_s) > max(ENDS_S, ENDS_SHARE * angle_s)
    return f"EMG lasts {emg_s:.3f} s, the angle {angle_s:.3f} s" if apart else None


DURATIONS = Check(
    "durations",
    _durations,
    "Where both were started and stopped together, a rate is wrong or a clock drifts: compare rate_hz with the "
    "recorder's. Otherwise say processing.emg_start_offset_s; only the common time is used.",
)
"""Of EMG and angle that do not begin and end together although they were started together."""


def offset_and_drift(raw: Mapping[str, RawTrial], envelopes: Mapping[str, Mapping[str, Sampled]]) -> Iterator[Finding]:
    """EMG that fits the motion best at a time by which it cannot cause it, or at one that changes within trials.

    Envelopes are explained by posture, speed and acceleration, at each of several shifts; all trials and channels
    count together. It is a weak test: what a muscle does is not told by the motion only.
    """
    shifts = [_explained(trial.angle, envelope) for n, trial in raw.items() for envelope in envelopes[n].values()]
    shifts = np.array([one for one in shifts if one is not None])
    if not len(shifts):
        return
    whole, first, last = shifts.mean(axis=0)
    best = int(whole.argmax())
    likely = whole[np.abs(_LAGS_S - np.mean(AHEAD_S)) <= np.ptp(AHEAD_S) / 2 + 1e-9].max()
    if whole[best] > likely + BETTER:
        yield Finding(
            "offset of clocks",
            f"EMG fits the motion best {1000 * _LAGS_S[best]:.0f} ms ahead of it (R2 {whole[best]:.2f}, at "
            f"{1000 * AHEAD_S[0]:.0f} to {1000 * AHEAD_S[1]:.0f} ms {likely:.2f})",
            "The clocks may differ, or motion and EMG may simply go on alike: clap or tap at the start of a recording "
            "to see it, and say processing.emg_start_offset_s. Nothing was shifted here.",
        )
    change = float(_LAGS_S[last.argmax()] - _LAGS_S[first.argmax()])
    gain = min(_gain(first, last), _gain(last, first))
    if abs(change) > DRIFT_S + _STEP_S / 2 and gain > BETTER:
        yield Finding(
            "drift of clocks",
            f"the best fit of EMG to motion moves by {1000 * change:.0f} ms from the first to the last third of trials",
            "A clock may run faster than the other, or the muscles may be used in another way towards the end: compare "
            "the stated rates with those of the recorders. Nothing was stretched here.",
        )


def _gain(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """What the best shift of `one` adds there over the best shift of `other`."""
    return float(one.max() - one[other.argmax()])


def _explained(angle: Sampled, envelope: Sampled) -> NDArray[np.float64] | None:
    """R2 at each of `_LAGS_S` over the whole trial, its first and its last third, (3, shifts); None where too short."""
    reach = float(_LAGS_S.max())
    start, end = max(angle.start, envelope.start + reach), min(angle.end, envelope.end - reach)
    time = np.arange(start, end, 1 / _RATE_HZ)
    if len(time) < 8 * _RATE_HZ:
        return None
    q = sample_at(angle, time)
    speed = np.gradient(q, 1 / _RATE_HZ)
    acceleration = np.gradient(speed, 1 / _RATE_HZ)
    x = np.stack([np.ones_like(q), q, q**2, q**3, speed, speed * q, speed**2, acceleration, acceleration * q], axis=1)
    third = len(time) // 3
    parts = [slice(None), slice(0, third), slice(len(time) - third, None)]
    emg = np.stack([np.interp(time - lag, envelope.time, envelope.values) for lag in _LAGS_S], axis=1)
    return np.stack([_r2(x[part], emg[part]) for part in parts])


def _r2(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Explained variance of each column of y (N, K) by the columns of x (N, P), (K,)."""
    left = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
    scatter = y.var(axis=0)
    return 1 - left.var(axis=0) / np.where(scatter > 0, scatter, 1.0)
