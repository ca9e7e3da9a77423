"""What effects promise from where a hypothesis stands, to first order, by which what is fitted is chosen.

Shapes: E parameters of effects, C columns.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch

from myowave.data.trials import Array
from myowave.diagnosis.likelihood.algebra import Covariance, Weighed, log_share_within, most_likely
from myowave.diagnosis.likelihood.components import REPEATS, residual_above
from myowave.diagnosis.likelihood.hypothesis import Hypothesis
from myowave.diagnosis.search.score import ScoreTest, score_effects
from myowave.identification.free_parameters import bounds, scales
from myowave.identification.least_squares import scaled_slope
from myowave.physics.effect import Effect

VISIBLE = 1.0  # information [-] below which an effect is worth no place in a pair
SAME = 0.99  # cosine between a part of the general correction and an effect, above which they are one


@dataclass(frozen=True)
class Screened:
    """Log posteriors, to first order."""

    scores: Mapping[str, ScoreTest]  # of each effect, with the fit to descend from
    # singles, pairs: of effects and of pairs of them, beside the likeliest causes or none
    singles: Mapping[str, float]
    ideal: Mapping[str, float]  # of effects with noise alone beside them
    pairs: Mapping[tuple[str, str], float]
    parts: Mapping[int, float]  # of each part of the general correction, but for those that an effect does


def screen(model: Hypothesis, catalogue: Mapping[str, Effect]) -> Screened:
    """Every effect, pair of effects and part of the general correction, beside what a model's best states have."""
    fit, residual = model.fit, model.residual
    scores = score_effects(fit, catalogue.values())
    names = [name for name, score in scores.items() if not score.failure]
    columns, place, limits = [], {}, {}
    for name in names:
        free = scores[name].free
        slope = scores[name].start.sensitive.by_parameter[len(fit.free) :]
        columns.append(model.view.amplitudes(scaled_slope(slope, scales(free), fit.record.valid)))
        first = sum(c.shape[-1] for c in columns[:-1])
        place[name] = np.arange(first, first + len(free))
        limits[name] = tuple(bound / scales(free) for bound in bounds(free))
    own = residual.columns(REPEATS)
    columns.append(own * torch.sqrt((residual.values**2).sum() / fit.record.samples))
    together = torch.cat(columns, -1)
    own = np.arange(together.shape[-1])[-own.shape[-1] :]
    singles = dict.fromkeys(names, -np.inf)
    pairs: dict[tuple[str, str], float] = {}
    ideal: dict[str, float] = {}
    parts = np.full(len(own), -np.inf)
    likeliest = sorted(model.counted.values(), key=lambda s: -s.value)[:2]
    for state in (*(s for s in likeliest if s.value > -np.inf), noise_alone(model)):
        covariance = Covariance(residual, state.sizes)
        products = covariance.inner(together, together).numpy()
        with_left = covariance.with_residual(together).numpy()

        def promise(*members: str, products: Array = products, with_left: Array = with_left) -> float:
            chosen = np.concatenate([place[m] for m in members])
            low, high = (np.concatenate([limits[m][i] for m in members]) for i in (0, 1))
            return _promise(products[np.ix_(chosen, chosen)], with_left[chosen], low, high)

        ideal = {name: state.value + promise(name) for name in names}
        singles = {name: max(singles[name], ideal[name]) for name in names}
        seen = [n for n in names if np.trace(products[np.ix_(place[n], place[n])]) > VISIBLE]
        for i, one in enumerate(seen):
            for other in seen[i + 1 :]:
                pairs[one, other] = max(pairs.get((one, other), -np.inf), state.value + promise(one, other))
        size = np.diag(products)[own]
        parts = np.maximum(parts, state.value + 0.5 * (with_left[own] ** 2 / (1 + size) - np.log1p(size)))
        for name in names:
            inside = np.linalg.pinv(products[np.ix_(place[name], place[name])], rcond=1e-8, hermitian=True)
            cross = products[np.ix_(place[name], own)]
            shared = np.einsum("ec,ef,fc->c", cross, inside, cross) / size.clip(1e-300)
            parts[np.sqrt(shared.clip(0)) > SAME] = -np.inf
    offset = model.offset
    return Screened(
        scores,
        {n: v + offset for n, v in singles.items()},
        {n: v + offset for n, v in ideal.items()},
        {n: v + offset for n, v in pairs.items()},
        {n: float(v) + offset for n, v in enumerate(parts) if np.isfinite(v)},
    )


def _promise(products: Array, with_left: Array, low: Array, high: Array) -> float:
    """What amplitudes N(0, 1) within bounds add to a log evidence."""
    spread: Array = np.asarray(np.linalg.inv(np.eye(len(products)) + products))
    mean = spread @ with_left
    return float(0.5 * (with_left @ mean + np.linalg.slogdet(spread)[1])) + log_share_within(low, high, mean, spread)


def noise_alone(model: Hypothesis) -> Weighed:
    """The state without any cause but noise, as strong as above the band of the motion."""
    if not len(model.residual.tail):
        return most_likely(model.residual, ())
    sizes = most_likely(residual_above(model.fit, model.view), ()).sizes
    return Weighed(sizes, Covariance(model.residual, sizes).evidence)
