"""The models that a posterior leads through, each with the effects that were weighed from it, as pages show them."""

from collections.abc import Collection, Iterable

import numpy as np

from myowave.diagnosis.evidence import EVIDENCE, independent_samples
from myowave.diagnosis.likelihood.hypothesis import Hypothesis
from myowave.diagnosis.search.answer import Answer
from myowave.diagnosis.search.by_evidence import Posterior, screen
from myowave.diagnosis.search.rank import Candidate, count_folds, folds_won
from myowave.diagnosis.search.score import FAILURES
from myowave.diagnosis.search.selection import Selection
from myowave.identification.output_error import Fit, polish
from myowave.identification.stages import attempt_fit
from myowave.physics.effect import Effect


def ladder_of(
    fit: Fit, posterior: Posterior, answer: Answer, effects: Iterable[Effect], known: Collection[str] = ()
) -> Selection:
    """From the model without effects to the one that is named, adding what is most likely first.

    Args:
        fit: of the model without effects.
        effects, known: as `weigh_models` had them.
    """
    catalogue = {e.name: e for e in effects}
    named = frozenset(name for members in answer.named for name in members) & frozenset(answer.best.effects)
    rungs = [posterior.base]
    if named:
        between = [m for (names, _), m in posterior.models.items() if frozenset() < names < named]
        while closer := [m for m in between if frozenset(rungs[-1].effects) < frozenset(m.effects)]:
            least = min(len(m.effects) for m in closer)
            rungs.append(max((m for m in closer if len(m.effects) == least), key=lambda m: m.total))
        last = [m for (names, _), m in posterior.models.items() if names == named]
        rungs.append(max(last, key=lambda m: m.total) if last else answer.best)
    rankings = tuple(_ranking(rung, posterior, catalogue, known) for rung in rungs)
    classes = {m: (m, *(o for o in c if o != m and o in catalogue)) for c in answer.named for m in c if m in named}
    return Selection((fit, *map(_shown, rungs[1:])), rankings, classes)


def _shown(rung: Hypothesis) -> Fit:
    """The fit of a model: that given its causes of noise, by least squares where there are none."""
    if rung.on or rung.expected_emg:
        return rung.fit
    return attempt_fit(lambda: polish(rung.fit)) or rung.fit


def _ranking(
    rung: Hypothesis, posterior: Posterior, catalogue: dict[str, Effect], known: Collection[str]
) -> list[Candidate]:
    """All effects that a model lacks, the most likely first; twice a difference of log evidence is one of BIC."""
    key = frozenset(rung.effects)
    screened = posterior.screened.get(key) or screen(rung, catalogue, known)
    folds, samples = count_folds(rung.fit), independent_samples(rung.fit)
    statistic = EVIDENCE + np.log(samples)
    found = []
    for name, score in screened.scores.items():
        richer = [m for (names, _), m in posterior.models.items() if names == key | {name}]
        with_it = max(richer, key=lambda m: m.total, default=None)
        first_order = screened.singles.get(name, -np.inf) + posterior.prior
        gained = 2 * ((with_it.total if with_it else first_order) - rung.total)
        won, failure = 0, score.failure
        if with_it is not None:
            try:
                won, _ = folds_won(rung.fit, with_it.fit)
            except FAILURES as error:
                failure = str(error)
        fit = None if with_it is None or failure else with_it.fit
        found.append(
            Candidate(
                effect=catalogue[name],
                score=score,
                fit=fit,
                delta_bic=float(max(gained, -1e3)),
                gain=float(max(gained, -1e3)),
                folds_won=won,
                folds=folds,
                detectable=score.detectable(float(rung.fit.normal.rss) / rung.fit.record.samples, statistic),
                failure=failure,
                surprising=True,  # constants far from where they are expected count in the evidence
            )
        )
    return sorted(found, key=lambda c: -c.delta_bic)
