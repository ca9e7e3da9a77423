"""What the posterior of models allows to say: names at 95 %, the smallest class that holds 95 %, or no more.

A probability alone is no licence to name: among thousands of samples a wrong model wins by a thousand nats over worse
ones. So what the best model leaves has to be noise too, divided by its covariance; else something else is missing.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from myowave.diagnosis.causes import CLOCK_DRIFT, EMG_NOISE, GAIN_PER_TRIAL, OUTSIDE, OWN_CURVES
from myowave.diagnosis.likelihood.columns import CURVES, DRIFT, EMG, GAINS, REPEATS, SLOW, TISSUE
from myowave.diagnosis.likelihood.hypothesis import Hypothesis
from myowave.diagnosis.search.by_evidence import Posterior

Array = NDArray[np.float64]

NAMED = 0.95
LIKELY = 0.5
UNLIKELY = 1e-4  # of noise: what is left is then not noise
SURPRISING = 6e-5  # 4 standard deviations
NAME_OF = {
    EMG: EMG_NOISE,
    CURVES: OWN_CURVES,
    REPEATS: OUTSIDE,
    SLOW: OUTSIDE,
    TISSUE: OUTSIDE,
    DRIFT: CLOCK_DRIFT,
    GAINS: GAIN_PER_TRIAL,
}

Kind = Literal["adequate", "effect", "class", "partial", "unknown", "undecidable"]


@dataclass(frozen=True)
class Answer:
    """The answer.

    Args:
        kind: see `verdict.Verdict`.
        named: classes of names, most of one: effects, and causes of `diagnosis.causes`.
        probabilities: of every name, `OUTSIDE` for what the catalogue lacks.
        best: the most likely model.
        white: p-value of what it leaves, divided by its covariance, being noise.
        usual: p-value of its constants being as expected.
    """

    kind: Kind
    named: tuple[tuple[str, ...], ...]
    probabilities: Mapping[str, float]
    best: Hypothesis
    white: float
    usual: float

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """95 % of each parameter of the best model."""
        mean, covariance = self.best.estimate
        error = 1.96 * np.sqrt(np.diag(covariance))
        return {
            p.name: (m - e, m + e) for p, m, e in zip(self.best.fit.free, mean.tolist(), error.tolist(), strict=True)
        }


def answer_of(posterior: Posterior) -> Answer:
    """What is said of a posterior."""
    rows = [
        (p, frozenset({*effects, *(NAME_OF[c] for c in on if c in NAME_OF)})) for p, effects, on in posterior.weights()
    ]
    probabilities = {
        name: sum(p for p, names in rows if name in names) for name in {n for _, names in rows for n in names}
    }
    sure = [name for name, p in probabilities.items() if p >= NAMED]
    classes: list[tuple[str, ...]] = [(name,) for name in sorted(sure, key=lambda n: -probabilities[n])]
    weight: dict[str, float] = {}
    for p, names in rows:
        if rest := names - set(sure):
            first = max(rest, key=lambda n: probabilities[n])
            weight[first] = weight.get(first, 0.0) + p
    something = sum(weight.values())
    if something >= NAMED:
        classes.append(_smallest(weight))
    best = posterior.best
    white, usual = p_of_noise(best), p_of_constants(best)
    # What does not leave noise names nothing.
    named = tuple(c for c in classes if c != (OUTSIDE,)) if white > UNLIKELY else ()
    beyond = len(named) < len(classes) or probabilities.get(OUTSIDE, 0.0) > LIKELY or white < UNLIKELY
    return Answer(_kind(named, something, usual, beyond=beyond), named, probabilities, best, white, usual)


def _kind(named: tuple[tuple[str, ...], ...], something: float, usual: float, *, beyond: bool) -> Kind:
    if beyond:
        return "partial" if named else "unknown"
    if named:
        return "class" if any(len(members) > 1 for members in named) else "effect"
    return "undecidable" if something > LIKELY or usual < SURPRISING else "adequate"


def _smallest(weight: Mapping[str, float]) -> tuple[str, ...]:
    """The fewest names that hold 95 % together."""
    chosen: list[str] = []
    for name in sorted(weight, key=lambda n: -weight[n]):
        chosen.append(name)
        if sum(weight[n] for n in chosen) >= NAMED:
            break
    return tuple(chosen)


def p_of_noise(model: Hypothesis) -> float:
    """p-value of what a model leaves, divided by a root of its covariance, being white noise of variance 1: of the most
    surprising of the frequencies and trials that it is sorted by, times their number."""
    left = model.covariance.white()
    frequency = np.concatenate(model.looking.view.frequency)
    by_frequency = np.array_split(np.argsort(frequency, kind="stable"), BANDS)
    groups = [*by_frequency, *(np.arange(rows.start, rows.stop) for rows in model.residual.rows)]
    if len(model.residual.tail):
        above = model.residual.tail / np.sqrt(model.covariance.tail)
        parts = np.array_split(np.argsort(np.concatenate(model.looking.view.frequency_above)), 4)
        squares = [left[group] ** 2 for group in groups] + [above[part] ** 2 for part in parts]
    else:
        squares = [left[group] ** 2 for group in groups]
    worst = min(float(chi2.sf(s.sum(), len(s))) for s in squares if len(s))
    return min(1.0, worst * len(squares))


BANDS = 6


def p_of_constants(model: Hypothesis) -> float:
    """p-value of the constants of a model being as expected: how far data took them, by the share that data know."""
    free = model.fit.free
    place = [i for i, p in enumerate(free) if np.isfinite(p.deviation) and not p.fixed]
    if not place:
        return 1.0
    mean, covariance = model.estimate
    deviation = np.array([free[i].deviation for i in place])
    off = (mean[place] - np.array([free[i].start for i in place])) / deviation
    known = np.eye(len(place)) - covariance[np.ix_(place, place)] / np.outer(deviation, deviation)
    values, vectors = np.linalg.eigh(known)
    told = values > 0.1
    squares = (vectors[:, told].T @ off) ** 2 / values[told]
    return float(chi2.sf(squares.sum(), max(int(told.sum()), 1)))
