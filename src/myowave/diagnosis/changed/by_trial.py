"""One number that may differ from trial to trial: has it changed between two groups, or do trials differ anyway?

A sensor that slips, a posture that shifts, a timing that no model of a muscle knows differ within a group as well, and
what a model says wrongly of another load goes with the load. So a number is sought in every trial, and what trials of
one group differ by says by how much those of two have to. Source: Gelman & Hill 2007, Data Analysis Using Regression
and Multilevel/Hierarchical Models, Ch. 12 (groups of trials that differ by themselves).

Values are in strengths of practical interest. Shapes: T trials, K directions in which their values differ.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from itertools import product

import numpy as np
import torch
from scipy.special import logsumexp
from scipy.stats import multivariate_normal, norm

from myowave.data.trials import Array
from myowave.diagnosis.changed.weigh import evidence, likeliest, residual_of
from myowave.diagnosis.changed.windows import Windowed
from myowave.diagnosis.likelihood.algebra import Covariance, Weighed
from myowave.identification.least_squares import descend

USUAL = 3.0  # ASSUME: changes are about as large as this
APART = (0.03, 0.1, 0.3, 1.0, 3.0)  # ASSUME: so far trials may differ by themselves, or with what is known of them
FIRST = (0.25, 1.0, 3.0)  # values of the second group, of either sign, that are tried first, while each is likelier
HOPELESS = 1.0  # nats: what explains less in the second group alone is not sought in every trial
NUDGE = 0.02  # for differences
STEPS, SHARES, LITTLE = 12, (1.0, 0.3, 0.1), 0.02  # of Gauss-Newton, what of each is tried, nats that end them
LOOSE = 0.01  # of the usual information: what is known of a value that data say nothing of


@dataclass(frozen=True)
class Directions:
    """In which values differ; their mean over the first group stays 0."""

    columns: Array  # orthonormal, (T, K)
    change: Array  # amplitudes of 1 more in every trial of the second group, (K,)
    # apart, known: covariance of the amplitudes where each trial differs by itself, and where they differ with what
    # is known of them, with variance 1, (K, K)
    apart: Array
    known: Array

    @classmethod
    def of(cls, columns: Array, second: Array, known: Array) -> "Directions":
        """Those that some columns (T, ...) span, the first group's mean taken out; `second` is 1 in the second group,
        else 0, (T,), and conditions that are known are 0 to 1 each, (T, C)."""
        centred = np.eye(len(second)) - (1 - second) / (1 - second).sum()
        vectors, strength, _ = np.linalg.svd(centred @ columns, full_matrices=False)
        kept = vectors[:, strength > 1e-9 * strength[0]]
        alone, with_known = kept.T @ centred, kept.T @ centred @ known
        return cls(kept, kept.T @ second, alone @ alone.T, with_known @ with_known.T)


@dataclass(frozen=True)
class Differing:
    """The likeliest amplitudes (K,) of directions, their covariance (K, K), and their log likelihood over that of no
    difference [nats]."""

    directions: Directions
    amplitudes: Array
    covariance: Array
    nats: float

    @property
    def values(self) -> Array:
        """Of the trials, (T,)."""
        return self.directions.columns @ self.amplitudes

    @property
    def changed(self) -> float:
        """Log evidence that the groups differ, over that of no difference [nats]."""
        return float(logsumexp(self._nats(USUAL)) - 2 * np.log(len(APART)))

    @property
    def anyway(self) -> float:
        """The same that trials differ, but by themselves or with what is known of them."""
        return float(logsumexp(self._nats(0.0)) - 2 * np.log(len(APART)))

    @property
    def change(self) -> tuple[float, float, float]:
        """How much more there is in the second group: the mean, and bounds that hold it with probability .95."""
        nats, along = self._nats(USUAL), USUAL**2 * self.directions.change
        gains = [np.linalg.solve(prior + self.covariance, along) for prior in self._priors(USUAL)]
        mean = np.array([gain @ self.amplitudes for gain in gains])
        deviation = np.sqrt([USUAL**2 - gain @ along for gain in gains])
        weight = np.exp(nats - logsumexp(nats))
        grid = np.linspace((mean - 5 * deviation).min(), (mean + 5 * deviation).max(), 4001)
        below = weight @ norm.cdf((grid - mean[:, None]) / deviation[:, None])
        low, high = np.interp([0.025, 0.975], below, grid)
        return float(weight @ mean), float(low), float(high)

    def _priors(self, size: float) -> list[Array]:
        """Covariances (K, K) of the amplitudes, for each pair of `APART`, with changes of a size."""
        d = self.directions
        changed = size**2 * np.outer(d.change, d.change)
        return [alone**2 * d.apart + known**2 * d.known + changed for alone, known in product(APART, repeat=2)]

    def _nats(self, size: float) -> Array:
        """Log evidence with each prior, over that of no difference [nats]."""
        covariances = [prior + self.covariance for prior in self._priors(size)]
        here = [multivariate_normal.logpdf(self.amplitudes, np.zeros(len(c)), c) for c in covariances]
        return np.array(here) + self.nats + np.linalg.slogdet(2 * np.pi * self.covariance)[1] / 2


@dataclass(frozen=True, eq=False)
class Point:
    """Values of the trials, (T,), what windows show with them, and the likeliest sizes of all that made it."""

    values: Array
    windowed: Windowed
    state: Weighed

    @property
    def total(self) -> float:
        """Log likelihood, and that of the values beforehand, up to a constant [nats]."""
        return self.state.value - float(self.values @ self.values) / (2 * USUAL**2)


@dataclass(frozen=True)
class ByTrial:
    """One number in every trial, and all that tells how likely its values are."""

    windows: Callable[[Array], Windowed]  # of values (T,) between `low` and `high`
    low: float
    high: float
    nothing: Point  # where all values are 0

    def differing(self, second: Array, known: Array) -> Differing:
        """How trials differ; in every one only where the second group seems to; see `Directions.of`."""
        best = max((self._rise(sign * second) for sign in (1.0, -1.0)), key=lambda point: point.total)
        best, found = self._follow(best, Directions.of(second[:, None], second, known))
        if found.nats < HOPELESS:
            return found
        return self._follow(best, Directions.of(np.eye(len(second)), second, known))[1]

    def _rise(self, direction: Array) -> Point:
        """The last of ever larger values in a direction, (T,), that are each likelier than the one before."""
        best = self.nothing
        for step in FIRST:
            if not ((self.low <= step * direction) & (step * direction <= self.high)).all():
                break
            tried = self._point(step * direction, self.nothing)
            if tried.total <= best.total:
                break
            best = tried
        return best

    def _point(self, values: Array, near: Point) -> Point:
        windowed = self.windows(inside := values.clip(self.low, self.high))
        return Point(inside, windowed, likeliest(windowed, near.state.sizes))

    def _follow(self, point: Point, directions: Directions) -> tuple[Point, Differing]:
        """Gauss-Newton steps in some directions, and where they end."""
        columns, usual = directions.columns, np.eye(len(directions.change)) / USUAL**2
        normal = cache(partial(self._normal, columns=columns))

        def attempts(point: Point) -> Iterator[Point]:
            information, left = normal(point)
            step = columns @ np.linalg.solve(information + usual, left - usual @ (columns.T @ point.values))
            yield from (self._point(point.values + share * step, point) for share in SHARES)

        *_, point = descend(point, lambda point: -point.total, attempts, STEPS, LITTLE)
        information, left = normal(point)
        information = information + LOOSE * usual
        covariance = np.asarray(np.linalg.inv(information), dtype=np.float64)
        # The search ends where the values are likeliest with what is usual; from there to where data alone put them.
        alone = (point.values + columns @ covariance @ left).clip(self.low, self.high)
        step = columns.T @ (alone - point.values)
        nats = point.state.value - self.nothing.state.value + float(step @ left - step @ information @ step / 2)
        return point, Differing(directions, columns.T @ alone, covariance, nats)

    def _normal(self, point: Point, columns: Array) -> tuple[Array, Array]:
        """Normal equations of amplitudes: their information, as if only the torque hung on them, and the slope of the
        log likelihood, which all that a value changes is in."""
        now, sizes, moved = point.windowed, point.state.sizes, columns.any(-1)
        more = self.windows(point.values + NUDGE * moved)
        slope = (more.left_by(now.strength) - now.left_by(now.strength)) / NUDGE
        along = now.motion.padded(slope)[..., None] * torch.eye(len(columns), dtype=torch.float64)[:, None]
        information = Covariance(residual_of(now), sizes).inner(along, along).numpy()
        rises = NUDGE / 2 * np.diag(information)
        for t in np.flatnonzero(moved).tolist():
            rises[t] += (evidence(now.but_one(more, t), sizes) - point.state.value) / NUDGE
        return columns.T @ information @ columns, columns.T @ rises
