"""Angles that were resampled along straight lines: where they were measured, and what lies in between.

Shapes: N samples of a trial, Q knots from its first sample or before it to its last one or behind it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.sparse import csr_array

from myowave.data.trials import Array

STRAIGHT = 1e-8  # of the largest second difference: less is rounding
ROUNDED = 2.01  # times the finest step of values that were rounded: their second differences are off by up to 2
MOST_KINKS, WRONG_KINKS = 0.95, 0.05  # of second differences, and of those that kink
ON_SAMPLE = 1e-4  # samples: a knot so near to one kinks there alone


def knots_of(angles: Sequence[Array]) -> list[Array] | None:
    """Places (Q_i,), in samples, where angles (N_i,) were measured, evenly spaced in all, where they run straight in
    between and kink at no other place; None where they do not."""
    bends = [np.diff(angle, 2) for angle in angles]
    sizes = np.abs(np.concatenate(bends))
    finest = np.diff(np.unique(np.concatenate(angles))).min(initial=np.inf)
    least = max(STRAIGHT * sizes.max(initial=0.0), ROUNDED * finest)
    kinked, kinks = [np.abs(bend) > least for bend in bends], sizes[sizes > least]
    sure = [_sure_knots(bend, own) for bend, own in zip(bends, kinked, strict=True)]
    apart = max(late - early for early, late in sure)
    if not apart or len(kinks) >= MOST_KINKS * len(sizes):
        return None
    near = max(ON_SAMPLE, float(2 * least / np.median(kinks)))  # where rounding hides the kink of the other sample
    most = len(kinks) / len(sizes) * apart
    numbers = np.arange(max(1, int(0.45 * most)), int(1.1 * most) + 2)  # each knot kinks once or twice

    def wrong(step: float) -> float:
        found = [_kinks(len(own), early % step, step, near) for own, (early, _) in zip(kinked, sure, strict=True)]
        return np.count_nonzero(np.concatenate(found) != np.concatenate(kinked)) / len(kinks)

    step = float(min(apart / numbers, key=wrong))
    if wrong(step) >= WRONG_KINKS:
        return None
    return [_all_knots(len(angle), early % step, step, near) for angle, (early, _) in zip(angles, sure, strict=True)]


def _sure_knots(bend: Array, kinked: NDArray[np.bool_]) -> tuple[float, float]:
    """Places of an early and a late knot of a trial, those that are known best; the same one where it shows no two."""
    begins = np.flatnonzero(kinked[1:-1] > kinked[:-2]) + 1  # of runs of kinks
    if len(begins) < 2:
        return 0.0, 0.0
    # Samples bend by as much as a knot is near, which tells where one is that bends much.
    early, late = (max(half, key=lambda begin: abs(bend[begin])) for half in np.array_split(begins, 2))
    return _place(bend, early), _place(bend, late)


def _place(bend: Array, begin: int) -> float:
    """Where the knot is at which a run of kinks begins."""
    before, behind = np.abs(bend[begin : begin + 2])
    return float(begin + 1 + behind / (before + behind))


def _all_knots(samples: int, begin: float, step: float, near: float) -> Array:
    """Places of all knots of a trial, the first of which that is not before its first sample is at `begin`."""
    first = begin - step if begin > near else begin
    return first + step * np.arange(np.ceil((samples - 1 - first - near) / step) + 1)


def _kinks(bends: int, begin: float, step: float, near: float) -> NDArray[np.bool_]:
    """At which of so many second differences lines through knots kink: both beside a knot, or that at its sample."""
    place = np.arange(begin - step, bends + 1, step)
    found = np.zeros(bends + 2, bool)
    for beside in (np.floor(place + near), np.ceil(place - near)):
        found[beside.astype(int).clip(0, bends + 1)] = True
    return found[1:-1]


def straight(samples: int, knots: Array, *, at_knots: bool = False) -> csr_array:
    """What makes of values at knots (Q,) all samples, straight between them, (samples, Q); or `at_knots` of a signal at
    all samples its values at the knots, (Q, samples), those beyond its ends at its first or last value."""
    at = np.arange(samples, dtype=float)
    known, wanted = (at, knots.clip(0, samples - 1)) if at_knots else (knots, at)
    return BSpline.design_matrix(wanted, known[[0, *range(len(known)), -1]], k=1, extrapolate=True)
