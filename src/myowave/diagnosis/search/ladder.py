"""The models that a posterior leads through, each with the effects that were weighed from it, as pages show them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from myowave.diagnosis.causes import SURE
from myowave.diagnosis.likelihood.components import MISSING
from myowave.diagnosis.likelihood.hypothesis import Hypothesis
from myowave.diagnosis.search.answer import Answer
from myowave.diagnosis.search.score import ScoreTest
from myowave.diagnosis.search.screen import screen
from myowave.diagnosis.search.weigh import Posterior
from myowave.identification.output_error import Fit, polish, refit
from myowave.identification.stages import attempt_fit
from myowave.physics.effect import Effect

LEAST = -500.0  # nats: what is less likely is as good as impossible


@dataclass(frozen=True)
class Candidate:
    """One effect, weighed from a model that lacks it."""

    effect: Effect
    score: ScoreTest  # what the fit without it says
    with_it: Hypothesis | None  # None where the score left no hope
    log_odds: float  # of the model with it against that without [nats]; to first order where it was not fitted
    detectable: float  # smallest value of its first parameter that 9 of 10 such recordings would show

    @property
    def name(self) -> str:
        return self.effect.name

    @property
    def status(self) -> str:
        """Whether the trials ask for it; `behind` is what promises enough, but less than those that were fitted."""
        if self.score.failure or self.score.absorbed:
            return "failed" if self.score.failure else "absorbed"
        return "not needed" if self.log_odds <= SURE else "behind" if self.with_it is None else "supported"


@dataclass(frozen=True)
class Ladder:
    """From the model without effects to the one that is named, adding what is most likely first."""

    fits: tuple[Fit, ...]  # of each model
    # of the effects that each lacks, the most likely first; the last asks for none
    rankings: tuple[list[Candidate], ...]
    estimates: tuple[Mapping[str, tuple[float, float]], ...]  # of each model's parameters, `Hypothesis.averaged`
    # for each effect of the last model, where one with all others was weighed, that one, and the log odds of the last
    # model against it [nats]
    odds: Mapping[str, tuple[str, float]] = field(default_factory=dict)

    @property
    def fit(self) -> Fit:
        return self.fits[-1]

    @property
    def effects(self) -> tuple[str, ...]:
        return tuple(effect.name for effect in self.fit.model.effects)


def ladder_of(fit: Fit, posterior: Posterior, answer: Answer, effects: Iterable[Effect]) -> Ladder:
    """The ladder of what is named, from the fit of the model without effects."""
    catalogue = {e.name: e for e in effects}
    named = frozenset(name for members in answer.named for name in members) & frozenset(answer.best.effects)
    rungs, likeliest = [posterior.base], posterior.by_effects()
    if named:
        between = [model for names, model in likeliest.items() if names < named]
        while closer := [m for m in between if frozenset(rungs[-1].effects) < frozenset(m.effects)]:
            least = min(len(m.effects) for m in closer)
            rungs.append(max((m for m in closer if len(m.effects) == least), key=lambda m: m.total))
        rungs.append(likeliest.get(named, answer.best))
    last = rungs[-1]
    without = {name: likeliest.get(frozenset(last.effects) - {name}) for name in named}
    odds = {name: (m.fit.model.name, last.total - m.total) for name, m in without.items() if m is not None}
    fits = [fit]
    for rung in rungs[1:-1]:
        fits.append(_by_least_squares(fits[-1], rung))
    if named:
        fits.append(shown_fit(last))
    rankings = tuple(_ranking_of(rung, posterior, catalogue) for rung in rungs)
    return Ladder(tuple(fits), rankings, tuple(rung.averaged for rung in rungs), odds)


def _by_least_squares(before: Fit, rung: Hypothesis) -> Fit:
    """A model on the way, fitted from the one before it, so that its error is no larger, or from where it was weighed;
    the better one."""
    begun = [partial(refit, before, rung.fit.model, rung.fit.free)]
    if not rung.expected_emg:
        begun.append(partial(polish, rung.fit))
    found = [fit for fit in map(attempt_fit, begun) if fit is not None]
    return min(found, key=lambda fit: fit.objective, default=rung.fit)


def shown_fit(rung: Hypothesis) -> Fit:
    """The fit of a model: that given its causes of noise; by least squares where there are none, or where something is
    missing still, which would do the work of what was found."""
    if rung.expected_emg or (rung.on and not rung.on & MISSING):
        return rung.fit
    return rung.by_least_squares


def _ranking_of(rung: Hypothesis, posterior: Posterior, catalogue: Mapping[str, Effect]) -> list[Candidate]:
    """All effects that a model lacks, the most likely first."""
    key, likeliest = frozenset(rung.effects), posterior.by_effects()
    screened = posterior.screened.get(key) or screen(rung, catalogue)
    found = []
    for name, score in screened.scores.items():
        with_it = likeliest.get(key | {name})
        total = screened.singles.get(name, -np.inf) + rung.prior if with_it is None else with_it.total
        found.append(
            Candidate(
                effect=catalogue[name],
                score=score,
                with_it=with_it,
                log_odds=float(max(total - rung.total, LEAST)),
                detectable=score.detectable(rung.fit.independent_variance, 2 * (SURE - rung.prior)),
            )
        )
    return sorted(found, key=lambda c: -c.log_odds)
