"""Search for what a fitted model lacks, and see what is left.

Whole trials are judged by the evidence of models (`by_evidence`). Pieces of trials, into which those are cut that a
model does not follow, are too short to tell one noise from another: there effects are added one by one by BIC.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace

from myowave.diagnosis.misfit.left import Left, what_is_left
from myowave.diagnosis.search.answer import Answer, answer_of
from myowave.diagnosis.search.by_evidence import weigh_models
from myowave.diagnosis.search.ladder import ladder_of
from myowave.diagnosis.search.rank import Candidate, rank_effects
from myowave.diagnosis.search.score import FAILURES
from myowave.diagnosis.search.selection import Selection, select_effects, without_effect
from myowave.identification.output_error import Fit
from myowave.physics.effect import Effect

MOST_OF_IT = 0.9  # share that effects must explain to be named where something else is left


@dataclass(frozen=True)
class Findings:
    """What a search found, and what it leaves.

    Args:
        left: what the last fit leaves, of pieces of trials; None where the evidence of whole ones was weighed.
        answer: what that evidence allows to say; None where only pieces of trials were fitted.
        given_others: each effect found, weighed at the fit with all the others.
    """

    selection: Selection
    left: Left | None = None
    answer: Answer | None = None
    given_others: Mapping[str, Candidate] = field(default_factory=dict)

    @property
    def explained(self) -> float:
        """What the effects found explain, as a share of it and of what is certainly left [-]."""
        first, last = self.selection.ladder[0], self.selection.fit
        gained = first.objective - last.objective
        if self.answer is not None:
            left = self.answer.missing**2 * last.record.samples
        else:
            left = (self.left.certain if self.left else 0.0) * last.independent_variance
        return float(gained / max(gained + left, 1e-300)) if gained > 0 else 0.0

    @property
    def reportable(self) -> bool:
        """Whether the effects found over pieces may be named: nothing else is left, or little beside what they
        explain."""
        return (self.left is not None and self.left.only_noise) or self.explained >= MOST_OF_IT


def search(fit: Fit, effects: Iterable[Effect], known: Collection[str] = ()) -> Findings:
    """Find the effects that a fitted model lacks.

    Args:
        effects: the catalogue.
        known: names of parameters that are known and so not to be estimated.
    """
    effects = tuple(effects)
    if fit.record.pieces is None:
        posterior = weigh_models(fit, effects, known)
        answer = answer_of(posterior)
        return Findings(ladder_of(fit, posterior, answer, effects, known), answer=answer)
    found = conclude(select_effects(fit, effects, known))
    if found.reportable:
        return _weigh_each(found, effects, known)
    if found.selection.effects:
        # What cannot be named must not make a model look worse than it is by itself.
        first = found.selection
        alone = conclude(Selection(first.ladder[:1], first.rankings[:1]))
        return alone if alone.left is not None and alone.left.only_noise else found
    return found


def conclude(selection: Selection) -> Findings:
    """What a selection over pieces of trials found, and what it leaves."""
    return Findings(selection, what_is_left(selection.fit, has_effects=bool(selection.effects)))


def _weigh_each(found: Findings, effects: tuple[Effect, ...], known: Collection[str]) -> Findings:
    """The same, with each effect that was added weighed given the others."""
    given_others = {}
    selection = found.selection
    first, last = selection.ladder[0], selection.fit
    for effect in last.model.effects[len(first.model.effects) :]:
        try:
            key = frozenset(e.name for e in last.model.effects) - {effect.name}
            without, earlier = selection.weighed.get(key, (None, []))
            if without is None:
                without = without_effect(last, effect, selection.visited)
            with_it = {effect.name: last}
            ranking = rank_effects(without, effects, known, with_it, refits=False, earlier=earlier)
        except FAILURES:  # nothing moves without it
            continue
        own = next(c for c in ranking if c.name == effect.name)
        if own.fit is not None:
            given_others[effect.name] = own
    return replace(found, given_others=given_others)
