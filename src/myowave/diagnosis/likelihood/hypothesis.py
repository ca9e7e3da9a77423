"""A model as one hypothesis: how likely its residual is, with every set of causes beside it, and its best parameters.

Shapes: T trials, P free parameters, W waves of a trial.
"""

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from scipy.special import logsumexp, softmax
from torch import Tensor

from myowave.data.trials import Array
from myowave.diagnosis.causes import NAMED
from myowave.diagnosis.likelihood.algebra import (
    COST,
    Covariance,
    Residual,
    Weighed,
    fewest,
    log_share_within,
    most_likely,
    weigh_components,
)
from myowave.diagnosis.likelihood.components import (
    COLOURED,
    EMG,
    coloured,
    for_each,
    prior_of,
    residual_of,
    start_columns,
    start_prior,
)
from myowave.diagnosis.likelihood.waves import MEMORIES_S, View
from myowave.identification.free_parameters import bounds, scales
from myowave.identification.least_squares import LITTLE, along_bend, descend, minimise_within
from myowave.identification.output_error import Fit, polish, take_step
from myowave.identification.stages import attempt_fit

PARAMETERS = ("constants", "starts")
BEHIND = 20.0  # nats: a model, or a set of causes, that is so far behind another is followed no further
CLIMBS = 3  # times that parameters and sizes follow one another


@dataclass(frozen=True)
class Hypothesis:
    """A fitted model, with every set of causes that a search visited."""

    effects: tuple[str, ...]  # names of those in the model
    fit: Fit
    view: View
    residual: Residual
    states: dict[frozenset[str], Weighed]  # by the causes that are on
    catalogue: frozenset[str] = frozenset()  # names of the effects that it may have
    expected_emg: bool = False  # whether its EMG is what is expected behind the recorded noise

    @classmethod
    def of(cls, fit: Fit, view: View, catalogue: Collection[str] = ()) -> "Hypothesis":
        """A model as a fit has it, no effect of which was weighed, linearised where that stands."""
        residual = residual_of(fit, view, catalogue)
        return cls((), fit, view, residual, weigh_components(residual), catalogue=frozenset(catalogue))

    def at(self, fit: Fit, hopeless: Collection[frozenset[str]] = ()) -> "Hypothesis":
        """The same where another fit stands, whose causes are sought from the most likely ones here, but for sets of
        them that are known to be hopeless."""
        residual = residual_of(fit, self.view, self.catalogue)
        return replace(self, fit=fit, residual=residual, states=weigh_components(residual, [self.best], hopeless))

    @property
    def counted(self) -> dict[frozenset[str], Weighed]:
        """The states that count: an EMG other than the recorded one has noise, whatever noise costs."""
        if not self.expected_emg:
            return self.states
        return {on: state for on, state in self.states.items() if EMG in on}

    @property
    def best(self) -> Weighed:
        return max(self.counted.values(), key=lambda state: state.value)

    @property
    def on(self) -> frozenset[str]:
        """The causes that are there in the best state."""
        return self.best.on(self.residual)

    @cached_property
    def by_least_squares(self) -> Fit:
        """The fit of the same model by least squares, from here; the same one where that fails."""
        return attempt_fit(lambda: polish(self.fit)) or self.fit

    @cached_property
    def covariance(self) -> Covariance:
        """Of the best state."""
        return Covariance(self.residual, self.best.sizes)

    @property
    def prior(self) -> float:
        """Logarithm of how likely each effect of the catalogue is before any trial."""
        return -math.log(2 * max(len(self.catalogue), 1))

    @cached_property
    def offset(self) -> float:
        """What all states have in common: priors and bounds of the effects, the sensor."""
        sensor = 0.0 if self.view.sensor.corner_hz is None else COST
        return self.prior * len(self.effects) + self._within_bounds(self.effects) - sensor

    @property
    def total(self) -> float:
        """Logarithm of how likely the trials and the model are, up to a constant [nats]."""
        return float(logsumexp([state.value for state in self.counted.values()])) + self.offset

    def without(self, name: str) -> float:
        """The total of the model less one of its effects, to first order about this one: the density of the effect's
        parameters at 0, posterior over prior. Source: Dickey 1971, Ann. Math. Stat. 42, 204."""
        place = [i for i, p in enumerate(self.fit.free) if p.name.split(".")[0] == name]

        def at_zero(state: Weighed) -> float:
            mean, covariance = self._posterior(state)
            off, spread = mean[place], covariance[np.ix_(place, place)]  # what both densities have of 2 pi cancels
            return state.value - float(off @ np.linalg.solve(spread, off) + np.linalg.slogdet(spread)[1]) / 2

        near = (state for state in self.counted.values() if state.value > self.best.value - BEHIND)
        others = self._within_bounds([effect for effect in self.effects if effect != name])
        own = self._within_bounds(self.effects) - others + self.prior
        return float(logsumexp([*map(at_zero, near)])) + self.offset - own

    @cached_property
    def estimate(self) -> tuple[Array, Array]:
        """Posterior of the free parameters, mean (P,) and covariance (P, P), in their own units, in the best state."""
        return self._estimate_in(self.best)

    @cached_property
    def averaged(self) -> dict[str, tuple[float, float]]:
        """Posterior mean and standard deviation of each free parameter, in its own unit, over the likely states."""
        values = {on: state.value for on, state in self.counted.items()}
        likely = fewest(dict(zip(values, softmax([*values.values()]), strict=True)), NAMED)
        weight = softmax([values[on] for on in likely])
        means, covariances = map(np.array, zip(*(self._estimate_in(self.counted[on]) for on in likely), strict=True))
        mean = weight @ means
        variance = weight @ (covariances.diagonal(axis1=1, axis2=2) + (means - mean) ** 2)
        pairs = zip(mean.tolist(), np.sqrt(variance).tolist(), strict=True)
        return dict(zip((p.name for p in self.fit.free), pairs, strict=True))

    def _estimate_in(self, state: Weighed) -> tuple[Array, Array]:
        """See `estimate`; what a dynamometer measured comes to what the motion says."""
        (deviation, centre), (mean, covariance) = prior_of(self.fit), self._posterior(state)
        mean, covariance = centre + mean * deviation, covariance * np.outer(deviation, deviation)
        left, slope = self.fit.measured_torque
        gain = np.linalg.solve(slope @ covariance @ slope.T + np.eye(len(left)), slope @ covariance).T
        unit = scales(self.fit.free)
        mean = mean + gain @ (left - slope @ (mean - self.fit.values / unit))
        return mean * unit, (covariance - gain @ slope @ covariance) * np.outer(unit, unit)

    def _posterior(self, state: Weighed) -> tuple[Array, Array]:
        """Posterior of the free parameters by the motion, in the units of `prior_of`: N(0, 1) before it."""
        others = Covariance(self.residual.without(["constants"]), state.sizes)
        return others.posterior(self.residual.columns("constants"))

    def _within_bounds(self, effects: Collection[str]) -> float:
        """See `log_share_within`; of the parameters of effects, which are expected about 0."""
        place = [i for i, p in enumerate(self.fit.free) if p.name.split(".")[0] in effects]
        if not place:
            return 0.0
        mean, covariance = self._posterior(self.best)
        unit = (scales(self.fit.free) * prior_of(self.fit)[0])[place]
        low, high = (bound[place] / unit for bound in bounds(self.fit.free))
        return log_share_within(low, high, mean[place], covariance[np.ix_(place, place)])


def settle(begin: Hypothesis, leader: float = -math.inf, steps: int = 4) -> Hypothesis:
    """The same fitted model where its parameters are most likely, causes weighed anew there after so many steps of
    these; one that stays `BEHIND` the leader, the most likely model so far, is given up."""
    best = begin
    hopeless = {on for on, state in begin.states.items() if state.value < begin.best.value - BEHIND}
    for _ in range(CLIMBS):
        if best.total < leader - BEHIND:
            break
        fit = climb(best, steps)
        if fit is best.fit:
            break
        found = best.at(fit, hopeless)
        gained = found.total - best.total
        # Causes act to first order: steps that let them take up more may lead where they could not do that.
        if gained > 0:
            best = found
        if gained < 2 * LITTLE:
            break
    return best


def climb(hypothesis: Hypothesis, steps: int) -> Fit:
    """Gauss-Newton steps to the most likely parameters, with the covariance of the best state."""
    fit, view = hypothesis.fit, hypothesis.view
    covariance = Covariance(hypothesis.residual.without(PARAMETERS), hypothesis.best.sizes)
    (deviation, centre), (spread, begin) = prior_of(fit), start_prior(fit)
    weight, unit = np.r_[1 / deviation**2, np.ones(begin.size)], scales(fit.free)
    (low, high), no_bound = bounds(fit.free), np.full(begin.size, np.inf)

    def left_of(some: Fit) -> tuple[Tensor, Array]:
        off = np.r_[centre - some.values / unit, ((begin - some.starts) / spread).flatten()]
        return view.left(some)[..., None], off

    def objective(some: Fit) -> float:
        left, off = left_of(some)
        return float(covariance.inner(left, left)) + float(weight @ off**2)

    def attempts(fit: Fit) -> Iterator[Fit | None]:
        left, off = left_of(fit)
        columns = torch.cat([view.amplitudes(fit.normal.slope), for_each(start_columns(fit, view)[0])], -1)
        matrix = covariance.inner(columns, columns).numpy() + np.diag(weight)
        matrix += 1e-9 * np.diag(np.diag(matrix))
        vector = covariance.inner(columns, left)[:, 0].numpy() + weight * off
        lowest = np.r_[(low - fit.values) / unit, -no_bound]
        highest = np.r_[(high - fit.values) / unit, no_bound]
        straight = minimise_within(matrix, vector, lowest, highest)
        if 2 * straight @ vector - straight @ matrix @ straight < LITTLE / 3:
            return

        def take(step: Array) -> Fit | None:
            step = step.clip(lowest, highest)
            return take_step(fit, step[: len(unit)], step[len(unit) :].reshape(-1, 2) * spread)

        def taken(step: Array) -> Tensor:
            return columns @ torch.from_numpy(step)[:, None]

        def bend(tried: Fit, step: Array) -> tuple[Array, Array]:
            bent = left_of(tried)[0] - left + taken(step)
            leaning = np.linalg.solve(matrix, covariance.inner(columns, bent)[:, 0].numpy())
            path = torch.cat([left, taken(straight), bent - taken(leaning)], -1)
            of_prior = np.stack([off, straight, -leaning])
            return leaning, covariance.inner(path, path).numpy() + (of_prior * weight) @ of_prior.T

        yield from along_bend(straight, take, bend)

    *_, last = descend(fit, objective, attempts, steps, LITTLE)
    return last


def with_likely_memory(hypothesis: Hypothesis) -> Hypothesis:
    """The same with the memory of the sensor's coloured noise that makes the residual most likely."""
    if COLOURED not in hypothesis.residual.optional:
        return hypothesis
    residual, view = hypothesis.residual, hypothesis.view
    others = {memory_s: residual.with_components([coloured(view, memory_s)]) for memory_s in MEMORIES_S}
    causes = hypothesis.on | {COLOURED}, frozenset({COLOURED})
    tried = {m: [most_likely(other, on, hypothesis.best.sizes) for on in causes] for m, other in others.items()}
    memory_s = max(tried, key=lambda m: max(state.value for state in tried[m]))
    if memory_s == view.memory_s:
        return hypothesis
    other, seeds = others[memory_s], [hypothesis.best, *tried[memory_s]]
    view = replace(view, memory_s=memory_s)
    return replace(hypothesis, view=view, residual=other, states=weigh_components(other, seeds))
