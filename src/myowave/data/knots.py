"""Angles that were resampled along straight lines: where they were measured, and what lies in between.

Shapes: N samples of a trial, Q knots.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from myowave.data.trials import Array

STRAIGHT = 1e-8  # of the largest second difference: less is rounding
MOST_KINKS, WRONG_KINKS = 0.95, 0.05  # of second differences
ON_SAMPLE = 1e-4  # samples: a knot so near to one kinks there alone


def knots_of(angles: Sequence[Array]) -> float | None:
    """Samples between the values that were measured of angles (N_i,), where they run straight in between and kink at
    no other place; None where they do not."""
    bends = [np.diff(angle, 2) for angle in angles]
    kinked = [np.abs(bend) > STRAIGHT * np.abs(bend).max(initial=0.0) for bend in bends]
    share = float(np.concatenate(kinked).mean()) if kinked else 1.0
    bend, kinks = max(zip(bends, kinked, strict=True), key=lambda both: len(both[0]), default=(np.zeros(0),) * 2)
    begins = np.flatnonzero(kinks[1:-1] > kinks[:-2]) + 1  # of runs of kinks
    if not 0 < share < MOST_KINKS or not len(begins):
        return None
    # Samples bend by as much as a knot is near, which tells where a late one is that bends much, but not its number.
    first = max(begins[len(begins) // 2 :], key=lambda begin: abs(bend[begin]))
    before, behind = np.abs(bend[first : first + 2])
    place = first + 1 + behind / (before + behind)
    numbers = np.arange(max(1, int(0.45 * share * place)), int(1.1 * share * place) + 2)  # each kinks once or twice

    def wrong(knots: float) -> float:
        return float(np.concatenate([_kinks(len(own), knots) != own for own in kinked]).mean())

    found = float(min(place / numbers, key=wrong))
    return found if wrong(found) < WRONG_KINKS else None


def _kinks(bends: int, knots: float) -> NDArray[np.bool_]:
    """At which of so many second differences lines through knots kink: both beside a knot, or that at its sample."""
    place = np.arange(1, int((bends + 1) / knots) + 1) * knots
    found = np.zeros(bends + 2, bool)
    for beside in (np.floor(place + ON_SAMPLE), np.ceil(place - ON_SAMPLE)):
        found[beside.astype(int) - 1] = True
    return found[:bends]


def straight(samples: int, knots: float, *, at_knots: bool = False) -> Array:
    """What makes of values at knots all samples, straight between them, (samples, Q); or `at_knots` of a signal at all
    samples its values at the knots, (Q, samples), knots beyond the last sample at its value."""
    count = int(np.ceil((samples - 1) / knots - 1e-9)) + 1
    known = samples if at_knots else count
    place = np.minimum(np.arange(count) * knots, samples - 1) if at_knots else np.arange(samples) / knots
    return np.asarray(make_interp_spline(np.arange(known), np.eye(known), k=1)(place))
