"""How likely is what a fit leaves, given all that may have made it? One number, by which every question is answered.

Linearised where a fit stands, its residual is a sum of causes with Gaussian sizes: constants about where they are
expected, starts of trials, noise of sensors and of the EMG, curves of another shape, a correction that repeats in all
trials. Integrated out they leave one Gaussian, whose covariance is
    V = sum_k s_k^2 M_k + sum_j s_j^2 C_j C_j',
M_k of each trial for itself, C_j columns that all trials share. Is a cause there? The difference of the log evidence
with and without it says so, and which effect is missing, too. Source: MacKay 1992, Bayesian interpolation; Rasmussen &
Williams 2006, Gaussian Processes for Machine Learning, Secs. 5.4 and 2.7.

Nothing here knows where values and columns come from: they may be waves of an angle, or windows of a torque.

Shapes: T trials with L_t values each, L of all; C columns; H further values, each with a variance of its own.
"""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack
from scipy.optimize import minimize
from scipy.stats import norm

Array = NDArray[np.float64]

COST = 3.0  # nats of a cause that is on: its size is as likely in any factor of e over four decades, and one is taken
HOPE = 1.0  # nats: a cause that gains less with the sizes of all others as they are gains nothing
SIZES = 5  # of a cause that is off, spread between its bounds, which are tried for that
EFFORT = {"maxiter": 40, "ftol": 2e-6, "maxcor": 8}


@dataclass(frozen=True)
class Component:
    """A cause of residuals, with amplitudes N(0, size^2).

    Args:
        blocks: covariance that a size of 1 gives to the values of each trial, T of (L_t, L_t); none where it has none.
        columns: what an amplitude of 1 does to the values of all trials, one below the other, (L, C), where trials
            share amplitudes; None where they do not.
        tail: variance that a size of 1 gives to the further values (H,); None: none.
        low, first, high: bounds of the size and where its search starts; the same three where the size is known.
        cost: nats that it costs to have it; 0 for one that is always there.
    """

    name: str
    blocks: tuple[Array, ...] = ()
    columns: Array | None = None
    tail: Array | None = None
    low: float = 1.0
    first: float = 1.0
    high: float = 1.0
    cost: float = 0.0

    @property
    def known(self) -> bool:
        """Whether its size is."""
        return self.low == self.high


@dataclass(frozen=True)
class Residual:
    """What a linearised fit leaves, and all that may have made it.

    Args:
        values: of each trial, T of (L_t,).
        components: those with a cost may be there or not.
        tail: further values, independent of one another and of the parameters, (H,).
    """

    values: tuple[Array, ...]
    components: tuple[Component, ...]
    tail: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def always(self) -> tuple[str, ...]:
        """Names of the components that are there in any case."""
        return tuple(c.name for c in self.components if not c.cost)

    @property
    def optional(self) -> tuple[str, ...]:
        """Names of the others."""
        return tuple(c.name for c in self.components if c.cost)

    @cached_property
    def rows(self) -> tuple[slice, ...]:
        """Where each trial's values are among all, T of them."""
        ends = np.cumsum([len(v) for v in self.values])
        return tuple(slice(int(end) - len(v), int(end)) for end, v in zip(ends, self.values, strict=True))

    @cached_property
    def stacked(self) -> Array:
        """Values of all trials, (L,)."""
        return np.concatenate(self.values)

    def component(self, name: str) -> Component:
        return next(c for c in self.components if c.name == name)

    def with_components(self, more: Iterable[Component]) -> "Residual":
        """The same with further causes; one of a name that is there takes its place."""
        more = tuple(more)
        names = {c.name for c in more}
        return replace(self, components=(*(c for c in self.components if c.name not in names), *more))

    def without(self, names: Collection[str]) -> "Residual":
        return replace(self, components=tuple(c for c in self.components if c.name not in names))


class Covariance:
    """V at given sizes, ready to be divided by.

    Args:
        sizes: of the components that are on, by name; known ones are on whatever is said here.
    """

    def __init__(self, residual: Residual, sizes: Mapping[str, float]) -> None:
        self.residual = residual
        there = [c for c in residual.components if c.known or c.name in sizes]
        self.sizes = {c.name: c.first if c.known else float(sizes[c.name]) for c in there}
        of_trials = [c for c in there if c.blocks]
        self.roots = []
        for t in range(len(residual.values)):
            total = sum(self.sizes[c.name] ** 2 * c.blocks[t] for c in of_trials)
            root, info = lapack.dpotrf(np.asarray(total), lower=1)
            if info:
                raise np.linalg.LinAlgError("the covariance of a residual is not positive")
            self.roots.append(root)
        self.shared = [c for c in there if c.columns is not None and c.columns.shape[1]]
        scale = np.concatenate(
            [np.full(_columns(c).shape[1], self.sizes[c.name]) for c in self.shared] or [np.zeros(0)]
        )
        self.raw = self.by_blocks(
            np.concatenate([np.zeros((len(residual.stacked), 0)), *map(_columns, self.shared)], -1)
        )
        self.scaled = self.raw * scale
        inner = np.eye(len(scale)) + self.scaled.T @ self.scaled
        self.inner_root = np.linalg.cholesky(inner)
        # Columns by which V^-1 falls short of that of the blocks alone.
        self.taken = _divided(self.inner_root, self.scaled.T).T
        self.tail = sum(
            (self.sizes[c.name] ** 2 * c.tail for c in there if c.tail is not None), np.zeros(len(residual.tail))
        )

    def by_blocks(self, columns: Array) -> Array:
        """Columns (L, C) divided by the roots of the covariances of the trials alone."""
        parts = zip(self.roots, self.residual.rows, strict=True)
        return np.concatenate([lapack.dtrtrs(root, columns[rows], lower=1)[0] for root, rows in parts])

    def inner(self, one: Array, other: Array) -> Array:
        """one' V^-1 other of columns (L, A) and (L, B), (A, B)."""
        a = self.by_blocks(one)
        b = a if other is one else self.by_blocks(other)
        return np.asarray(a.T @ b - (a.T @ self.taken) @ (self.taken.T @ b))

    @cached_property
    def log_determinant(self) -> float:
        roots = [*self.roots, self.inner_root]
        return float(2 * sum(np.log(np.diag(root)).sum() for root in roots) + np.log(self.tail).sum())

    @cached_property
    def solved(self) -> tuple[float, Array]:
        """r' V^-1 r, and the residual divided by the roots of the blocks less what shared amplitudes do to it, (L,)."""
        r = self.by_blocks(self.residual.stacked[:, None])[:, 0]
        left = r - self.taken @ (self.taken.T @ r)
        return float(r @ left), left

    @property
    def log_evidence(self) -> float:
        """Of the residual, costs not counted [nats]."""
        count = len(self.residual.stacked) + len(self.residual.tail)
        square = self.solved[0] + (self.residual.tail**2 / self.tail).sum()
        return float(-0.5 * (square + self.log_determinant + count * math.log(2 * math.pi)))

    @property
    def gradient(self) -> dict[str, float]:
        """Of the log evidence by the logarithm of each size that is not known."""
        left = self.solved[1]
        of_tail = (1 - self.residual.tail**2 / self.tail) / self.tail
        slopes = dict.fromkeys((c.name for c in self.residual.components if c.name in self.sizes and not c.known), 0.0)
        wanted = [c for c in self.residual.components if c.name in slopes]
        for t, (root, rows) in enumerate(zip(self.roots, self.residual.rows, strict=True)):
            inverse = lapack.dpotri(root, lower=1)[0]
            inverse = np.tril(inverse) + np.tril(inverse, -1).T
            taken = lapack.dtrtrs(root, np.asfortranarray(self.taken[rows]), lower=1, trans=1)[0]
            divided = lapack.dtrtrs(root, left[rows], lower=1, trans=1)[0]
            # d log evidence / d M = (V^-1 r r' V^-1 - V^-1) / 2, of this trial's block.
            slope = np.outer(divided, divided) - inverse + taken @ taken.T
            for c in wanted:
                if c.blocks:
                    slopes[c.name] += float(np.einsum("ij,ij->", slope, c.blocks[t]))
        with_taken, with_left = self.raw.T @ self.taken, self.raw.T @ left
        each = with_left**2 - (self.raw**2).sum(0) + (with_taken**2).sum(-1)
        place = 0
        for c in self.shared:
            count = _columns(c).shape[1]
            if c.name in slopes:
                slopes[c.name] += float(each[place : place + count].sum())
            place += count
        for c in wanted:
            if c.tail is not None:
                slopes[c.name] -= float(of_tail @ c.tail)
        return {name: self.sizes[name] ** 2 * slope for name, slope in slopes.items()}

    def made_by(self, name: str) -> Array:
        """What one component is expected to have made of the values, (L,)."""
        component, size = self.residual.component(name), self.sizes[name]
        divided = np.zeros(len(self.residual.stacked))
        for rows, root in zip(self.residual.rows, self.roots, strict=True):
            divided[rows] = lapack.dtrtrs(root, self.solved[1][rows], lower=1, trans=1)[0]
        made = np.zeros(len(divided))
        for rows, block in zip(self.residual.rows, component.blocks, strict=False):
            made[rows] = size**2 * block @ divided[rows]
        return (
            made if component.columns is None else made + size**2 * component.columns @ (component.columns.T @ divided)
        )

    def posterior(self, columns: Array) -> tuple[Array, Array]:
        """Mean (C,) and covariance (C, C) of amplitudes N(0, 1) that act through further columns (L, C)."""
        covariance: Array = np.asarray(np.linalg.inv(np.eye(columns.shape[1]) + self.inner(columns, columns)))
        return covariance @ self.inner(columns, self.residual.stacked[:, None])[:, 0], covariance

    def gain(self, columns: Array) -> float:
        """How much the log evidence rises with such columns in V [nats]."""
        mean, covariance = self.posterior(columns)
        product = self.inner(columns, self.residual.stacked[:, None])[:, 0]
        return float(0.5 * (product @ mean + np.linalg.slogdet(covariance)[1]))

    def white(self) -> Array:
        """The residual divided by a root of V, value by value in order, (L,): N(0, 1) and independent if V is right."""
        size, shared = len(self.residual.stacked), [_columns(c) * self.sizes[c.name] for c in self.shared]
        columns = np.concatenate([np.zeros((size, 0)), *shared], -1)
        total = columns @ columns.T
        for rows, root in zip(self.residual.rows, self.roots, strict=True):
            lower = np.tril(root)
            total[rows, rows] += lower @ lower.T
        return np.asarray(np.linalg.solve(np.linalg.cholesky(total), self.residual.stacked))


def _divided(root: Array, columns: Array) -> Array:
    """Columns divided by a lower triangular root; there may be none."""
    return lapack.dtrtrs(np.asfortranarray(root), columns, lower=1)[0] if columns.size else columns


def _columns(component: Component) -> Array:
    assert component.columns is not None
    return component.columns


@dataclass(frozen=True)
class Weighed:
    """Which causes are there, how large they are, and how likely the residual is.

    Args:
        sizes: of the components that are on and whose sizes are not known, by name.
        value: log evidence less the costs of what is on [nats].
    """

    sizes: Mapping[str, float]
    value: float

    def on(self, residual: Residual) -> frozenset[str]:
        """The optional components that are there."""
        return frozenset(self.sizes) & frozenset(residual.optional)


def log_evidence(residual: Residual, sizes: Mapping[str, float]) -> float:
    """Of a residual with causes of given sizes, costs counted [nats]; minus infinity where V is not positive."""
    try:
        found = Covariance(residual, sizes).log_evidence
    except np.linalg.LinAlgError:
        return -math.inf
    return found - sum(c.cost for c in residual.components if c.name in sizes)


def most_likely(residual: Residual, on: Collection[str], start: Mapping[str, float] | None = None) -> Weighed:
    """The sizes that make a residual most likely.

    Args:
        on: optional components that are there.
        start: where to search from, by name.
    """
    fitted = [c for c in residual.components if not c.known and (not c.cost or c.name in on)]
    bounds = np.log([(c.low, c.high) for c in fitted]).reshape(-1, 2)
    first = np.log([(start or {}).get(c.name, c.first) for c in fitted]).clip(*bounds.T)
    cost = sum(c.cost for c in residual.components if c.name in on)
    names = [c.name for c in fitted]

    def unlikely(logs: Array) -> tuple[float, Array]:
        try:
            covariance = Covariance(residual, dict(zip(names, np.exp(logs), strict=True)))
        except np.linalg.LinAlgError:
            return 1e12, np.zeros(len(logs))
        slope = covariance.gradient
        return -covariance.log_evidence, -np.array([slope[name] for name in names])

    if not fitted:
        return Weighed({}, log_evidence(residual, {}) - cost)
    found = minimize(unlikely, first, jac=True, bounds=bounds, method="L-BFGS-B", options=EFFORT)
    return Weighed(dict(zip(names, np.exp(found.x).tolist(), strict=True)), -float(found.fun) - cost)


def weigh_components(
    residual: Residual, seeds: Sequence[Weighed] = (), *, fixed: Collection[str] = ()
) -> dict[frozenset[str], Weighed]:
    """Every set of optional components that a search visits: it adds and drops those that help most, while one does.

    Args:
        seeds: where it may start.
        fixed: components that stay off.
    """
    seen: dict[frozenset[str], Weighed] = {}
    optional = [name for name in residual.optional if name not in fixed]

    def visit(on: Collection[str], start: Mapping[str, float]) -> Weighed:
        key = frozenset(on)
        if key not in seen:
            seen[key] = most_likely(residual, key, start)
        return seen[key]

    best = visit((), {})
    for seed in seeds:
        best = max(best, visit(seed.on(residual) - frozenset(fixed), seed.sizes), key=lambda w: w.value)
    while True:
        on = best.on(residual)
        for name in optional:
            key = on | {name}
            if key not in seen:
                seen[key] = _with_one_more(residual, best, name, key)
        for name in on:
            visit(on - {name}, best.sizes)
        top = max(seen.values(), key=lambda w: w.value)
        if top is best:
            return seen
        best = top


def _with_one_more(residual: Residual, best: Weighed, name: str, key: frozenset[str]) -> Weighed:
    """A component on that is off: sizes are sought only if it promises something with the others as they are."""
    component = residual.component(name)
    tried = {s: {**best.sizes, name: s} for s in np.geomspace(component.low, component.high, SIZES).tolist()}
    values = {s: log_evidence(residual, sizes) for s, sizes in tried.items()}
    size = max(values, key=lambda s: values[s])
    if values[size] + component.cost < best.value + HOPE:
        return Weighed(tried[size], max(values[size], best.value - component.cost))
    return most_likely(residual, key, tried[size])


def log_share_within(low: Array, high: Array, mean: Array, covariance: Array) -> float:
    """Logarithm of the share of a posterior within bounds over that of its prior N(0, 1), by what is known of each
    amplitude alone: what a prior that ends at the bounds adds to the log evidence.

    Args:
        low, high, mean: of the amplitudes, (C,) each, and their `covariance` (C, C).
    """
    deviation = np.sqrt(np.diag(covariance))
    inside = _log_between((low - mean) / deviation, (high - mean) / deviation)
    return float((inside - _log_between(low, high)).sum())


def _log_between(low: Array, high: Array) -> Array:
    """Logarithm of the probability that N(0, 1) lies between, with care for its tails."""
    flip = low > 0  # where both lie above 0 the lower tail is as exact as the upper one is not
    a, b = np.where(flip, -high, low), np.where(flip, -low, high)
    upper, lower = norm.logcdf(b), norm.logcdf(a)
    return np.asarray(upper + np.log1p(-np.exp(np.minimum(lower - upper, -1e-12))))
