"""Which effect does a fitted model lack? The posterior of models, each with every cause of residuals beside it.

From the best model so far all effects, and pairs of them, are screened to first order with the covariance that its
residual calls for; the promising ones are fitted with it, causes are weighed anew, and the likeliest of each size go
on. First orders choose what is fitted: all that is compared was linearised where it stands.
"""

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from operator import itemgetter

import numpy as np
from scipy.special import softmax

from myowave.data.knots import knots_of
from myowave.data.processing.filters import HIGHEST
from myowave.diagnosis.likelihood.algebra import COST, most_likely, weigh_components
from myowave.diagnosis.likelihood.components import COLOURED, EMG, residual_above
from myowave.diagnosis.likelihood.hypothesis import BEHIND, Hypothesis, settle, with_likely_memory
from myowave.diagnosis.likelihood.sensor import Sensor
from myowave.diagnosis.likelihood.waves import REACH, View
from myowave.diagnosis.search.score import ScoreTest, score_effects
from myowave.diagnosis.search.screen import Screened, screen
from myowave.identification.expected_emg import behind_noise
from myowave.identification.output_error import Fit, begin_from, polish, refit
from myowave.identification.stages import FAILURES, attempt_fit
from myowave.physics.effect import Effect

Key = tuple[frozenset[str], bool]  # names of effects, and whether the EMG is the expected one

MOST_EFFECTS = 4
ABREAST = 4  # models of a size that are led on from, where the likeliest leaves more than noise
REFITS, IDEAL, PAIRS = 3, 2, 2  # that are fitted from one model
CLEARLY = 5.0  # nats
HOPELESS = 1.0  # nats that an effect may promise less than the model without it, and still be fitted
WORTH_FOLLOWING = 10.0  # of the objective without an effect: what a fresh start with it may begin at
FINER = 4.0 ** (1 / 6)  # of a filter's corner that is tried to the next one
ORDERS = 2, 4, 8  # of filters: motion capture's, one twice as steep, and what interpolates measured values smoothly


@dataclass
class Posterior:
    """All models that were weighed."""

    models: dict[Key, Hypothesis] = field(default_factory=dict)  # the most likely hypothesis of each
    # what effects promise from the models that led on, by the names of their effects
    screened: dict[frozenset[str], Screened] = field(default_factory=dict)

    @property
    def base(self) -> Hypothesis:
        """The model without any effect."""
        return self.models[frozenset(), False]

    @property
    def best(self) -> Hypothesis:
        return max(self.models.values(), key=lambda model: model.total)

    def by_effects(self) -> dict[frozenset[str], Hypothesis]:
        """The most likely hypothesis with each set of effects, whatever EMG drives it."""
        found: dict[frozenset[str], Hypothesis] = {}
        for (names, _), model in self.models.items():
            if names not in found or model.total > found[names].total:
                found[names] = model
        return found

    def add(self, *found: Hypothesis) -> None:
        """Keep the most likely of each model."""
        for model in found:
            key = frozenset(model.effects), model.expected_emg
            if key not in self.models or model.total > self.models[key].total:
                self.models[key] = model

    def weights(self) -> list[tuple[float, frozenset[str], frozenset[str]]]:
        """Probability, effects and causes of every state of every model."""
        found: dict[tuple[frozenset[str], frozenset[str]], float] = {}
        for (effects, _), model in self.models.items():
            for on, state in model.counted.items():
                # Noise of the EMG is one cause, whichever EMG it was linearised about.
                found[effects, on] = max(state.value + model.offset, found.get((effects, on), -math.inf))
        probable = softmax(list(found.values()))
        return [(float(p), effects, on) for p, (effects, on) in zip(probable, found, strict=True)]


def weigh_models(
    fit: Fit, effects: Iterable[Effect], led: Fit | None = None, report: Callable[[str], None] = lambda line: None
) -> Posterior:
    """The posterior of models, from the fit of the one without any effect; `led` has some, and is known to be good."""
    catalogue = {e.name: e for e in effects}
    joined = list(fit.record.joined(fit.record.angle).values())
    unfiltered = View.of(fit, Sensor(knots=knots_of(joined) if fit.record.pieces is None else None))
    view = through_likely_filter(fit, unfiltered)
    found, base = Posterior(), settle(with_likely_memory(Hypothesis.of(fit, view, catalogue)))
    found.add(base, _of_called_for_emg(base, fit))
    if led is not None:
        more = tuple(e.name for e in led.model.effects[len(fit.model.effects) :])
        begun = settle(replace(base, effects=more).at(led))
        found.add(begun)
    while not _search(found, fit, catalogue, unfiltered, report):
        found = _seen_anew(found, unfiltered)
    return found


def _looked_filtered(model: Hypothesis, unfiltered: View) -> bool:
    """Whether what simpler models lacked had looked like the doing of a filter, which this model asks for no more."""
    if model.view.sensor.corner_hz is None:
        return False
    # A fit through a filter that is not there keeps what a filter would explain; one by least squares does not.
    return through_likely_filter(model.by_least_squares, unfiltered).sensor.corner_hz is None


def _seen_anew(found: Posterior, view: View) -> Posterior:
    """The same models, the trials looked at in another way."""
    again, best = Posterior(), found.best
    view = with_likely_memory(replace(best, view=view).at(best.fit)).view
    for model in sorted(found.models.values(), key=lambda model: -model.total):
        begun = replace(model, view=view).at(model.fit)
        again.add(settle(begun, again.best.total if again.models else -math.inf))
    return again


def _search(
    found: Posterior, fit: Fit, catalogue: Mapping[str, Effect], unfiltered: View, report: Callable[[str], None]
) -> bool:
    """A beam search: lead on from the likeliest models of each size up to that of the best, the smallest first; False
    where the best asks no more for the filter that trials are looked at through, and all are to be seen anew. The fit
    is to the EMG as it was recorded."""
    begun = set[frozenset[str]]()
    while (model := _next(found, begun)) is not None:
        begun.add(frozenset(model.effects))
        if model is found.best and model.effects:
            best = _more_exactly(model)
            model = _of_called_for_emg(best, fit)
            found.add(best, model)
            if _looked_filtered(found.best, unfiltered):
                return False
            found.add(*_with_one_less(model))
        if len(model.effects) < MOST_EFFECTS:
            screened = found.screened[frozenset(model.effects)] = screen(model, catalogue)
            found.add(*_fit_singles(model, screened, found))
        if not model.effects:
            found.add(*_fit_pairs(model, screened, catalogue))
        report(f"weigh: the likeliest of {len(found.models)} models so far is {found.best.fit.model.name}")
    if fit.record.pieces is None:
        found.add(*_by_recorded_emg(found, fit))
    return not _looked_filtered(found.best, unfiltered)


def _more_exactly(model: Hypothesis) -> Hypothesis:
    """The likeliest model after more steps, its causes sought from none, too, as those of a model before may stay."""
    settled = settle(model, steps=12)
    afresh, known = weigh_components(settled.residual), settled.states
    likelier = {on: new for on, new in afresh.items() if on not in known or new.value > known[on].value}
    return with_likely_memory(replace(settled, states={**known, **likelier}))


def _next(found: Posterior, begun: Collection[frozenset[str]]) -> Hypothesis | None:
    """The next model to lead on from that was not begun with: the smallest of the likeliest of each size up to that of
    the best, of one whose likeliest leaves noise alone only this; over pieces the best alone. What is missing still
    decides which of its parts seems likeliest alone, and what is best alone may hold the place of two that are better
    together."""
    best, likeliest = found.best, sorted(found.by_effects().values(), key=lambda model: -model.total)
    near = [best]
    if best.fit.record.pieces is None:
        of_size = ([m for m in likeliest if len(m.effects) == n] for n in range(len(best.effects) + 1))
        near = [m for models in of_size if models for m in models[: ABREAST if models[0].on else 1]]
    return next((model for model in near if frozenset(model.effects) not in begun), None)


def _by_recorded_emg(found: Posterior, recorded: Fit) -> list[Hypothesis]:
    """The likeliest models that the expected EMG drives, driven by the recorded one from the same place: where one of
    the two was led further, the difference says nothing of noise."""
    near = [m for m in found.models.values() if m.expected_emg and m.total > found.best.total - CLEARLY]
    return [_of_other_emg(model, recorded) for model in near]


def _with_one_less(model: Hypothesis) -> list[Hypothesis]:
    """The models that lack one of the effects of a model with several, settled, but for those that are hopeless."""
    found = []
    several = model.effects if len(model.effects) > 1 else ()
    for name in (name for name in several if model.without(name) > model.total - BEHIND):
        fit = attempt_fit(partial(without_effect, model.fit, name))
        if fit is not None:
            rest = tuple(other for other in model.effects if other != name)
            found.append(settle(replace(model, effects=rest).at(fit), model.total))
    return found


def without_effect(fit: Fit, name: str) -> Fit:
    """The fit of the same model less one effect."""
    (gone,) = (e for e in fit.model.effects if e.name == name)
    rest = tuple(e for e in fit.model.effects if e is not gone)
    parameters = fit.model.parameters_of(gone)
    return refit(fit, replace(fit.model, effects=rest), [p for p in fit.free if p.name not in parameters])


def _fit_singles(top: Hypothesis, screened: Screened, found: Posterior) -> list[Hypothesis]:
    """The effects that promise most, fitted."""
    singles, leader = screened.singles, found.best.total
    hopeful = sorted((n for n in singles if singles[n] + top.prior > top.total - HOPELESS), key=lambda n: -singles[n])
    # What is on may hold back what would do without it.
    ideal = sorted(screened.ideal, key=lambda n: -screened.ideal[n]) if top.on else []
    chosen = dict.fromkeys([*hopeful[:REFITS], *ideal[:IDEAL]])
    begins = [(name, screened.scores[name].start) for name in chosen]
    if top.on:
        begins += fresh_starts(top.fit, screened.scores).items()
    fitted = [_fitted(top, begin, (*top.effects, name), leader) for name, begin in begins]
    return [model for model in fitted if model is not None]


def fresh_starts(fit: Fit, scores: Mapping[str, ScoreTest]) -> dict[str, Fit]:
    """Fits with an effect that replaces what the model has, as other curves do, from where constants are expected.

    The constants of a fit without the effect have gone where they imitate it, and no small step leads back from there.
    Only those are given that begin not far above the fit without the effect.
    """

    if any(effect.replaces for effect in fit.model.effects):
        return {}  # a model has one family of curves

    def begin(score: ScoreTest) -> Fit:
        kept = [value if "." in p.name else p.start for p, value in zip(fit.free, fit.values, strict=True)]
        values = [*kept, *(p.scale if p.high > 0 else -p.scale for p in score.free)]
        return begin_from(score.start.model, fit.record, score.start.free, np.array([values]))[0]

    replacing = {n: s for n, s in scores.items() if not s.failure and s.start.model.effects[-1].replaces}
    fresh = {name: attempt_fit(partial(begin, score)) for name, score in replacing.items()}
    return {n: f for n, f in fresh.items() if f is not None and f.objective < WORTH_FOLLOWING * fit.objective}


def _fit_pairs(top: Hypothesis, screened: Screened, catalogue: Mapping[str, Effect]) -> list[Hypothesis]:
    """The pairs that promise more than any effect alone, fitted."""
    single, pairs = max(screened.singles.values(), default=-np.inf), screened.pairs
    hopeful = [p for p in sorted(pairs, key=lambda p: -pairs[p]) if pairs[p] + top.prior > single][:PAIRS]
    found = []
    for one, other in hopeful:
        begin = score_effects(screened.scores[one].start, [catalogue[other]])[other]
        if not begin.failure:
            found.append(_fitted(top, begin.start, (*top.effects, one, other), -math.inf))
    return [model for model in found if model is not None]


def _fitted(top: Hypothesis, begin: Fit, effects: tuple[str, ...], leader: float) -> Hypothesis | None:
    """A model settled from its fit by least squares, as the causes of the model without the effect, which it is given,
    may hold the effect back. None where it has no motion."""
    try:
        return settle(replace(top, effects=effects).at(polish(begin)), leader)
    except FAILURES:
        return None


def through_likely_filter(fit: Fit, view: View) -> View:
    """How trials are looked at, the angle through the filter that makes what a fit leaves above the band of the motion
    most likely, in what that passes; or through none."""
    above, lowest, highest = view.above_alone, REACH * view.edge_hz, HIGHEST / (fit.record.dt * view.sensor.step)
    steps = range(int(np.log(max(highest / lowest, 1.0)) / np.log(FINER)) + 1 if view.above.there.any() else 0)

    def likely(sensor: Sensor) -> float:
        residual = residual_above(fit, above.through(sensor))
        with_or_without = max(most_likely(residual, on).value for on in ((), (COLOURED,)))
        return with_or_without - (0.0 if sensor.corner_hz is None else COST)

    def likeliest(best: tuple[float, Sensor], corners: Iterable[float], orders: Iterable[int]) -> tuple[float, Sensor]:
        filters = [replace(best[1], corner_hz=hz, order=n) for n in orders for hz in corners if hz < highest]
        return max([best, *((likely(sensor), sensor) for sensor in filters)], key=itemgetter(0))

    best = likeliest((likely(view.sensor), view.sensor), [lowest * FINER**n for n in steps], ORDERS)
    for finer in (FINER**0.5, FINER**0.25):
        if (corner := best[1].corner_hz) is not None:
            best = likeliest(best, (corner * finer, corner / finer), [best[1].order])
    return view.through(best[1]).passed


def _of_called_for_emg(model: Hypothesis, recorded: Fit) -> Hypothesis:
    """The same model driven by the EMG that its causes call for: the expected one where they have noise of the EMG."""
    likeliest = max(model.states, key=lambda on: model.states[on].value)
    return model if (EMG in likeliest) == model.expected_emg else _of_other_emg(model, recorded)


def _of_other_emg(model: Hypothesis, recorded: Fit) -> Hypothesis:
    """The same model fitted to the EMG that is expected behind a noisy recording (errors in variables), or to the
    recording again; itself where it cannot be. `recorded` is a fit to the EMG as it was recorded."""
    record = recorded.record
    if not model.expected_emg:
        record = behind_noise(record, model.best.sizes[EMG])
    fit = replace(model.fit, record=record)
    found = attempt_fit(lambda: refit(fit, fit.model, fit.free))
    if found is None:
        return model
    return settle(replace(model, expected_emg=not model.expected_emg).at(found))
