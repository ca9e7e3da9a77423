"""Whether a trial was sampled at one rate, and at one that recorders have."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from myowave.data.readers import RawRecording

STEP_TOLERANCE = 0.01
"""Jitter of the sampling allowed beyond the rounding of `time_s`, as a fraction of a step."""


SLOWEST, FASTEST, FASTEST_RAW = 0.1, 1 / 2500, 1 / 50_000
"""Longest step [s] of any recording, and shortest of a trial and of a raw recording; others are in another unit."""
SHORTEST_S = 0.4
"""Shortest trial [s]; no elbow motion is over so soon."""


def pace_problems(recording: RawRecording, time: NDArray[np.float64], column: str) -> Iterator[str]:
    """Times of a trial that are in another unit than seconds; arguments as in `time_problems`."""
    span = float(time[-1] - time[0])
    step = span / (len(time) - 1)
    remedy = "If the times are in ms or minutes, convert them to seconds"
    if not FASTEST <= step <= SLOWEST:
        yield (
            f"{recording.path}: {column} rises by {step:.4g} s from row to row; expected {FASTEST:g} to {SLOWEST:g} s. "
            f"{remedy}; else resample the file."
        )
    elif span < SHORTEST_S:
        yield f"{recording.path}: {column} spans {span:.3g} s; expected at least {SHORTEST_S:g} s. {remedy}."


def time_problems(recording: RawRecording, time: NDArray[np.float64], column: str) -> Iterator[str]:
    """The first sample where time goes back, leaps, or drifts away from even sampling.

    Args:
        recording: of one file, for messages.
        time: of its samples [s], finite, (N,).
        column: what the times are called there.
    """
    steps = np.diff(time)
    back = (steps <= 0).nonzero()[0]
    if len(back):
        n = back[0]
        how = "stays at" if steps[n] == 0 else "goes back from"
        change = f"{time[n]:g}" if steps[n] == 0 else f"{time[n]:g} to {time[n + 1]:g}"
        yield (
            f"{recording.at(n + 1)}: {column} {how} {change}. Trials must be sampled at one rate; resample the file, "
            f"or cut it at row {n + 1 + recording.first_row}."
        )
        return
    step = float(np.median(steps))
    allowed = STEP_TOLERANCE * step + min(_rounding(time), 0.1 * step)  # rounded steps differ by one unit at most
    uneven = (np.abs(steps - step) > allowed).nonzero()[0]
    even = time[0] + np.arange(len(time)) * (time[-1] - time[0]) / (len(time) - 1)
    adrift = (np.abs(time - even) > step / 2).nonzero()[0]
    if len(uneven):
        n = uneven[0]
        yield (
            f"{recording.at(n + 1)}: {column} goes from {time[n]:g} to {time[n + 1]:g}, a step of {steps[n]:.4g} s "
            f"({len(uneven)} such rows); expected {step:.4g} s like the others. Resample the file to one rate, or cut "
            "it there."
        )
    elif len(adrift):
        yield (
            f"{recording.at(adrift[0])}: {column} is {time[adrift[0]]:g}, more than half a step off even sampling "
            f"({even[adrift[0]]:.6g}): the rate drifts. Resample the file to one rate."
        )


def _rounding(time: NDArray[np.float64]) -> float:
    """The unit [s] to which times were rounded when written, 0 where there is none coarser than 1e-6."""
    units = (10.0**-digits for digits in range(7))
    return next((unit for unit in units if np.abs(time / unit - np.round(time / unit)).max() < 1e-6), 0.0)
