"""What effects promise from where a hypothesis stands, to first order, by which what is fitted is chosen.

Shapes: T trials, W waves of a trial, E parameters of effects.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from myowave.data.trials import Array
from myowave.diagnosis.likelihood.algebra import Covariance, Key, Weighed, log_share_within, most_likely
from myowave.diagnosis.likelihood.components import residual_above, usual_strength
from myowave.diagnosis.likelihood.hypothesis import Hypothesis
from myowave.diagnosis.search.score import ScoreTest, score_effects
from myowave.identification.free_parameters import bounds, scales
from myowave.physics.effect import Effect

VISIBLE = 1.0  # information [-] below which an effect is worth no place in a pair


@dataclass(frozen=True)
class Screened:
    """Log posteriors, to first order."""

    scores: Mapping[str, ScoreTest]  # of each effect, with the fit to descend from
    # singles, pairs: of effects and of pairs of them, beside the likeliest causes or none
    singles: Mapping[str, float]
    ideal: Mapping[str, float]  # of effects with noise alone beside them
    pairs: Mapping[tuple[str, str], float]  # where the model has no effect


def screen(model: Hypothesis, catalogue: Mapping[str, Effect]) -> Screened:
    """Every effect and pair of effects, beside what a model's best states have."""
    scores = score_effects(model.fit, catalogue.values())
    more = _More.of(model, scores)

    def beside(state: Weighed) -> tuple[dict[str, float], dict[tuple[str, str], float]]:
        gain, seen = more.beside(Covariance(model.residual, state.sizes))
        without = state.value + model.offset
        singles = {name: without + gain(name) for name in more.place}
        pairs = () if model.effects else combinations(seen, 2)
        return singles, {pair: without + gain(*pair) for pair in pairs}

    alone, likeliest = beside(noise_alone(model)), sorted(model.counted.values(), key=lambda s: -s.value)[:2]
    singles, pairs = zip(*(beside(s) for s in likeliest if s.value > -np.inf), alone, strict=True)
    return Screened(scores, _highest(singles), alone[0], _highest(pairs))


@dataclass(frozen=True)
class _More:
    """What effects that a model lacks would do to first order, in standard deviations of their parameters."""

    columns: Tensor  # (T, W, E)
    place: Mapping[str, NDArray[np.int64]]  # of the parameters of each effect among these
    low: Array  # bounds of the parameters, (E,), and `high`
    high: Array

    @classmethod
    def of(cls, model: Hypothesis, scores: Mapping[str, ScoreTest]) -> "_More":
        sound, known = {name: score for name, score in scores.items() if not score.failure}, len(model.fit.free)
        nothing = np.zeros((*model.fit.record.valid.shape, 0))
        slope = np.concatenate([nothing, *(s.start.normal.slope[..., known:] for s in sound.values())], -1)
        free = [p for score in sound.values() for p in score.free]
        usual = usual_strength(slope, model.fit.record.samples)
        low, high = (bound / (scales(free) * usual) for bound in bounds(free))
        ends = np.cumsum([len(score.free) for score in sound.values()])
        place = dict(zip(sound, np.split(np.arange(len(free)), ends[:-1]), strict=False))
        return cls(model.view.amplitudes(slope * usual), place, low, high)

    def beside(self, covariance: Covariance) -> tuple[Callable[..., float], list[str]]:
        """What some of them, by name, add to the log evidence of a residual, and the names of those that it shows."""
        products = covariance.inner(self.columns, self.columns).numpy()
        with_left = covariance.with_residual(self.columns).numpy()

        def gain(*names: str) -> float:
            chosen = np.concatenate([self.place[name] for name in names])
            of = self.low[chosen], self.high[chosen]
            return _promise(products[np.ix_(chosen, chosen)], with_left[chosen], *of)

        return gain, [n for n, of in self.place.items() if np.trace(products[np.ix_(of, of)]) > VISIBLE]


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
