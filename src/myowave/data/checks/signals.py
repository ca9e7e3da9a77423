"""Whether a signal holds a finite number everywhere, was sampled at one rate, and at one that recorders have."""

from dataclasses import dataclass

import numpy as np

from myowave.data.readers import RawRecording, Signal
from myowave.data.readers.signals import adrift, uneven
from myowave.data.trials import Array

RATE_TOLERANCE = 0.005  # largest relative difference of two rates that counts as rounding


@dataclass(frozen=True)
class Pace:
    """Rates [Hz] that a recording may have, as others are of times in another unit; and its shortest duration [s]."""

    slowest: float
    fastest: float
    shortest_s: float


RAW = Pace(slowest=10.0, fastest=50_000.0, shortest_s=2.0)  # filters need some seconds
TIDY = Pace(slowest=10.0, fastest=2500.0, shortest_s=0.4)  # no elbow motion is over so soon
_RESAMPLE = "Resample the file to one rate, as layout.resample_hz does with tables of text"


def signal_problem(raw: RawRecording, signal: Signal, rate_hz: float | None, pace: Pace) -> str | None:
    """What makes a signal of a file unusable; `rate_hz` is what the settings state [Hz], `pace` what it may be."""
    if signal.odd:
        sample, found = next(iter(signal.odd.items()))
        do = "Fill the gap, or cut the file there; or leave out such rows, 0.1 s at most, and set layout.resample_hz."
        if isinstance(found, str) and "," in found:
            do = "Write decimals with a point."
        elif len(signal.odd) == len(signal.values):
            do = "Was the sensor off? Leave the trial out, or the signal."
        elif sample + len(signal.odd) == len(signal.values):
            do = "Cut the file there. A column that ends since its rate is another needs times of its own: time_angle."
        return (
            f"{raw.at(sample, signal)}: {signal.name} is {found if isinstance(found, float) else repr(found)} "
            f"({len(signal.odd)} such rows); expected a finite number. {do}"
        )
    if len(signal.values) < 2:
        return f"{raw.path}: {len(signal.values)} samples; expected at least {pace.shortest_s:g} s of them."
    if signal.time is not None and (problem := _time_problem(raw, signal, signal.time)):
        return problem
    stated = {"the file": signal.rate, "rate_hz": rate_hz, "its times": signal.rate_by_time}
    rates = {name: rate for name, rate in stated.items() if rate is not None}
    if not rates:
        return f"{raw.path}: {signal.name} has neither times nor a rate; give rate_hz, or its times' column in layout."
    for name, rate in rates.items():
        if not pace.slowest <= rate <= pace.fastest:
            return (
                f"{raw.path}: {rate:.4g} Hz by {name}; expected {pace.slowest:g} to {pace.fastest:g}. If its times are "
                "in ms, call their column time_ms, or say layout.time_unit: ms (sample where they count these); if in "
                "minutes, convert them to seconds; else correct the rate, or resample the file."
            )
    slowest, fastest = min(rates.values()), max(rates.values())
    if fastest / slowest - 1 > RATE_TOLERANCE:
        said = ", ".join(f"{rate:g} Hz by {name}" for name, rate in rates.items())
        return f"{raw.path}: {signal.name} has {said}; expected one rate. Correct rate_hz, or export the file again."
    if len(signal.values) < pace.shortest_s * slowest:
        return (
            f"{raw.path}: {len(signal.values)} samples in {len(signal.values) / slowest:.3g} s; expected at least "
            f"{pace.shortest_s:g} s. If its times are in ms or minutes, convert them to seconds; else record longer, "
            "or leave the trial out."
        )
    return None


def _time_problem(raw: RawRecording, signal: Signal, time: Array) -> str | None:
    """Where time [s], (N,), is no number, goes back, leaps, or drifts away from even sampling."""
    if len(odd := np.flatnonzero(~np.isfinite(time))):
        where = raw.at(odd[0], signal)
        return f"{where}: the time is no finite number ({len(odd)} such rows). Write seconds as 0.01; fill or cut gaps."
    steps = np.diff(time)
    if len(back := np.flatnonzero(steps <= 0)):
        n, where = back[0], raw.at(back[0] + 1, signal)
        how = f"stays at {time[n]:.10g}" if steps[n] == 0 else f"goes back from {time[n]:.10g} to {time[n + 1]:.10g}"
        return (
            f"{where}: time {how} ({len(back)} such rows). Trials must be sampled at one rate, their times written "
            f"with all digits; export or resample the file, or cut it at {where.rpartition(', ')[2]}."
        )
    if len(odd := uneven(time)):
        n = odd[0]
        return (
            f"{raw.at(n + 1, signal)}: time goes from {time[n]:.10g} to {time[n + 1]:.10g}, a step of {steps[n]:.4g} s "
            f"({len(odd)} such rows); expected {np.median(steps):.4g} s like the others. {_RESAMPLE}, or cut it there."
        )
    if len(off := adrift(time)):
        n, even = off[0], np.linspace(time[0], time[-1], len(time))
        return (
            f"{raw.at(n, signal)}: time is {time[n]:g}, more than half a step off even sampling ({even[n]:.6g}): the "
            f"rate drifts. {_RESAMPLE}."
        )
    return None
