"""Add effects one by one while the evidence asks for it, drop those a later one made needless, try swaps."""

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace

from myowave.diagnosis.evidence import EVIDENCE, delta_bic, independent_samples
from myowave.diagnosis.search.rank import Candidate, promising_pairs, rank_effects, similar
from myowave.diagnosis.search.score import FAILURES, score_effect
from myowave.identification.output_error import Fit, polish, refit
from myowave.physics.effect import Effect
from myowave.physics.model import Model

MOST_EFFECTS = 4
SAME = 1e-3  # fits of one model whose sums of squares differ by less are taken for the same
ROUNDS = 6  # of dropping and swapping; each is for the better, so they end by themselves


@dataclass(frozen=True)
class Selection:
    """Which effects the data ask for.

    Args:
        ladder: the fits of base, base + first effect, ... in the order of their evidence.
        rankings: what was weighed at each rung, for each what to add to it; the last found nothing to add.
        classes: for each accepted effect the names that the data do not tell from it, itself first.
        visited: the best fit of every model that the search met, by the names of its effects.
        weighed: fits from which all effects were weighed, with their rankings, by the same names.
    """

    ladder: tuple[Fit, ...]
    rankings: tuple[list[Candidate], ...]
    classes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    visited: Mapping[frozenset[str], Fit] = field(default_factory=dict)
    weighed: Mapping[frozenset[str], tuple[Fit, list[Candidate]]] = field(default_factory=dict)

    @property
    def fit(self) -> Fit:
        return self.ladder[-1]

    @property
    def effects(self) -> tuple[str, ...]:
        return tuple(effect.name for effect in self.fit.model.effects)


def select_effects(
    fit: Fit, effects: Iterable[Effect], known: Collection[str] = (), hint: Fit | None = None
) -> Selection:
    """Search for the effects that a fitted model lacks.

    Args:
        fit: of the model to start from; effects that it has stay.
        effects: the catalogue.
        known: names of parameters that are known and so not to be estimated.
        hint: fit of a model with effects, to start from.
    """
    selecting = _Selecting(fit, tuple(effects), frozenset(known))
    top, classes = selecting.begin() if hint is None else selecting.exchange(hint, {})
    while top is not None and len(classes) < MOST_EFFECTS and (best := _best(selecting.rank(top))) is not None:
        classes[best.name] = _names(best, selecting.rank(top))
        name = top.model.name
        top, classes = selecting.exchange(polish(best.refitted), classes)
        if top.model.name == name:  # what was added went again
            break
    return selecting.finish(fit if top is None else top, classes)


def without_some(
    selection: Selection, names: Collection[str], effects: Iterable[Effect], known: Collection[str] = ()
) -> Selection:
    """What a search found less some effects, which are still ranked.

    Args:
        names: of the effects that go.
        effects, known: as of the search.
    """
    start = selection.ladder[0]
    selecting = _Selecting(start, tuple(effects), frozenset(known), dict(selection.weighed), dict(selection.visited))
    top = selection.fit
    for effect in selecting.added(top):
        if effect.name in names:
            top = selecting.without(top, effect)
    return selecting.finish(top, {name: c for name, c in selection.classes.items() if name not in names})


@dataclass
class _Selecting:
    """What one selection works on, and the rankings it has made: they are the costly part."""

    start: Fit
    effects: tuple[Effect, ...]
    known: frozenset[str]
    ranked: dict[frozenset[str], tuple[Fit, list[Candidate]]] = field(default_factory=dict)
    best: dict[frozenset[str], Fit] = field(default_factory=dict)

    def begin(self) -> tuple[Fit | None, dict[str, tuple[str, ...]]]:
        """The best effect, or a pair that is far better; and the classes they are in."""
        ranking = self.rank(self.start)
        best = _best(ranking)
        pair = self.better_pair(self.start if best is None else best.refitted, ranking)
        if pair is not None:
            return self.exchange(pair, {})
        return (None, {}) if best is None else (polish(best.refitted), {best.name: _names(best, ranking)})

    def rank(self, fit: Fit, fitted: Mapping[str, Fit] | None = None) -> list[Candidate]:
        """The ranking at a fit; that of an earlier fit of the same model will do if it is as good."""
        key = frozenset(effect.name for effect in fit.model.effects)
        at, earlier = self.ranked.get(key, (fit, []))
        if at.objective > fit.objective * (1 + SAME):
            at, earlier = fit, []
        if earlier and fitted is None:
            return earlier
        ranking = rank_effects(at, self.effects, self.known, fitted, earlier=earlier)
        self.ranked[key] = at, ranking
        for found in (c.fit for c in ranking if c.fit is not None):
            self.keep(found)
        return ranking

    def keep(self, fit: Fit) -> Fit:
        """The best fit of this model that was seen so far."""
        key = frozenset(effect.name for effect in fit.model.effects)
        if key not in self.best or fit.objective < self.best[key].objective:
            self.best[key] = fit
        return self.best[key]

    def without(self, fit: Fit, effect: Effect) -> Fit:
        """The fit of the same model less one effect."""
        return self.keep(without_effect(fit, effect, self.best))

    def added(self, fit: Fit) -> tuple[Effect, ...]:
        """The effects that a model has more than the one at the start."""
        return fit.model.effects[len(self.start.model.effects) :]

    def better_pair(self, found: Fit, ranking: list[Candidate]) -> Fit | None:
        """A pair of effects that fits far better than the best single effect, if there is one.

        One effect may do the work of two, and then neither of them is asked for any more; or two hide one another.
        The scores of the first ranking foretell what pairs would gain; the most promising are fitted.
        """
        if not ranking:
            return None
        candidates, catalogue = {c.name: c for c in ranking}, {e.name: e for e in self.effects}
        needed = EVIDENCE + 2 * math.log(len(ranking))  # there are as many pairs as effects, squared
        for one, other in promising_pairs(ranking):
            try:
                first = polish(candidates[one].fit or candidates[one].score.start)
                second = polish(score_effect(first, catalogue[other], self.known).start)
            except FAILURES:
                continue
            parameters = len(second.free) - len(found.free)
            if delta_bic(found, second.objective, parameters, independent_samples(second)) > needed:
                return second
        return None

    def exchange(self, fit: Fit, classes: Mapping[str, tuple[str, ...]]) -> tuple[Fit, dict[str, tuple[str, ...]]]:
        """Drop effects that are needless given the others, and exchange those for which a better one is found."""
        classes = dict(classes)
        for _ in range(ROUNDS if len(self.added(fit)) > 1 or not classes else 0):
            changed = False
            for effect in self.added(fit):
                try:
                    without = self.without(fit, effect)
                except FAILURES:  # nothing is found without it, so it stays
                    continue
                ranking = self.rank(without, {effect.name: fit})
                own = next(c for c in ranking if c.name == effect.name)
                best = _best(ranking) or own
                if own.delta_bic < EVIDENCE:
                    fit, changed = without, True
                    break
                if best.name != effect.name and (own not in similar(ranking, best) or best.weight > own.weight):
                    fit, changed = polish(best.refitted), True
                    classes[best.name] = _names(best, ranking)
                    break
                classes[effect.name] = _names(own, ranking)
            if not changed:
                break
        return fit, {e.name: classes.get(e.name, (e.name,)) for e in self.added(fit)}

    def finish(self, top: Fit, classes: Mapping[str, tuple[str, ...]]) -> Selection:
        """The rungs from the start to a model, with what was weighed at each."""
        try:
            ladder = self.climb(top)
        except FAILURES:  # one between cannot be fitted
            ladder = [self.start, top]
        return Selection(tuple(ladder), tuple(self.rank(rung) for rung in ladder), classes, self.best, self.ranked)

    def climb(self, top: Fit) -> list[Fit]:
        """The fits from the start to a richer model, each time with the effect that lowers the error most."""
        ladder, left = [self.start], list(self.added(top))
        while len(left) > 1:
            fits = {effect.name: self._extended(ladder[-1], effect, top) for effect in left}
            best = min(left, key=lambda effect: fits[effect.name].objective)
            ladder.append(fits[best.name])
            left.remove(best)
        if not left:
            return ladder
        return [*ladder, refit(top, ladder[-1].model.with_effects(left), top.free)]

    def _extended(self, fit: Fit, effect: Effect, top: Fit) -> Fit:
        model = fit.model.with_effects([effect])
        if (known := self.best.get(frozenset(e.name for e in model.effects))) is not None:
            return self.keep(polish(known))
        new = model.parameters_of(effect)
        return refit(fit, model, [*fit.free, *(replace(p, start=0.0) for p in top.free if p.name in new)])


def _best(ranking: list[Candidate]) -> Candidate | None:
    """The effect to add: of those that the data do not tell from the most evident one, that with usual parameters."""
    leader = next((c for c in ranking if c.acceptable), None)
    if leader is None:
        return None
    return max((c for c in similar(ranking, leader) if c.acceptable), key=lambda c: c.weight)


def _names(best: Candidate, ranking: list[Candidate]) -> tuple[str, ...]:
    """The effects that the data do not tell from the one added, which comes first."""
    leader = max((c for c in similar(ranking, best) if c.acceptable), key=lambda c: c.delta_bic, default=best)
    others = [c.name for c in similar(ranking, leader) if c.name != best.name]
    return (best.name, *others)


def without_effect(fit: Fit, effect: Effect, visited: Mapping[frozenset[str], Fit]) -> Fit:
    """The fit of the same model less one effect, from the best that was visited of that model."""
    rest = tuple(e for e in fit.model.effects if e.name != effect.name)
    if (known := visited.get(frozenset(e.name for e in rest))) is not None:
        return polish(known)
    model = Model(fit.model.muscles, fit.model.joint, fit.model.curves, rest)
    gone = fit.model.parameters_of(effect)
    return refit(fit, model, [p for p in fit.free if p.name not in gone])
