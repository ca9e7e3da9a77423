"""Rank the effects that a fitted model may lack: score all, refit the best, weigh the evidence, test it on folds."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from myowave.diagnosis.evidence import EVIDENCE, MARGIN, delta_bic, independent_samples
from myowave.diagnosis.search.score import FAILURES, ScoreTest, best_within, score_effects
from myowave.identification.free_parameters import Free, bounds, scales
from myowave.identification.least_squares import pseudo_inverse
from myowave.identification.output_error import Fit, begin_from, descend, promised
from myowave.identification.stages import attempt_fit
from myowave.physics.effect import Effect

FOLDS = 0.8  # share of folds, rounded down, in which the model with the effect must predict better
PAIRS = 2  # pairs of effects that are fitted where scores promise more than one effect gives
WORTH_FOLLOWING = 10.0  # of the objective without an effect: what a fresh start with it may begin at
LITTLE = 0.5  # of the variance of an independent sample: a step that gains less changes no ranking
REFUSED = 4  # steps in a row that fail: the rest of a descent is then worth little
OPTIMISM = 3.0  # a fit that is behind may still gain this many times what its next step promises
WORTH_A_REFIT, NEAR, SHARE, MOST = 2.0, 25.0, 0.4, 7  # which candidates are refitted, see `_worth_refitting`
MOST_STATEFUL = 3  # the same beside effects with states, which take ten times as long to fit


@dataclass(frozen=True)
class Candidate:
    """One effect, weighed.

    Args:
        score: what the fit without it says.
        fit: with it; None where the score left no hope.
        delta_bic: difference of BIC in its favour; from the score where it was not refitted.
        gain: the same but for what its parameters cost: twice the gain of log-likelihood.
        folds_won, folds: trials that are predicted better with it, by parameters estimated from the others.
        detectable: smallest value of its first parameter that 9 of 10 such recordings would show.
        failure: why it could not be weighed; empty where it was.
        surprising: whether its evidence is that constants need not be far from where they are expected, rather than a
            better prediction: a change of constants that nobody measured predicts as well as the effect.
    """

    effect: Effect
    score: ScoreTest
    fit: Fit | None
    delta_bic: float
    gain: float
    folds_won: int
    folds: int
    detectable: float
    failure: str = ""
    surprising: bool = False

    @property
    def name(self) -> str:
        return self.effect.name

    @property
    def weight(self) -> float:
        """Evidence less what the parameters that it leads to are beyond belief: decides between effects that the data
        alone do not tell apart, and nothing else."""
        return self.delta_bic - (0.0 if self.fit is None else surprise(self.fit))

    @property
    def absorbed(self) -> bool:
        """Whether the parameters take its place: by the score, and no fit with it says otherwise."""
        return self.score.absorbed and (self.fit is None or self.delta_bic < NEAR)

    @property
    def refitted(self) -> Fit:
        """The fit with it, as every acceptable one has."""
        assert self.fit is not None
        return self.fit

    @property
    def acceptable(self) -> bool:
        """Whether the data ask for adding it."""
        return (
            self.fit is not None
            and not self.absorbed
            and self.delta_bic > EVIDENCE
            and (self.surprising or self.folds_won >= int(FOLDS * self.folds))
            and not any(self.fit.at_bound(p.name) for p in self.score.free)
        )


def rank_effects(
    fit: Fit,
    effects: Iterable[Effect],
    known: Collection[str] = (),
    fitted: Mapping[str, Fit] | None = None,
    *,
    refits: bool = True,
    earlier: Sequence[Candidate] = (),
) -> list[Candidate]:
    """All effects that a fitted model does not have, the most evident first.

    Args:
        known: names of parameters that are known and so not to be estimated.
        fitted: fits with an effect that are there already, by its name.
        refits: whether the promising ones are fitted; without that none can be accepted.
        earlier: a ranking at this fit; scores and fits of it are taken, and only `fitted` is new.
    """
    effects, fitted = {e.name: e for e in effects}, fitted or {}
    if earlier:
        scores = {c.name: c.score for c in earlier}
        fits = {c.name: c.fit for c in earlier if c.fit is not None} | dict(fitted)
        failures = {c.name: c.failure for c in earlier}
    else:
        scores = score_effects(fit, effects.values(), known)
        hopeful = [name for name in _worth_refitting(fit, scores) if refits and name not in fitted]
        begun = {name: scores[name].start for name in hopeful}
        begun |= fresh_starts(fit, scores) if refits else {}
        fits, failures = race(begun, fitted.values())
        fits |= fitted
    failures |= {name: score.failure for name, score in scores.items() if score.failure}
    best = min(fits.values(), key=lambda f: f.objective, default=fit)
    samples = independent_samples(best)
    statistic = EVIDENCE + np.log(samples)
    candidates = []
    for name, score in scores.items():
        with_it = fits.get(name)
        won, folds = 0, count_folds(fit)
        if with_it is not None:
            try:
                won, folds = folds_won(fit, with_it)
            except FAILURES as error:
                with_it, failures[name] = None, str(error)
        objective = fit.objective - score.drop if with_it is None else with_it.objective
        candidates.append(
            Candidate(
                effect=effects[name],
                score=score,
                fit=with_it,
                delta_bic=delta_bic(fit, objective, len(score.free), samples),
                gain=delta_bic(fit, objective, 0, samples),
                folds_won=won,
                folds=folds,
                detectable=score.detectable(float(best.normal.rss) / samples, statistic),
                failure=failures.get(name, "") if with_it is None else "",
                surprising=with_it is not None and _surprising(fit, with_it),
            )
        )
    return sorted(candidates, key=lambda c: -c.delta_bic)


def race(starts: Mapping[str, Fit], rivals: Iterable[Fit]) -> tuple[dict[str, Fit], dict[str, str]]:
    """Fit candidates together, step by step; those that fall behind too far to win stop early.

    Args:
        starts: fits to descend from, by name.
        rivals: fits that take part and are at their end.

    Returns:
        The fits, and of the candidates that cannot be fitted the reason.
    """
    failures: dict[str, str] = {}
    fits = dict(starts)
    running = {name: descend(start) for name, start in starts.items()}
    refused = dict.fromkeys(starts, -1)  # what a descent gives first is its start
    best_rival = min((f.objective for f in rivals), default=np.inf)

    def advance(name: str) -> Fit | str | None:
        try:
            return next(running[name], None)
        except FAILURES as error:
            return str(error)

    while running:
        for name in list(running):
            step = advance(name)
            if isinstance(step, str):
                failures[name] = step
                del running[name], fits[name]
                continue
            if step is None:
                del running[name]
                continue
            refused[name] = refused[name] + 1 if step is fits[name] else 0
            little = fits[name].objective - step.objective < LITTLE * step.independent_variance
            # Nothing that counts as evidence is gained any more; the winner is fitted to the end by whoever takes it.
            if refused[name] >= REFUSED or (little and step is not fits[name]):
                del running[name]
            fits[name] = step
        leader = min([best_rival, *(f.objective for f in fits.values())])
        for name in list(running):
            hoped = fits[name].objective - OPTIMISM * (fits[name].objective - promised(fits[name]))
            if fits[name].record.values * np.log(max(hoped, 1e-300) / leader) > NEAR:
                del running[name]
    return fits, failures


def fresh_starts(fit: Fit, scores: Mapping[str, ScoreTest]) -> dict[str, Fit]:
    """Fits with an effect that replaces what the model has, as other curves do, from where constants are expected.

    The constants of a fit without the effect have gone where they imitate it, and no small step leads back from there.
    Only those are given that begin not far above the fit without the effect, and none where that leaves no more than
    the noise.
    """
    if fit.record.filter is None and fit.rss < fit.record.samples * fit.record.noise**2:
        return {}  # beside a filter its noise says nothing: it was found from what a poorer model leaves
    if any(_replaces(p) for p in fit.free if "." in p.name):
        return {}  # a model has one family of curves

    def begin(name: str) -> Fit | None:
        start = scores[name].start
        values = [*fit.expected, *(p.scale if p.high > 0 else -p.scale for p in scores[name].free)]
        return attempt_fit(lambda: begin_from(start.model, fit.record, start.free, np.array([values])))

    replacing = [name for name, score in scores.items() if not score.failure and all(_replaces(p) for p in score.free)]
    fresh = {name: begin(name) for name in replacing}
    return {name: f for name, f in fresh.items() if f is not None and f.objective < WORTH_FOLLOWING * fit.objective}


def _replaces(free: Free) -> bool:
    """Whether a parameter's usual strength is a bound: all of what the model has is then replaced."""
    return abs(free.scale) in (abs(free.low), abs(free.high))


def surprise(fit: Fit) -> float:
    """How far a fit's constants are from where they are expected: minus twice the logarithm of their prior [-]."""
    # ASSUME: a constant is expected around its value in the settings, with the standard deviation of a uniform
    # distribution over the range in which its searches start.
    usual = [(p.start, p.spread * abs(p.start) / np.sqrt(3), v) for p, v in zip(fit.free, fit.values, strict=True)]
    return float(sum(((value - start) / scatter) ** 2 for start, scatter, value in usual if scatter > 0))


def _surprising(without: Fit, with_it: Fit) -> bool:
    """Whether most of what an effect gains is that constants come nearer to where they are expected. Beside a random
    force that is no evidence: something unknown is missing, and constants do what they can for it."""
    gained, better = without.objective - with_it.objective, without.normal.rss - with_it.normal.rss
    return without.record.filter is None and bool(better < gained / 2)


def similar(candidates: list[Candidate], to: Candidate) -> list[Candidate]:
    """The candidates that the data do not tell from one of them.

    That an effect has a parameter more, as one for each muscle, is no reason to rule it out where it fits as well.
    """
    possible = [c for c in candidates if c.fit is not None and not c.absorbed]
    return [c for c in possible if max(c.delta_bic - to.delta_bic, c.gain - to.gain) > -MARGIN]


def promising_pairs(ranking: list[Candidate]) -> list[tuple[str, str]]:
    """Pairs of effects whose scores promise far more together than the best single effect, the best pairs first.

    To first order: the signals of all effects are there, so a pair costs no more than a product of small matrices.
    """
    scores = [c.score for c in ranking if not c.score.absorbed and not c.failure]
    if len(scores) < 2:
        return []
    signals = np.concatenate([s.signal for s in scores], -1)
    products, with_residual = signals.T @ signals, signals.T @ scores[0].residual
    ends = np.cumsum([len(s.free) for s in scores])
    columns = [slice(end - len(s.free), end) for s, end in zip(scores, ends, strict=True)]
    fit = scores[0].start
    samples = fit.record.samples

    def promise(*members: int) -> float:
        chosen = np.r_[tuple(columns[m] for m in members)]
        free = tuple(p for m in members for p in scores[m].free)
        _, drop = best_within(products[np.ix_(chosen, chosen)], with_residual[chosen], free)
        return delta_bic(fit, max(fit.objective - drop, 0.0), len(free), samples)

    count = range(len(scores))
    single = max(promise(i) for i in count)
    pairs = {(i, j): promise(i, j) for i in count for j in count if i < j}
    hopeful = sorted((p for p in pairs if pairs[p] > single + EVIDENCE), key=lambda p: -pairs[p])[:PAIRS]
    return [(scores[i].effect, scores[j].effect) for i, j in hopeful]


def count_folds(fit: Fit) -> int:
    """One for each trial; none where there is only one, as nothing is left to estimate from without it."""
    trials = len(set(fit.record.trials))
    return trials if trials > 1 else 0


def folds_won(without: Fit, with_it: Fit) -> tuple[int, int]:
    """In how many folds, each leaving out one trial, the richer model predicts the trial left out better."""
    if not count_folds(without):
        return 0, 0
    gains = (left_out_residuals(without) ** 2).sum(-1) - (left_out_residuals(with_it) ** 2).sum(-1)
    gains = np.array([gains[rows].sum() for rows in without.record.rows_by_trial.values()])
    return int((gains > 0).sum()), len(gains)


def left_out_residuals(fit: Fit) -> NDArray[np.float64]:
    """Residual of each trial predicted with parameters estimated from all others, (T, N) [rad].

    One Gauss-Newton step from the fit to all of them; the trial's own angle and velocity at the start are estimated
    from it, as nothing else can tell them. Of a trial in pieces all are left out together.
    """
    normal = fit.normal
    projected = normal.without_starts(normal.slope)
    own = np.einsum("tnp,tnq->tpq", projected, normal.slope)
    product = np.einsum("tnp,tn->tp", projected, normal.residual)
    total = normal.vector
    for rows in fit.record.rows_by_trial.values():
        own[rows], product[rows] = own[rows].sum(0), product[rows].sum(0)
    scale, (low, high) = scales(fit.free), bounds(fit.free)
    loose = (fit.values > low + 1e-9 * scale) & (fit.values < high - 1e-9 * scale)
    others = (normal.matrix - own)[:, loose][:, :, loose]
    ridge = 1e-9 * np.einsum("tpp->tp", others).max(-1, initial=0.0)[:, None, None] * np.eye(int(loose.sum()))
    step = np.zeros((len(own), len(fit.free)))
    step[:, loose] = (pseudo_inverse(others + ridge) @ (total - product)[:, loose, None])[..., 0]
    step = step.clip((low - fit.values) / scale, (high - fit.values) / scale)
    left = normal.residual - np.einsum("tnp,tp->tn", normal.slope, step)
    return normal.without_starts(left[..., None])[..., 0]


def _worth_refitting(fit: Fit, scores: Mapping[str, ScoreTest]) -> list[str]:
    """Names of the candidates whose score promises evidence, or nearly as much as the best."""
    possible = {name: s for name, s in scores.items() if not s.absorbed and not s.failure and s.drop > 0}
    if not possible:
        return []
    samples = independent_samples(fit)
    hopes = {n: delta_bic(fit, max(fit.objective - s.drop, 0.0), len(s.free), samples) for n, s in possible.items()}
    best = max(hopes.values())
    most = max(s.drop for s in possible.values())
    if best < WORTH_A_REFIT:
        return []
    near = [n for n in possible if hopes[n] > max(best - NEAR, 0.0) or possible[n].drop > SHARE * most]
    return sorted(near, key=lambda n: -hopes[n])[: MOST_STATEFUL if fit.model.stateful else MOST]
