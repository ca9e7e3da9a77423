"""How likely is what a fit leaves, given all that may have made it? One number, by which every question is answered.

Linearised where a fit stands, its residual is a sum of causes with Gaussian sizes: constants about where they are
expected, starts of trials, noise of sensors and of the EMG, curves and paths of another shape, a correction that
repeats in all trials. Integrated out they leave one Gaussian, whose covariance is
    V = sum_k s_k^2 M_k + sum_j s_j^2 C_j C_j',
M_k of each trial for itself, dense for some of its values and diagonal for the others, C_j columns that all trials
share. Is a cause there? The difference of the log evidence with and without it says so, and which effect is missing,
too. Source: MacKay 1992, Bayesian interpolation; Rasmussen & Williams 2006, Gaussian Processes for Machine Learning,
Secs. 5.4 and 2.7.

Nothing here knows where values and columns come from: they may be waves of an angle, or windows of a torque.

Shapes: T trials of up to L values each, 0 where padded, the last H of them independent of one another but for what
columns do; D = L - H; C columns.
"""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np
import torch
from scipy.optimize import minimize
from scipy.special import log_ndtr
from torch import Tensor

from myowave.data.trials import Array

COST = 3.0  # nats of a cause: it is there or not (0.7), its size in one factor of e of four decades (2.2)
HOPE = 1.0  # nats: a cause that gains less with the sizes of all others as they are gains nothing
SIZES = 5  # of a cause that is off, spread between its bounds, which are tried for that
NEGLIGIBLE = 1e-8  # of the strongest combination of columns: what is weaker changes no log evidence by 1e-4
EFFORT = {"maxiter": 40, "ftol": 2e-6, "maxcor": 8}

Key = TypeVar("Key")


@dataclass(frozen=True)
class Component:
    """A cause of residuals, with amplitudes N(0, size^2)."""

    name: str
    # covariance that a size of 1 gives to the first values of each trial, (T, D, D); None where it has none
    blocks: Tensor | None = None
    # what an amplitude of 1 does to the values, (T, L, C), where trials share amplitudes; None where they do not
    columns: Tensor | None = None
    tail: Tensor | None = None  # variance that a size of 1 gives to the last values (T, H); None: none
    # low, first, high: bounds of the size and where its search starts; the same three where the size is known
    low: float = 1.0
    first: float = 1.0
    high: float = 1.0
    cost: float = 0.0  # nats that it costs to have it; 0 for one that is always there

    @property
    def known(self) -> bool:
        """Whether its size is."""
        return self.low == self.high

    @property
    def moves(self) -> bool:
        """Whether it does anything: noise of an EMG that drives no muscle does not."""
        return any(bool(part.any()) for part in (self.blocks, self.columns, self.tail) if part is not None)


@dataclass(frozen=True)
class Residual:
    """What a linearised fit leaves, and all that may have made it."""

    values: Tensor  # (T, L), and which are not padded, `valid` (T, L)
    valid: Tensor
    components: tuple[Component, ...]  # those with a cost may be there or not
    apart: int = 0  # how many of each trial's values are the last ones, H

    def parts(self, some: Tensor) -> tuple[Tensor, Tensor]:
        """The first values of each trial and the last ones, (T, D, ...) and (T, H, ...), of some (T, L, ...)."""
        first, last = some.split([self.values.shape[1] - self.apart, self.apart], 1)
        return first, last

    @cached_property
    def optional(self) -> tuple[str, ...]:
        """Names of the components that may be there or not; one that moves nothing is not."""
        return tuple(c.name for c in self.components if c.cost and c.moves)

    def component(self, name: str) -> Component:
        return next(c for c in self.components if c.name == name)

    def columns(self, name: str) -> Tensor:
        """Those of a component that has some, (T, L, C)."""
        found = self.component(name).columns
        assert found is not None
        return found

    def with_components(self, more: Iterable[Component]) -> "Residual":
        """The same with further causes; one of a name that is there takes its place."""
        more = tuple(more)
        return replace(self, components=(*self.without([c.name for c in more]).components, *more))

    def without(self, names: Collection[str]) -> "Residual":
        return replace(self, components=tuple(c for c in self.components if c.name not in names))

    def condensed(self) -> "Residual":
        """The same with as few columns as do the same: of many muscles' columns half are sums of others."""

        def fewer(component: Component) -> Component:
            if component.columns is None or component.columns.shape[-1] < 2:
                return component
            _, strength, turned = torch.linalg.svd(component.columns.flatten(0, 1), full_matrices=False)
            kept = turned[strength > NEGLIGIBLE * strength[0]]
            return replace(component, columns=component.columns @ kept.mT)

        return replace(self, components=tuple(map(fewer, self.components)))


class Covariance:
    """V at given sizes of the components that are on, by name, ready to be divided by; known ones are always on."""

    def __init__(self, residual: Residual, sizes: Mapping[str, float]) -> None:
        self.residual = residual
        there = [c for c in residual.components if c.known or c.name in sizes]
        self.sizes = {c.name: c.first if c.known else sizes[c.name] for c in there}
        padded, tail = residual.parts((~residual.valid).double())  # where it has 1, which adds nothing
        total = torch.diag_embed(padded)
        shared = {"": residual.values.new_zeros(*residual.values.shape, 0)}
        for c in there:
            variance = self.sizes[c.name] ** 2
            if c.blocks is not None:
                total = total + variance * c.blocks
            if c.tail is not None:
                tail = tail + variance * c.tail
            if c.columns is not None:
                shared[c.name] = self.sizes[c.name] * c.columns
        self.tail = tail.sqrt()[..., None]
        self.widths = {name: columns.shape[-1] for name, columns in shared.items()}
        self.shared = torch.cat([*shared.values()], -1)
        self.root, failed = torch.linalg.cholesky_ex(total)
        if failed.any() or not (tail > 0).all():
            raise np.linalg.LinAlgError("the covariance of a residual is not positive")
        # Products with many small matrices are several times faster than triangular solves.
        self.inverse = torch.linalg.solve_triangular(self.root, torch.eye(total.shape[-1]).double(), upper=False)
        self.scaled = self.by_blocks(self.shared)
        inner = torch.eye(self.scaled.shape[1]).double() + self.scaled.T @ self.scaled
        self.inner_root, failed = torch.linalg.cholesky_ex(inner)
        if failed:
            raise np.linalg.LinAlgError("what trials share of the covariance of a residual is not positive")

    @cached_property
    def taken(self) -> Tensor:
        """Columns by which V^-1 falls short of that of the blocks alone, (T L, C)."""
        return torch.linalg.solve_triangular(self.inner_root, self.scaled.T, upper=False).T

    def by_blocks(self, columns: Tensor) -> Tensor:
        """Columns (T, L, C) divided by the roots of the covariances of the trials alone, (T L, C)."""
        return self._divided(columns, self.inverse).flatten(0, 1)

    def _divided(self, columns: Tensor, inverse: Tensor) -> Tensor:
        """Columns (T, L, C), the first values of each trial times a matrix and the last ones over their deviation."""
        first, last = self.residual.parts(columns)
        return torch.cat([inverse @ first, last / self.tail], 1)

    def _again(self, divided: Tensor) -> Tensor:
        """Columns that were divided (T L, C) divided by the transposed roots, (T, L, C)."""
        return self._divided(divided.unflatten(0, self.residual.values.shape), self.inverse.mT)

    def inner(self, one: Tensor, other: Tensor) -> Tensor:
        """one' V^-1 other of columns (T, L, A) and (T, L, B), (A, B)."""
        a = self.by_blocks(one)
        b = a if other is one else self.by_blocks(other)
        return a.T @ b - (a.T @ self.taken) @ (self.taken.T @ b)

    def solve(self, columns: Tensor) -> Tensor:
        """V^-1 columns, (T, L, C)."""
        divided = self.by_blocks(columns)
        return self._again(divided - self.taken @ (self.taken.T @ divided))

    def with_residual(self, columns: Tensor) -> Tensor:
        """columns' V^-1 r, (C,)."""
        return self.inner(columns, self.residual.values[..., None])[:, 0]

    @property
    def evidence(self) -> float:
        """Logarithm of how likely the residual is, costs not counted [nats]."""
        r = self.by_blocks(self.residual.values[..., None])
        shared = torch.linalg.solve_triangular(self.inner_root, self.scaled.T @ r, upper=False)
        square = (r**2).sum() - (shared**2).sum()
        roots = (self.root.diagonal(dim1=-2, dim2=-1), self.inner_root.diagonal(), self.tail)
        determinant = sum(root.log().sum() for root in roots)
        count = int(self.residual.valid.sum())
        return float(-0.5 * (square + 2 * determinant + count * math.log(2 * math.pi)))

    def slope(self, names: Sequence[str]) -> Array:
        """Derivatives of the evidence by the logarithms of some sizes: s^2 [(V^-1 r)' M (V^-1 r) - tr(V^-1 M)].

        Source: Rasmussen & Williams 2006, Eq. 5.9.
        """
        divided = self.solve(self.residual.values[..., None])
        (first, last), (taken, taken_last) = map(self.residual.parts, (divided, self._again(self.taken)))
        excess = first @ first.mT + taken @ taken.mT - self.inverse.mT @ self.inverse
        of_tail = (last**2).sum(-1) + (taken_last**2).sum(-1) - 1 / self.tail[..., 0] ** 2
        # S'S = K - 1 with S = `scaled` and K = `inner_root` squared, so S'V^-1 S = 1 - 1 / K.
        of_shared = (self.shared * divided).sum((0, 1)) ** 2 + torch.cholesky_inverse(self.inner_root).diagonal() - 1
        by_name = dict(zip(self.widths, of_shared.split([*self.widths.values()]), strict=True))
        slopes = []
        for name in names:
            component, variance = self.residual.component(name), self.sizes[name] ** 2
            slope = by_name[name].sum() if name in by_name else torch.zeros(())
            for part, excess_of in ((component.blocks, excess), (component.tail, of_tail)):
                if part is not None:
                    slope = slope + variance * (part * excess_of).sum()
            slopes.append(float(slope))
        return np.array(slopes)

    def made_by(self, name: str) -> Tensor:
        """What one component is expected to have made of the values, (T, L)."""
        component, variance = self.residual.component(name), self.sizes[name] ** 2
        divided = self.solve(self.residual.values[..., None])
        first, last = self.residual.parts(divided)
        of_first = 0.0 * first if component.blocks is None else component.blocks @ first
        of_last = 0.0 * last if component.tail is None else component.tail[..., None] * last
        made = torch.cat([of_first, of_last], 1)
        if component.columns is not None:
            made = made + component.columns @ torch.einsum("tlc,tlx->cx", component.columns, divided)
        return (variance * made)[..., 0]

    def posterior(self, columns: Tensor) -> tuple[Array, Array]:
        """Mean (C,) and covariance (C, C) of amplitudes N(0, 1) that act through further columns (T, L, C)."""
        covariance = torch.linalg.inv(torch.eye(columns.shape[-1]).double() + self.inner(columns, columns))
        return (covariance @ self.with_residual(columns)).numpy(), covariance.numpy()

    def white(self) -> Tensor:
        """The values divided by a root of V, one by one in order, (T, L): N(0, 1) and independent if V is right. The
        first values of all trials come first, and trials tell the next ones what they share."""
        known, expected = torch.eye(self.shared.shape[-1]).double(), self.shared.new_zeros(self.shared.shape[-1], 1)
        covariances = self.root @ self.root.mT, torch.diag_embed(self.tail[..., 0] ** 2)
        parts = map(self.residual.parts, (self.residual.values[..., None], self.shared))
        found = []
        for some in zip(*parts, covariances, strict=True):
            for values, columns, covariance in zip(*some, strict=True):
                root = torch.linalg.cholesky(covariance + columns @ known @ columns.mT)
                both = torch.cat([values - columns @ expected, columns @ known], 1)
                left, gain = torch.linalg.solve_triangular(root, both, upper=False).tensor_split([1], 1)
                known, expected = known - gain.mT @ gain, expected + gain.mT @ left
                found.append(left[:, 0])
        trials = len(self.residual.values)
        return torch.cat([torch.stack(found[:trials]), torch.stack(found[trials:])], 1) * self.residual.valid


@dataclass(frozen=True)
class Weighed:
    """Which causes are there, how large they are, and how likely the residual is."""

    sizes: Mapping[str, float]  # of the components that are on and whose sizes are not known, by name
    value: float  # log evidence less the costs of what is on [nats]

    def on(self, residual: Residual) -> frozenset[str]:
        """The optional components that are there."""
        return frozenset(self.sizes) & frozenset(residual.optional)


def log_evidence(residual: Residual, sizes: Mapping[str, float]) -> float:
    """Of a residual with causes of given sizes, costs counted [nats]; minus infinity where V is not positive."""
    try:
        found = Covariance(residual, sizes).evidence
    except np.linalg.LinAlgError:
        return -math.inf
    return found - sum(c.cost for c in residual.components if c.name in sizes)


def most_likely(residual: Residual, on: Collection[str], start: Mapping[str, float] | None = None) -> Weighed:
    """The sizes that make a residual most likely with the optional components that are `on`, searched from `start`."""
    fitted = [c for c in residual.components if not c.known and (not c.cost or c.name in on)]
    bounds = np.log([(c.low, c.high) for c in fitted]).reshape(-1, 2)
    first = np.log([(start or {}).get(c.name, c.first) for c in fitted]).clip(*bounds.T)
    cost = sum(c.cost for c in residual.components if c.name in on)
    names = [c.name for c in fitted]

    def unlikely(logs: Array) -> tuple[float, Array]:
        try:
            covariance = Covariance(residual, dict(zip(names, np.exp(logs).tolist(), strict=True)))
        except np.linalg.LinAlgError:
            return 1e12, np.zeros(len(logs))
        return -covariance.evidence, -covariance.slope(names)

    if not fitted:
        return Weighed({}, log_evidence(residual, {}) - cost)
    found = minimize(unlikely, first, jac=True, bounds=bounds, method="L-BFGS-B", options=EFFORT)
    return Weighed(dict(zip(names, np.exp(found.x).tolist(), strict=True)), -float(found.fun) - cost)


def weigh_components(
    residual: Residual, seeds: Sequence[Weighed] = (Weighed({}, 0.0),), hopeless: Collection[frozenset[str]] = ()
) -> dict[frozenset[str], Weighed]:
    """Every set of optional components that a search visits: from seeds it adds and drops those that help most, while
    one does; sets that are known to be hopeless are left out."""
    seen: dict[frozenset[str], Weighed] = {}
    residual = residual.condensed()

    def visit(on: frozenset[str], start: Mapping[str, float]) -> None:
        if on not in seen and on not in hopeless:
            seen[on] = most_likely(residual, on, start)

    for seed in seeds:
        visit(seed.on(residual), seed.sizes)
    best: Weighed | None = None
    while (top := max(seen.values(), key=lambda w: w.value)) is not best:
        best, on = top, top.on(residual)
        for name in residual.optional:
            if (key := on | {name}) not in seen and key not in hopeless:
                seen[key] = _with_one_more(residual, best, name, key)
        for name in on:
            visit(on - {name}, best.sizes)
    return seen


def _with_one_more(residual: Residual, best: Weighed, name: str, key: frozenset[str]) -> Weighed:
    """A component on that is off: sizes are sought only if it promises something with the others as they are."""
    component = residual.component(name)
    tried = {s: {**best.sizes, name: s} for s in np.geomspace(component.low, component.high, SIZES).tolist()}
    values = {s: log_evidence(residual, sizes) for s, sizes in tried.items()}
    size = max(values, key=lambda s: values[s])
    if values[size] + component.cost < best.value + HOPE:
        return Weighed(tried[size], max(values[size], best.value - component.cost))
    return most_likely(residual, key, tried[size])


def fewest(weight: Mapping[Key, float], enough: float) -> tuple[Key, ...]:
    """The fewest that weigh enough together, the heaviest first; all where they never do."""
    order = sorted(weight, key=lambda key: -weight[key])
    held = np.cumsum([weight[key] for key in order])
    return tuple(order[: int(np.searchsorted(held, enough)) + 1])


def log_share_within(low: Array, high: Array, mean: Array, covariance: Array) -> float:
    """Logarithm of the share of a posterior within bounds over that of its prior N(0, 1), by what is known of each of C
    amplitudes alone: what a prior that ends at the bounds adds to the log evidence."""
    deviation = np.sqrt(np.diag(covariance))
    inside = _log_between((low - mean) / deviation, (high - mean) / deviation)
    return float((inside - _log_between(low, high)).sum())


def _log_between(low: Array, high: Array) -> Array:
    """Logarithm of the probability that N(0, 1) lies between, with care for its tails."""
    flip = low > 0  # where both lie above 0 the lower tail is as exact as the upper one is not
    a, b = np.where(flip, -high, low), np.where(flip, -low, high)
    upper, lower = log_ndtr(b), log_ndtr(a)
    return np.asarray(upper + np.log1p(-np.exp(np.minimum(lower - upper, -1e-12))))
