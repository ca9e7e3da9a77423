"""What effects promise from where a hypothesis stands, to first order, by which what is fitted is chosen.

Shapes: T trials, W waves of a trial, E parameters of effects.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import TypeVar

import numpy as np
import torch
from torch import Tensor

from myowave.data.trials import Array
from myowave.diagnosis.likelihood.algebra import Component, Covariance, Residual, Weighed, log_share_within, most_likely
from myowave.diagnosis.likelihood.components import farthest_of, residual_above
from myowave.diagnosis.likelihood.hypothesis import Hypothesis
from myowave.diagnosis.search.score import ScoreTest, score_effects
from myowave.identification.free_parameters import Free, bounds, scales
from myowave.identification.least_squares import scaled_slope
from myowave.physics.effect import Effect

VISIBLE = 1.0  # information [-] below which an effect is worth no place in a pair

Key = TypeVar("Key")


@dataclass(frozen=True)
class Screened:
    """Log posteriors, to first order."""

    scores: Mapping[str, ScoreTest]  # of each effect, with the fit to descend from
    # singles, pairs: of effects and of pairs of them, beside the likeliest causes or none
    singles: Mapping[str, float]
    ideal: Mapping[str, float]  # of effects with noise alone beside them
    pairs: Mapping[tuple[str, str], float]
    exchanges: Mapping[tuple[str, str], float]  # of each effect of the model, without it and with another


def screen(model: Hypothesis, catalogue: Mapping[str, Effect]) -> Screened:
    """Every effect and pair of effects, beside what a model's best states have."""
    fit, view, values = model.fit, model.view, model.residual.values
    scores = score_effects(fit, catalogue.values())
    free = {name: score.free for name, score in scores.items() if not score.failure}
    columns, farthest = [values.new_zeros(*values.shape[:2], 0)], [np.zeros(0)]
    for name in free:
        by_parameter = scores[name].start.sensitive.by_parameter[len(fit.free) :]
        slope = scaled_slope(by_parameter, scales(free[name]), fit.record.valid)
        farthest.append(farthest_of(slope, fit))
        columns.append(view.amplitudes(slope * farthest[-1]))
    beside = partial(_beside, model, torch.cat(columns, -1), free, np.concatenate(farthest))
    likeliest = [s for s in sorted(model.counted.values(), key=lambda s: -s.value)[:2] if s.value > -np.inf]
    alone = beside(noise_alone(model), model.residual)
    singles, pairs = zip(*(beside(state, model.residual) for state in likeliest), alone, strict=True)
    # Where a model stands that has one effect, another that may take its place is seen better than from afar.
    exchanges = {
        (gone, come): value
        for gone in model.effects
        for come, value in _highest(beside(state, _without(model, gone))[0] for state in likeliest).items()
    }
    return Screened(scores, _highest(singles), alone[0], _highest(pairs), exchanges)


def _without(model: Hypothesis, effect: str) -> Residual:
    """What a model would leave without one of its effects, to first order."""
    kept = [i for i, p in enumerate(model.fit.free) if p.name.partition(".")[0] != effect]
    return model.residual.with_components(
        [Component("constants", columns=model.residual.columns("constants")[..., kept])]
    )


def _beside(
    model: Hypothesis,
    columns: Tensor,
    free: Mapping[str, Sequence[Free]],
    farthest: Array,
    state: Weighed,
    residual: Residual,
) -> tuple[dict[str, float], dict[tuple[str, str], float]]:
    """Log posteriors of each effect and of pairs of them, beside the causes of a state and what makes up a residual.

    Args:
        columns: what one standard deviation of each parameter of all effects does, (T, W, E).
        free: these parameters, by effect, and `farthest`, these deviations in units of their scales, (E,).
    """
    covariance, all_of_them = Covariance(residual, state.sizes), [p for some in free.values() for p in some]
    value = state.value
    if residual is not model.residual:
        value += covariance.evidence - Covariance(model.residual, state.sizes).evidence
    products, with_left = covariance.inner(columns, columns).numpy(), covariance.with_residual(columns).numpy()
    low, high = (bound / (scales(all_of_them) * farthest) for bound in bounds(all_of_them))
    ends = np.cumsum([len(some) for some in free.values()])
    place = dict(zip(free, np.split(np.arange(len(low)), ends[:-1]), strict=False))

    def with_effects(*members: str) -> float:
        chosen = np.concatenate([place[name] for name in members])
        found = _promise(products[np.ix_(chosen, chosen)], with_left[chosen], low[chosen], high[chosen])
        return value + model.offset + found

    seen = [name for name in place if np.trace(products[np.ix_(place[name], place[name])]) > VISIBLE]
    return {n: with_effects(n) for n in place}, {pair: with_effects(*pair) for pair in combinations(seen, 2)}


def _highest(found: Iterable[Mapping[Key, float]]) -> dict[Key, float]:
    """Of each key the highest value that any has."""
    highest: dict[Key, float] = {}
    for values in found:
        for key, value in values.items():
            highest[key] = max(value, highest.get(key, -np.inf))
    return highest


def _promise(products: Array, with_left: Array, low: Array, high: Array) -> float:
    """What amplitudes N(0, 1) within bounds add to a log evidence."""
    spread: Array = np.asarray(np.linalg.inv(np.eye(len(products)) + products))
    mean = spread @ with_left
    return float(0.5 * (with_left @ mean + np.linalg.slogdet(spread)[1])) + log_share_within(low, high, mean, spread)


def noise_alone(model: Hypothesis) -> Weighed:
    """The state without any cause but noise, as strong as above the band of the motion."""
    if not model.residual.apart:
        return most_likely(model.residual, ())
    sizes = most_likely(residual_above(model.fit, model.view), ()).sizes
    return Weighed(sizes, Covariance(model.residual, sizes).evidence)
