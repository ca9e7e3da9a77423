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


def knots_of(angles: Sequence[Array]) -> float | None:
    """Samples between the values that were measured of angles (N_i,), where they run straight in between and kink at
    no other place; None where they do not."""
    bends = [np.abs(np.diff(angle, 2)) for angle in angles]
    kinked = [bend > STRAIGHT * bend.max(initial=0.0) for bend in bends]
    share = float(np.concatenate(kinked).mean()) if kinked else 1.0
    if not 0 < share < MOST_KINKS:
        return None
    tried = (2 / share) * np.linspace(0.95, 1.05, 2001)
    found = min(tried, key=lambda knots: sum(int((_kinks(len(k), knots) != k).sum()) for k in kinked))
    wrong = sum(int((_kinks(len(k), found) != k).sum()) for k in kinked) / sum(map(len, kinked))
    return float(found) if wrong < WRONG_KINKS else None


def _kinks(bends: int, knots: float) -> NDArray[np.bool_]:
    """At which of so many second differences lines through knots kink."""
    before = np.floor(np.arange(1, int((bends + 1) / knots) + 1) * knots + 1e-9).astype(int)
    found = np.zeros(bends + 2, bool)
    found[(before - 1).clip(0, bends)] = found[before.clip(0, bends)] = True
    return found[:bends]


def straight(samples: int, knots: float, *, at_knots: bool = False) -> Array:
    """What makes of values at knots all samples, straight between them, (samples, Q); or `at_knots` of a signal at all
    samples its values at the knots, (Q, samples), knots beyond the last sample at its value."""
    count = int(np.ceil((samples - 1) / knots - 1e-9)) + 1
    known = samples if at_knots else count
    place = np.minimum(np.arange(count) * knots, samples - 1) if at_knots else np.arange(samples) / knots
    return np.asarray(make_interp_spline(np.arange(known), np.eye(known), k=1)(place))
