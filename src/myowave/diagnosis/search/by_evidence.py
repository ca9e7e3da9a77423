"""Which effect does a fitted model lack? The posterior of models, each with every cause of residuals beside it.

From the best model so far all effects, and pairs of them, are screened to first order with the covariance that its
residual calls for; the promising ones are fitted with it, causes are weighed anew, and the most likely goes on. First
orders only choose what is fitted: what is compared was linearised where it stands.

Shapes: L values of all trials, C columns.
"""

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from myowave.diagnosis.likelihood.algebra import COST, Covariance, Weighed, log_share_within, most_likely
from myowave.diagnosis.likelihood.columns import (
    COLOURED,
    CURVES,
    EMG,
    NOISE,
    REPEATS,
    Looking,
    Pushes,
    View,
    residual_of,
)
from myowave.diagnosis.likelihood.hypothesis import Hypothesis, climb, settle, with_likely_memory
from myowave.diagnosis.likelihood.sensor import Sensor, knots_of
from myowave.diagnosis.search.rank import fresh_starts
from myowave.diagnosis.search.score import FAILURES, ScoreTest, score_effects
from myowave.diagnosis.search.selection import select_effects, without_effect
from myowave.identification.expected_emg import expected_excitation
from myowave.identification.free_parameters import bounds, scales
from myowave.identification.least_squares import scaled_slope
from myowave.identification.output_error import Fit, refit
from myowave.identification.stages import attempt_fit
from myowave.physics.effect import Effect

Array = NDArray[np.float64]

OUTSIDE = 0.03  # ASSUME: so likely is one part of the general correction, beside all effects of the catalogue
MOST_EFFECTS = 3
REFITS, PAIRS = 3, 2  # that are fitted from one model
CLEARLY = 5.0  # nats
STRANGE = frozenset({EMG, CURVES, REPEATS})  # causes that other curves, far from where a fit stands, may hide behind
HOPELESS = 1.0  # nats that an effect may promise less than the model without it, and still be fitted
HELD = 0.99  # cosine between a part of the general correction and an effect, above which they are one
CORNERS = 3.0 * 4.0 ** (np.arange(7) / 6)  # of filters, in units of the motion's edge
ENOUGH = 50  # waves well above the motion that show a filter
LET_THROUGH = 0.1  # of white noise, by lines between samples: waves with less show no filter
FILTERED = 0.5  # of the noise well above the motion at its highest to its lowest waves: less may be a filter's doing


@dataclass(frozen=True)
class Posterior:
    """All models that were weighed.

    Args:
        models: by the names of their effects.
        parts: each part of the general correction beside the effects of some model, to first order: log posterior.
        screened: what effects promise from the models that led on, by the names of their effects.
        prior: logarithm of how likely an effect is before any trial.
    """

    base: Hypothesis
    models: Mapping[tuple[frozenset[str], bool], Hypothesis]
    parts: Mapping[tuple[frozenset[str], str], float]
    screened: Mapping[frozenset[str], "Screened"]
    prior: float

    @property
    def best(self) -> Hypothesis:
        return max(self.models.values(), key=lambda model: model.total)

    def weights(self) -> list[tuple[float, frozenset[str], frozenset[str]]]:
        """Probability, effects and causes of every state of every model."""
        rows = [
            (state.value + model.offset, effects, on | ({EMG} if model.expected_emg else set()))
            for (effects, _), model in self.models.items()
            for on, state in model.states.items()
        ]
        emg = {EMG} if self.best.expected_emg else set()
        rows += [(value, effects, frozenset({REPEATS, *emg})) for (effects, _), value in self.parts.items()]
        top = max(row[0] for row in rows)
        total = sum(math.exp(row[0] - top) for row in rows)
        return [(math.exp(value - top) / total, effects, frozenset(on)) for value, effects, on in rows]


@dataclass(frozen=True)
class Screened:
    """What effects promise from one model, to first order: log posterior of each, and of pairs of them.

    Args:
        ideal: the same with noise alone beside the effects.
    """

    scores: Mapping[str, ScoreTest]
    singles: Mapping[str, float]
    ideal: Mapping[str, float]
    pairs: Mapping[tuple[str, str], float]
    parts: Mapping[str, float]


def weigh_models(fit: Fit, effects: Iterable[Effect], known: Collection[str] = ()) -> Posterior:
    """The posterior of models, from the fit of the one without any effect.

    Args:
        effects: the catalogue.
        known: names of parameters that are known and so not to be estimated.
    """
    catalogue = {e.name: e for e in effects}
    prior = -math.log(2 * max(len(catalogue), 1))
    plain = replace(fit, record=replace(fit.record, filter=None))
    base = settle(with_likely_memory(_through_likely_sensor(plain)))
    models: dict[tuple[frozenset[str], bool], Hypothesis] = {(frozenset(), False): base}
    base = _of_other_emg(base, plain, models)
    parts: dict[tuple[frozenset[str], str], float] = {}
    seen: dict[frozenset[str], Screened] = {}
    if base.on & STRANGE:  # far from the truth no first order shows the way: from least squares, too
        _add(models, _by_least_squares(plain, base, tuple(catalogue.values()), known, prior))
    top = base
    for depth in range(MOST_EFFECTS):
        screened = seen[frozenset(top.effects)] = screen(top, catalogue, known)
        share = prior + math.log(OUTSIDE * max(len(catalogue), 1) / max(len(screened.parts), 1))
        parts |= {(frozenset(top.effects), n): v + top.prior + share for n, v in screened.parts.items()}
        found = [
            *_fit_singles(top, screened, prior, models),
            *(_fit_pairs(top, screened, catalogue, prior) if not depth else ()),
        ]
        _add(models, found)
        best = max(models.values(), key=lambda model: model.total)
        if len(best.effects) <= len(top.effects):
            break
        best = with_likely_memory(settle(best, steps=12))
        models[frozenset(best.effects), best.expected_emg] = best
        top = _of_other_emg(best, plain, models)
        _add(models, _with_one_less(top))
    return Posterior(models[frozenset(), False], models, parts, seen, prior)


def _add(models: dict[tuple[frozenset[str], bool], Hypothesis], found: Iterable[Hypothesis]) -> None:
    """Keep the most likely of each model."""
    for model in found:
        key = frozenset(model.effects), model.expected_emg
        if key not in models or model.total > models[key].total:
            models[key] = model


def _by_least_squares(
    plain: Fit, base: Hypothesis, effects: tuple[Effect, ...], known: Collection[str], prior: float
) -> list[Hypothesis]:
    """The models that a search by BIC leads through, settled."""
    try:
        ladder = select_effects(plain, effects, known).ladder
        names = [tuple(e.name for e in rung.model.effects[len(plain.model.effects) :]) for rung in ladder]
        begun = [
            Hypothesis.of(rung, base.looking, added, [base.best], prior * len(added))
            for rung, added in zip(ladder[1:], names[1:], strict=True)
        ]
        return [settle(model) for model in begun]
    except FAILURES:
        return []


def _with_one_less(model: Hypothesis) -> list[Hypothesis]:
    """The models that lack one of the effects of a model with several, settled."""
    found = []
    for effect in model.fit.model.effects:
        rest = tuple(name for name in model.effects if name != effect.name)
        fit = (
            attempt_fit(partial(without_effect, model.fit, effect, {}))
            if rest and effect.name in model.effects
            else None
        )
        if fit is not None:
            prior = model.prior * len(rest) / len(model.effects)
            begun = Hypothesis.of(fit, model.looking, rest, [model.best], prior)
            found.append(replace(settle(begun, model.total), expected_emg=model.expected_emg))
    return found


def screen(model: Hypothesis, catalogue: Mapping[str, Effect], known: Collection[str] = ()) -> Screened:
    """Every effect, pair of effects and part of the general correction, beside what a model's best states have."""
    fit, residual, look = model.fit, model.residual, model.looking.amplitudes
    scores = score_effects(fit, catalogue.values(), known)
    count, columns, free = len(fit.free), {}, {}
    for name, score in scores.items():
        if not score.failure:
            slope = score.start.sensitive.by_parameter[count:]
            columns[name] = look(scaled_slope(slope, scales(score.free), fit.record.valid))
            free[name] = tuple(bound / scales(score.free) for bound in bounds(score.free))
    names = [*columns]
    ends = np.cumsum([columns[n].shape[1] for n in names])
    place = {n: np.arange(end - columns[n].shape[1], end) for n, end in zip(names, ends, strict=True)}
    repeats = residual.component(REPEATS).columns
    assert repeats is not None
    repeats = repeats * np.sqrt((residual.stacked**2).sum() / fit.record.samples)
    together = np.concatenate([*columns.values(), repeats], -1)
    states = sorted(model.states.values(), key=lambda s: -s.value)[:2]
    states = [*(s for s in states if s.value > -np.inf), _noise_alone(model)]
    singles = dict.fromkeys(names, -np.inf)
    pairs: dict[tuple[str, str], float] = {}
    ideal: dict[str, float] = {}
    parts = np.full(repeats.shape[1], -np.inf)
    for state in states:
        covariance = Covariance(residual, state.sizes)
        products = covariance.inner(together, together)
        with_left = covariance.inner(together, residual.stacked[:, None])[:, 0]

        def promise(*members: str, products: Array = products, with_left: Array = with_left) -> float:
            chosen = np.concatenate([place[m] for m in members])
            low, high = (np.concatenate([free[m][i] for m in members]) for i in (0, 1))
            return _promise(products[np.ix_(chosen, chosen)], with_left[chosen], low, high)

        ideal = {name: state.value + promise(name) for name in names}
        singles = {name: max(singles[name], ideal[name]) for name in names}
        seen = [n for n in names if np.trace(products[np.ix_(place[n], place[n])]) > 1.0]
        for i, one in enumerate(seen):
            for other in seen[i + 1 :]:
                pairs[one, other] = max(pairs.get((one, other), -np.inf), state.value + promise(one, other))
        own = np.arange(len(together.T) - repeats.shape[1], len(together.T))
        size = np.diag(products)[own]
        parts = np.maximum(parts, state.value + 0.5 * (with_left[own] ** 2 / (1 + size) - np.log1p(size)))
        for name in names:  # a part that an effect does is none
            inside = np.linalg.pinv(products[np.ix_(place[name], place[name])], rcond=1e-8, hermitian=True)
            cross = products[np.ix_(place[name], own)]
            shared = np.einsum("ec,ef,fc->c", cross, inside, cross) / size.clip(1e-300)
            parts[np.sqrt(shared.clip(0)) > HELD] = -np.inf
    words = [str(i) for i in range(len(parts))]
    offset = model.offset
    return Screened(
        scores,
        {n: v + offset for n, v in singles.items()},
        {n: v + offset for n, v in ideal.items()},
        {n: v + offset for n, v in pairs.items()},
        {n: float(v) + offset for n, v in zip(words, parts, strict=True) if np.isfinite(v)},
    )


def _promise(products: Array, with_left: Array, low: Array, high: Array) -> float:
    """What amplitudes N(0, 1) within bounds add to a log evidence, see `Covariance.gain`."""
    spread: Array = np.asarray(np.linalg.inv(np.eye(len(products)) + products))
    mean = spread @ with_left
    return float(0.5 * (with_left @ mean + np.linalg.slogdet(spread)[1])) + log_share_within(low, high, mean, spread)


def _noise_alone(model: Hypothesis) -> Weighed:
    """The state without any cause but noise, as strong as above the band of the motion."""
    residual, noise = model.residual, model.residual.component(NOISE)
    share, floor = noise.tail, residual.component("floor")
    if share is None or not len(share):
        return model.states[frozenset()]

    def unlikely(log: float) -> float:
        variance = np.exp(2 * log) * share + floor.first**2
        return float((np.log(variance) + residual.tail**2 / variance).sum())

    size = float(np.exp(minimize_scalar(unlikely, bounds=np.log([noise.low, noise.high]), method="bounded").x))
    return Weighed({NOISE: size}, Covariance(residual, {NOISE: size}).log_evidence)


def _fit_singles(
    top: Hypothesis, screened: Screened, prior: float, models: Mapping[tuple[frozenset[str], bool], Hypothesis]
) -> list[Hypothesis]:
    """The effects that promise most, fitted."""
    singles, leader = screened.singles, max(model.total for model in models.values())
    hopeful = sorted((n for n in singles if singles[n] + prior > top.total - HOPELESS), key=lambda n: -singles[n])
    chosen = dict.fromkeys(hopeful[:REFITS])
    if not chosen:
        return []
    if top.on:  # what is on may hold back what would do without it
        chosen |= dict.fromkeys(sorted(screened.ideal, key=lambda n: -screened.ideal[n])[:1])
    begins = [(name, screened.scores[name].start) for name in chosen]
    if top.on & STRANGE and not top.effects:
        begins += [(n, replace(f, record=top.fit.record)) for n, f in fresh_starts(top.fit, screened.scores).items()]
    found = []
    for name, begin in begins:
        found += _fitted(top, begin, (*top.effects, name), top.prior + prior, leader)
    return found


def _fit_pairs(top: Hypothesis, screened: Screened, catalogue: Mapping[str, Effect], prior: float) -> list[Hypothesis]:
    """The pairs that promise more than any effect alone, fitted."""
    single, pairs = max(screened.singles.values(), default=-np.inf), screened.pairs
    hopeful = [p for p in sorted(pairs, key=lambda p: -pairs[p]) if pairs[p] + prior > single + 2.0][:PAIRS]
    found = []
    for one, other in hopeful:
        try:
            begin = score_effects(screened.scores[one].start, [catalogue[other]])[other]
        except FAILURES:
            continue
        if not begin.failure:
            found += _fitted(top, begin.start, (*top.effects, one, other), top.prior + 2 * prior, -math.inf)
    return found


def _fitted(top: Hypothesis, begin: Fit, effects: tuple[str, ...], prior: float, leader: float) -> list[Hypothesis]:
    """A model settled from where a fit stands: given the causes of the model without the effect, and given noise alone
    where these may hold the effect back."""
    try:
        first = Hypothesis.of(begin, top.looking, effects, [top.best], prior)
        found = [settle(first, leader)]
        if top.on and found[0].total < leader + CLEARLY:
            freely = climb(first, 8, _noise_alone(first))
            found.append(settle(Hypothesis.of(freely, top.looking, effects, [top.best], prior), leader))
    except FAILURES:
        return []
    return [replace(max(found, key=lambda model: model.total), expected_emg=top.expected_emg)]


def _through_likely_sensor(fit: Fit) -> Hypothesis:
    """The model without effects, the angle through the filter that makes its residual most likely, or through none."""
    joined = list(fit.record.joined(fit.record.angle).values())
    knots = knots_of(joined) if fit.record.pieces is None else None
    view, pushes = View.of(fit, Sensor(knots=knots)), Pushes.of(fit)
    plain = Looking(view, fit.record.dt)
    best = Hypothesis.of(fit, plain, pushes=pushes)
    share = best.residual.component(NOISE).tail
    assert share is not None
    order = np.argsort(np.concatenate(view.frequency_above))
    order = order[share[order] > LET_THROUGH]
    if len(order) < ENOUGH:
        return best
    lowest, *_, highest = np.array_split(best.residual.tail[order] ** 2 / share[order], 4)
    if highest.mean() > FILTERED * lowest.mean():
        return best
    sets = [frozenset[str](), frozenset({EMG}), frozenset({COLOURED}), best.on]
    tried: dict[float | None, Weighed] = {None: replace(best.best, value=best.best.value + COST)}
    corners = (CORNERS * view.edge_hz).tolist()
    for finer in (0.5, 0.25, 0.125):
        for corner_hz in corners:
            if corner_hz < 0.45 / (fit.record.dt * (knots or 1.0)):
                looking = Looking(replace(view, sensor=Sensor(corner_hz, knots)), fit.record.dt)
                residual = residual_of(fit, looking, pushes)
                known = [on & frozenset(residual.optional) for on in sets]
                found = [most_likely(residual, on) for on in known]
                tried[corner_hz] = max(found, key=lambda state: state.value)
        corner = max(tried, key=lambda c: tried[c].value)
        corners = [] if corner is None else [corner * (CORNERS[1] / CORNERS[0]) ** sign for sign in (finer, -finer)]
    corner = max(tried, key=lambda c: tried[c].value)
    looking = Looking(replace(view, sensor=Sensor(corner, knots)), fit.record.dt)
    return best if corner is None else Hypothesis.of(fit, looking, seeds=[tried[corner]], pushes=pushes)


def _of_other_emg(
    model: Hypothesis, recorded: Fit, models: dict[tuple[frozenset[str], bool], Hypothesis]
) -> Hypothesis:
    """The same model or, where that is more likely, the one fitted to the EMG that is expected behind a noisy recording
    (errors in variables), or to the recording again where what is expected leaves no noise of the EMG.

    Args:
        recorded: a fit to the EMG as it was recorded.
        models: takes what is fitted.
    """
    if (EMG in model.on) == model.expected_emg:
        return model
    record = recorded.record
    if not model.expected_emg:
        noise = model.best.sizes[EMG]
        emg = expected_excitation(record.emg.numpy(), _valid_of_emg(recorded), noise)
        record = replace(record, emg=torch.from_numpy(emg))
    fit = replace(model.fit, record=record)
    found = attempt_fit(lambda: refit(fit, fit.model, fit.free))
    if found is None:
        return model
    begun = Hypothesis.of(found, model.looking, model.effects, [model.best], model.prior)
    other = settle(replace(begun, expected_emg=not model.expected_emg))
    models[frozenset(other.effects), other.expected_emg] = other
    return max(model, other, key=lambda each: each.total)


def _valid_of_emg(fit: Fit) -> NDArray[np.bool_]:
    """Samples of the EMG that count; of pieces those before their start, too."""
    lead = np.ones((len(fit.record.valid), fit.record.lead), bool)
    return np.concatenate([lead, fit.record.valid], 1)
