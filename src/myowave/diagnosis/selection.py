"""Add effects one by one while the evidence asks for it, drop those a later one made needless, try swaps."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from myowave.diagnosis.fit import Fit, polish, refit
from myowave.diagnosis.rank import (
    EVIDENCE,
    Candidate,
    evidence,
    independent_samples,
    promising_pairs,
    rank_effects,
    similar,
)
from myowave.diagnosis.score import score_effect
from myowave.physics.effect import Effect
from myowave.physics.model import Model

MOST_EFFECTS = 4
ROUNDS = 6  # of dropping and swapping; each lowers the BIC, so they end by themselves


@dataclass(frozen=True)
class Selection:
    """Which effects the data ask for.

    Args:
        ladder: the fits of base, base + first effect, ... in the order of their evidence.
        rankings: what was weighed at each rung, for each what to add to it; the last found nothing to add.
        classes: for each accepted effect the names that the data do not tell from it, itself first.
    """

    ladder: tuple[Fit, ...]
    rankings: tuple[list[Candidate], ...]
    classes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def fit(self) -> Fit:
        return self.ladder[-1]

    @property
    def effects(self) -> tuple[str, ...]:
        return tuple(effect.name for effect in self.fit.model.effects)


def select_effects(fit: Fit, effects: Iterable[Effect], known: Iterable[str] = ()) -> Selection:
    """Search for the effects that a fitted model lacks.

    Args:
        fit: of the model to start from; effects that it has stay.
        effects: the catalogue.
        known: names of parameters that are known and so not to be estimated.
    """
    effects, known, start = list(effects), set(known), fit
    ladder, rankings, classes = [fit], [rank_effects(fit, effects, known)], {}
    while len(ladder) <= MOST_EFFECTS and (found := _best(rankings[-1])) is not None:
        classes[found.name] = _names(found, rankings[-1])
        ladder.append(found.fit)
        if len(ladder) > 2:
            settled, classes = _settle(ladder[-1], classes, effects, known, len(start.model.effects))
            if settled.model.name != ladder[-1].model.name:
                ladder = _climb(start, settled)
                rankings = [rank_effects(rung, effects, known) for rung in ladder[:-1]]
            else:
                ladder[-1] = settled
        rankings.append(rank_effects(ladder[-1], effects, known))
    better = _better_pair(ladder[-1], rankings[0], {e.name: e for e in effects}, known)
    if better is not None:
        settled, classes = _settle(better, {}, effects, known, len(start.model.effects))
        ladder = _climb(start, settled)
        rankings = [rank_effects(rung, effects, known) for rung in ladder]
    return Selection(tuple(ladder), tuple(rankings), classes)


def _best(ranking: list[Candidate]) -> Candidate | None:
    return next((c for c in ranking if c.acceptable), None)


def _better_pair(found: Fit, ranking: list[Candidate], effects: Mapping[str, Effect], known: set[str]) -> Fit | None:
    """A pair of effects that fits far better than what was found one by one, if there is one.

    One effect may do the work of two, and then neither of them is asked for any more. The scores of the first
    ranking foretell what pairs would gain; the most promising are fitted.
    """
    scores = {c.name: c.score for c in ranking}
    for one, other in promising_pairs(ranking):
        first = polish(scores[one].start)
        second = polish(score_effect(first, effects[other], known).start)
        parameters = len(second.free) - len(found.free)
        if evidence(found, second.rss, parameters, independent_samples(second)) > EVIDENCE:
            return second
    return None


def _names(best: Candidate, ranking: list[Candidate]) -> tuple[str, ...]:
    others = [c.name for c in similar(ranking, best) if c.name != best.name]
    return (best.name, *others)


def _settle(
    fit: Fit, classes: dict[str, tuple[str, ...]], effects: list[Effect], known: set[str], fixed: int
) -> tuple[Fit, dict[str, tuple[str, ...]]]:
    """Drop effects that are needless beside the others, and exchange those for which a better one is found."""
    for _ in range(ROUNDS):
        changed = False
        for effect in fit.model.effects[fixed:]:
            without = _without(fit, effect)
            ranking = rank_effects(without, effects, known, {effect.name: fit})
            own = next(c for c in ranking if c.name == effect.name)
            best = _best(ranking) or own
            if own.evidence < EVIDENCE:
                fit, changed = without, True
                break
            if best.name != effect.name and best.evidence > own.evidence:
                fit, changed = best.fit, True
                classes[best.name] = _names(best, ranking)
                break
            classes[effect.name] = _names(own, ranking)
        if not changed:
            break
    return fit, {e.name: classes[e.name] for e in fit.model.effects[fixed:]}


def _without(fit: Fit, effect: Effect) -> Fit:
    """The fit of the same model less one effect."""
    rest = tuple(e for e in fit.model.effects if e.name != effect.name)
    model = Model(fit.model.muscles, fit.model.joint, fit.model.curves, rest)
    gone = fit.model.parameters_of(effect)
    return refit(fit, model, [p for p in fit.free if p.name not in gone])


def _climb(start: Fit, top: Fit) -> list[Fit]:
    """The fits from one model to a richer one, an effect at a time in the order it has them."""
    ladder = [start]
    added = top.model.effects[len(start.model.effects) :]
    for count in range(1, len(added)):
        model = start.model.with_effects(added[:count])
        names = {name for effect in model.effects for name in model.parameters_of(effect)}
        free = [p for p in top.free if p.name in names or p.name in start.parameters]
        ladder.append(refit(ladder[-1], model, free))
    return [*ladder, top]
