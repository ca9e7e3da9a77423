"""Angles that were resampled along straight lines: where they were measured, and what lies in between.

Shapes: T trials, N samples of a trial, Q knots from its first sample or before it to its last one or behind it.
"""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import solveh_banded
from scipy.optimize import least_squares
from scipy.signal import find_peaks
from scipy.sparse import csr_array

from myowave.data.trials import Array

TRIED = 12  # steps in which kinks may come, the most regular ones
ROOM = 0.02, 0.25  # of a step, by which one found so may be off, and the knot that a trial begins at
FEWEST = 100  # samples more than knots: with fewer, chance may look like lines
# Of squared second differences lines through knots may leave so much: of all, and of what lines leave whose knots are
# half a step away. Those meet noise, smooth motions and steps of rounding as well; a thousand of such left more.
LEFT = 0.2
PROMISING = 0.5  # the same before step and knots are fitted
EXACT = 1e-12
SHORTEST = 5  # samples of a trial
ON_SAMPLE = 0.01  # samples: a knot so near to the first or the last one is there


def knots_of(angles: Sequence[Array]) -> list[Array] | None:
    """Places (Q,), in samples, where each of T angles (N,) was measured, evenly spaced in all, where they run straight
    in between; None where they do not."""
    if min(map(len, angles)) < SHORTEST:
        return None
    bent = sum(float((np.diff(angle, 2) ** 2).sum()) for angle in angles)

    def bends_left(place: Array, degree: int = 1) -> Array:
        """Second differences of what splines leave of all trials, by a step and a knot of each trial, (1 + T,)."""
        left = [a - _nearest(_knots(len(a), b, place[0]), a, degree) for a, b in zip(angles, place[1:], strict=True)]
        return np.concatenate([np.diff(own, 2) for own in left])

    def worse_elsewhere(place: Array, left: float) -> bool:
        elsewhere = place + place[0] / 2 * (np.arange(len(place)) > 0)
        kept, moved, curved = (
            float((bends_left(at, degree) ** 2).sum()) for at, degree in ((place, 1), (elsewhere, 1), (place, 3))
        )
        return kept < min(left * moved, left * bent, curved)

    def knots_at(place: Array) -> list[Array]:
        return [_knots(len(a), b, place[0]) for a, b in zip(angles, place[1:], strict=True)]

    room = np.array([ROOM[0], *[ROOM[1]] * len(angles)])
    for begun in _regular(angles):
        if sum(map(len, angles)) - sum(map(len, knots_at(begun))) >= FEWEST and worse_elsewhere(begun, PROMISING):
            bounds = begun - room * begun[0], begun + room * begun[0]
            place = least_squares(bends_left, begun, bounds=bounds, ftol=EXACT, xtol=EXACT, gtol=EXACT).x
            if worse_elsewhere(place, LEFT):
                return knots_at(place)
    return None


def _regular(angles: Sequence[Array]) -> list[Array]:
    """Steps that bends come in most regularly, the longest first, each with a knot of every trial, (1 + T,)."""
    # Looked at twice a sample, a bend peaks at its knot also where that is between two.
    squares = [_twice_as_fine(np.diff(angle, 2)) ** 2 for angle in angles]
    count = 8 * max(map(len, squares))
    spectra = np.stack([np.fft.rfft((own - own.mean()) * np.hanning(len(own)), count) for own in squares])
    power = (np.abs(spectra) ** 2).sum(0)
    peaks = find_peaks(power[: count // 2])[0]  # steps of more than a sample
    likely = np.sort(peaks[np.argsort(power[peaks])[-TRIED:]])
    # The first second difference is at sample 1.
    return [
        np.array([step, *(1 - np.angle(own) / (2 * np.pi) * step)])
        for step, own in zip(count / (2 * likely), spectra.T[likely], strict=True)
    ]


def _twice_as_fine(x: Array) -> Array:
    """A signal (N,) and, between its samples, their means, (2 N - 1,)."""
    return np.convolve(np.kron(x, [1.0, 0.0]), [0.5, 1.0, 0.5])[1 : 2 * len(x)]


def _knots(samples: int, begin: float, step: float) -> Array:
    """Places of all knots of a trial, one of which is at `begin`."""
    first = begin + step * np.ceil((ON_SAMPLE - begin) / step - 1)
    return first + step * np.arange(np.ceil((samples - 1 - first - ON_SAMPLE) / step) + 1)


def values_at(knots: Array, angle: Array) -> Array:
    """Values (Q,) at knots, the lines through which are nearest to an angle (N,); where it runs along such lines, what
    was measured."""
    return _weights(straight(len(angle), knots), angle, 1)


def _nearest(knots: Array, angle: Array, degree: int) -> Array:
    """The spline with knots that is nearest to an angle, (N,)."""
    basis = _splines(np.arange(float(len(angle))), knots, degree)
    return np.asarray(basis @ _weights(basis, angle, degree))


def _weights(basis: csr_array, angle: Array, degree: int) -> Array:
    """Of splines, each of which meets as many next ones as their degree, so that their sum is nearest to an angle."""
    products = basis.T @ basis
    bands = [np.pad(products.diagonal(n), (n, 0)) for n in range(degree, 0, -1)]
    bands.append(products.diagonal() + 1e-12)  # at the ends some may meet no sample
    return np.asarray(solveh_banded(np.stack(bands), basis.T @ angle))


def straight(samples: int, knots: Array, *, at_knots: bool = False) -> csr_array:
    """What makes of values at knots (Q,) all samples, straight between them, (samples, Q); or `at_knots` of a signal at
    all samples its values at the knots, (Q, samples), those beyond its ends at its first or last value."""
    at = np.arange(samples, dtype=float)
    known, wanted = (at, knots.clip(0, samples - 1)) if at_knots else (knots, at)
    return _splines(wanted, known, 1)


def _splines(places: Array, knots: Array, degree: int) -> csr_array:
    """B-splines between knots (Q,) at places, (places, Q + degree - 1); of degree 1 each is 1 at its knot."""
    ends = np.r_[[knots[0]] * degree, knots, [knots[-1]] * degree]
    return BSpline.design_matrix(places, ends, k=degree, extrapolate=True)
