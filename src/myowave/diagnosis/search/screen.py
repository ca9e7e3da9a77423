"""What effects promise from where a hypothesis stands, to first order, by which what is fitted is chosen."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

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
    scores, known = score_effects(model.fit, catalogue.values()), len(model.fit.free)
    sound = {name: score for name, score in scores.items() if not score.failure}
    owner = np.array([name for name, score in sound.items() for _ in score.free])
    place = {name: np.flatnonzero(owner == name) for name in sound}  # of its parameters among those of all
    # What they would do to first order, in standard deviations of their parameters.
    nothing = np.zeros((*model.fit.record.valid.shape, 0))
    slope = np.concatenate([nothing, *(score.start.normal.slope[..., known:] for score in sound.values())], -1)
    usual = usual_strength(slope, model.fit.record.samples)
    columns, free = model.view.amplitudes(slope * usual), [p for score in sound.values() for p in score.free]
    low, high = (bound / (scales(free) * usual) for bound in bounds(free))

    def beside(state: Weighed) -> tuple[dict[str, float], dict[tuple[str, str], float]]:
        covariance = Covariance(model.residual, state.sizes)
        products, with_left = covariance.inner(columns, columns).numpy(), covariance.with_residual(columns).numpy()
        without = state.value + model.offset

        def promised(*names: str) -> float:
            own = np.concatenate([place[name] for name in names])
            return without + _promise(products[np.ix_(own, own)], with_left[own], low[own], high[own])

        seen = [name for name, own in place.items() if np.trace(products[np.ix_(own, own)]) > VISIBLE]
        pairs = () if model.effects else combinations(seen, 2)
        return {name: promised(name) for name in place}, {pair: promised(*pair) for pair in pairs}

    alone, likeliest = beside(noise_alone(model)), sorted(model.counted.values(), key=lambda s: -s.value)[:2]
    singles, pairs = zip(*(beside(s) for s in likeliest if s.value > -np.inf), alone, strict=True)
    return Screened(scores, _highest(singles), alone[0], _highest(pairs))


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
