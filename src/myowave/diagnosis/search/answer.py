"""What the posterior of models allows to say: names at 95 %, the smallest class that holds 95 %, or no more.

A probability alone is no licence to name: among thousands of samples a wrong model wins by a thousand nats over worse
ones. So what the best model leaves has to be noise too, divided by its covariance; else something else is missing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from scipy.stats import chi2

from myowave.diagnosis.causes import EMG_NOISE, GAIN_PER_TRIAL, LIKELY, NAMED, OUTSIDE, OWN_SHAPES
from myowave.diagnosis.likelihood.components import COLOURED, CURVES, EMG, GAINS, MISSING, NOISE, PATHS
from myowave.diagnosis.likelihood.hypothesis import Hypothesis
from myowave.diagnosis.search.weigh import Posterior

UNLIKELY = 1e-4  # of noise: what is left is then not noise
SURPRISING = 6e-5  # 4 standard deviations
FAR = 3.0  # standard deviations
KNOWN = 0.1  # share of what was not known of constants that data must have taken, or errors of linearising decide
BANDS = 6  # of frequencies, in which what is left is looked at
ANYTHING = "something that the catalogue lacks"
NAME_OF = dict.fromkeys(MISSING, OUTSIDE) | {
    CURVES: OWN_SHAPES,
    PATHS: OWN_SHAPES,
    EMG: EMG_NOISE,
    GAINS: GAIN_PER_TRIAL,
}

# adequate; effect (named ones, and nothing is left but noise); class (some cannot be told apart); partial (named, while
# something else is missing); unknown (something is missing that no effect explains); undecidable (a parameter may hide
# an effect)
Kind = Literal["adequate", "effect", "class", "partial", "unknown", "undecidable"]


@dataclass(frozen=True)
class Answer:
    """The answer."""

    kind: Kind
    named: tuple[tuple[str, ...], ...]  # classes of names, most of one: effects, and causes of `diagnosis.causes`
    probabilities: Mapping[str, float]  # of every name, `OUTSIDE` for what the catalogue lacks
    best: Hypothesis  # the most likely model
    white: float  # p-value of what it leaves, divided by its covariance, being noise
    usual: float  # p-value of its constants being as expected

    @property
    def missing(self) -> float:
        """How far what no effect explains moves the arm, root mean square [rad]; no farther than the model misses, as
        other terms of the best model may take back what one of them does."""
        fit = self.best.fit
        strange = [name for name in self.best.best.sizes if name in MISSING]
        if not strange:  # what is none of these and was taken for noise, but is more than the angle itself shows
            return float(np.sqrt(max(fit.rmse() ** 2 - fit.record.noise**2, 0.0)))
        made = torch.stack([self.best.covariance.made_by(name) for name in strange]).sum(0)
        return min(float((made**2).sum() / fit.record.samples) ** 0.5, fit.rmse())

    @property
    def unusual(self) -> dict[str, tuple[str, ...]]:
        """Constants that data took far from where they are expected, if that is beyond belief, and what that may stand
        for."""
        if self.usual > SURPRISING:
            return {}
        mean, _ = self.best.estimate
        off = {p.name: abs(m - p.start) / p.deviation for p, m in zip(self.best.fit.free, mean, strict=True)}
        return {name: (ANYTHING,) for name in off if off[name] > FAR} or {max(off, key=lambda n: off[n]): (ANYTHING,)}

    @property
    def of_shapes(self) -> bool:
        """Whether muscle curves or paths of another shape are named."""
        return (OWN_SHAPES,) in self.named

    @property
    def emg_noise(self) -> float:
        """Of the recorded EMG [-]; 0 where it is not named."""
        if not any(EMG_NOISE in members for members in self.named):
            return 0.0
        return self.best.best.sizes.get(EMG, 0.0)

    @property
    def emg_motion(self) -> float:
        """How far that noise takes the simulated motion from the measured one, root mean square [rad]."""
        blocks = self.best.residual.component(EMG).blocks
        assert blocks is not None
        power = float(blocks.diagonal(dim1=-2, dim2=-1).sum())
        return self.emg_noise * float(np.sqrt(power / self.best.fit.record.samples))

    @property
    def angle_noise(self) -> float:
        """Of the angle, what its filter has left of it [rad]."""
        covariance, samples, residual = self.best.covariance, self.best.fit.record.samples, self.best.residual
        within = above = 0.0
        for name in (NOISE, COLOURED):
            if (size := covariance.sizes.get(name)) is not None:
                component = residual.component(name)
                assert component.blocks is not None and component.tail is not None
                within += float(size**2 * component.blocks.diagonal(dim1=-2, dim2=-1).sum())
                above += float(size**2 * component.tail.sum())
        view = self.best.view
        waves, waves_above = int(view.band.there.sum()), int((view.above.frequency > 0).sum())
        filtered = (within + above * (samples - waves) / max(waves_above, 1)) / samples
        return float(np.hypot(covariance.sizes["floor"], np.sqrt(filtered)))


def answer_of(posterior: Posterior) -> Answer:
    """What is said of a posterior."""
    rows = [
        (p, frozenset({*effects, *(NAME_OF[c] for c in on if c in NAME_OF)})) for p, effects, on in posterior.weights()
    ]
    names = sorted({name for _, some in rows for name in some})
    probabilities = {name: min(1.0, sum(p for p, some in rows if name in some)) for name in names}
    sure = [name for name, p in probabilities.items() if p >= NAMED]
    classes: list[tuple[str, ...]] = [(name,) for name in sorted(sure, key=lambda n: -probabilities[n])]
    rest = [(p, some - set(sure)) for p, some in rows]
    something = sum(p for p, some in rest if some)
    if something >= NAMED:
        classes.append(_holding(rest))
    best = posterior.best
    white, usual = p_of_noise(best), p_of_constants(best)
    # What follows short pieces alone lacks more than it has; what leaves more than noise names nothing, nor what takes
    # constants nobody has.
    follows = best.fit.record.pieces is None
    sound = follows and white > UNLIKELY and (usual > SURPRISING or not classes)
    named = tuple(c for c in classes if c != (OUTSIDE,)) if sound else ()
    likely = probabilities.get(OUTSIDE, 0.0) > LIKELY
    if likely:
        # What has no name may look like any of a recorder's doings; and one cause that the catalogue lacks and that is
        # much like an effect is as usual as this effect with such a cause beside it.
        named = tuple((*c, OUTSIDE) for c in named if not set(c) & set(NAME_OF.values()))
    # Where nothing else is said, it takes as much to say that something is missing as to name it; beside a name, that
    # nothing but noise is left has to be likelier than not.
    unnamed = {OUTSIDE, OWN_SHAPES}.difference(*named)
    more = sum(p for p, some in rows if some & unnamed) > LIKELY
    beyond = not sound or len(named) < len(classes) or ((likely or more) and bool(named))
    return Answer(_kind(named, something, beyond=beyond), named, probabilities, best, white, usual)


def _holding(rows: Sequence[tuple[float, frozenset[str]]]) -> tuple[str, ...]:
    """Few names, the likeliest first, one of which at least is in models that hold `NAMED` of the probability: each is
    the one that most of the models without those before it have. All models that have a name must hold as much."""
    members: list[str] = []
    while sum(p for p, some in rows if not some.isdisjoint(members)) < NAMED:
        left = [(p, some) for p, some in rows if some.isdisjoint(members)]
        names = sorted(frozenset().union(*(some for _, some in left)))
        members.append(max(names, key=lambda name: sum(p for p, some in left if name in some)))
    return tuple(members)


def _kind(named: tuple[tuple[str, ...], ...], something: float, *, beyond: bool) -> Kind:
    if beyond:
        return "partial" if named else "unknown"
    if named:
        return "class" if any(len(members) > 1 for members in named) else "effect"
    return "undecidable" if something > LIKELY else "adequate"


def p_of_noise(model: Hypothesis) -> float:
    """p-value of what a model leaves, divided by a root of its covariance, being white noise of variance 1: of the most
    surprising of the frequencies and trials that it is sorted by, times their number."""
    view, white = model.view, model.covariance.white()
    (within, above), (left, left_above) = (view.band, view.above), white.split(view.sizes, 1)
    groups = [own[own_there].numpy() for own, own_there in zip(left, within.there, strict=True)]
    for waves, some, count in ((within, left, BANDS), (above, left_above, 4)):
        by_frequency = np.argsort(waves.frequency[waves.there.numpy()], kind="stable")
        groups += [some[waves.there].numpy()[part] for part in np.array_split(by_frequency, count)]
    squares = [group**2 for group in groups if len(group)]
    worst = min(float(chi2.sf(s.sum(), len(s))) for s in squares)
    return min(1.0, worst * len(squares))


def p_of_constants(model: Hypothesis) -> float:
    """p-value of the constants of a model being as expected: how far data took them, by the share that data know."""
    free = model.fit.free
    place = [i for i, p in enumerate(free) if p.assumed]
    if not place:
        return 1.0
    mean, covariance = model.estimate
    deviation = np.array([free[i].deviation for i in place])
    off = (mean[place] - np.array([free[i].start for i in place])) / deviation
    known = np.eye(len(place)) - covariance[np.ix_(place, place)] / np.outer(deviation, deviation)
    values, vectors = np.linalg.eigh(known)
    sure = values > KNOWN
    squares = (vectors[:, sure].T @ off) ** 2 / values[sure]
    return float(chi2.sf(squares.sum(), max(int(sure.sum()), 1)))
