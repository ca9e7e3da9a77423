"""The loop on one dataset: compare, where, which, add, watch; and what to do where the answer is not an effect."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
import pandas as pd

from myowave.data.trials import Trials
from myowave.diagnosis.likelihood.hypothesis import Hypothesis
from myowave.diagnosis.likelihood.waves import View
from myowave.diagnosis.search.answer import answer_of
from myowave.diagnosis.search.draft import Draft, draft_effect
from myowave.diagnosis.search.ladder import ladder_of
from myowave.diagnosis.search.next_trial import Menu, Proposal, propose_trials
from myowave.diagnosis.search.verdict import Verdict
from myowave.diagnosis.search.weigh import Posterior, weigh_models
from myowave.diagnosis.search.where import MissingTorque, misfit_by, missing_torque
from myowave.identification.expected_emg import behind_noise
from myowave.identification.free_parameters import Free, free_parameters
from myowave.identification.output_error import Fit, refit
from myowave.identification.prediction import Prediction, predict
from myowave.identification.record import Record, make_record
from myowave.identification.stages import (
    FAILURES,
    attempt_fit,
    fit_in_stages,
    fit_nearby,
    lengthen,
    over_short_pieces,
)
from myowave.physics.effect import Effect
from myowave.physics.model import Model
from myowave.settings import DiagnosisSettings, Identify, Scatter


@dataclass(frozen=True)
class Rung:
    """A model fitted to the training trials and tried on the others."""

    fit: Fit
    # the training trials as they are to be set beside the others: pieces that start at measured states are predicted
    # as these are; the fit moves each start within the error of its measurement
    seen: Prediction
    heldout: Prediction
    misfit: pd.DataFrame
    missing: MissingTorque
    estimate: Mapping[str, tuple[float, float]]  # of its parameters, mean and standard deviation

    @property
    def name(self) -> str:
        return self.fit.model.name


@dataclass(frozen=True)
class Diagnosis:
    """All that was found; tables and pictures only show it."""

    dataset: str
    test: Record  # the trials that no fit has seen; in pieces where whole trials diverge
    verdict: Verdict  # what the evidence allows to say
    rungs: tuple[Rung, ...]  # the base model, then what the search added, one effect more each
    # further models: what comes nearest where nothing is named, and those that somebody asked for; they decide nothing
    named: tuple[Rung, ...]
    # trials to record next, for each pair of candidates or absorbed effect that wants one: {"joint_damping or
    # muscle_damping": [...]}
    proposals: Mapping[str, list[Proposal]]
    draft: Draft  # a formula for what is missing; of the base model where the verdict is unknown, else of the last one
    failed: Mapping[str, str]  # models that somebody asked for and that could not be fitted, with the reason

    @property
    def tried(self) -> tuple[Rung, ...]:
        """All models, those of the search first."""
        return self.rungs + self.named

    @property
    def noise_deg(self) -> float:
        """Noise of the angle [deg]; of a filtered one what the filter has left of it. Where no model follows, or none
        is right, what is left is not noise: then what the angle itself shows, or the settings say."""
        none_right = not self.verdict.follows or self.verdict.kind == "unknown"
        return float(np.degrees(self.test.noise if none_right else self.verdict.answer.angle_noise))


def diagnose(
    trials: Trials,
    base: Model,
    effects: Iterable[Effect],
    identify: Mapping[str, Identify],
    settings: DiagnosisSettings,
    report: Callable[[str], None] = lambda line: None,
    models: Iterable[Model] = (),
) -> Diagnosis:
    """Diagnose one dataset.

    Args:
        trials: training and test trials; the test trials take no part in any decision.
        effects: the catalogue; those that cannot act on the muscles' paths are left out.
        identify: constants to estimate beside the parameters of effects.
        models: to fit and try beside those that the search visits.

    Raises:
        ValueError: if no trial is kept for testing, a muscle's channel was not recorded, or the base model cannot be
            fitted at all.
    """
    effects = {e.name: e for e in effects}
    for name in [name for name, effect in effects.items() if base.refuses(effect)]:
        report(f"left out: effect {name} {base.refuses(effects.pop(name))}")
    if not trials.test:
        raise ValueError(f"{trials.dataset}: no trial is kept for testing; name one or two under `test`")
    record = make_record(trials, base, settings.angle_noise_deg)
    free = free_parameters(base, identify, record.known, settings.scatter)
    fit = fit_in_stages(base, record.train, free, settings.starts)
    verdict = weigh(fit, record.train, free, list(effects.values()), report)
    ladder, fit = verdict.ladder, verdict.ladder.fits[0]
    if fit.record.horizon_s is not None:
        report(f"stages: {base.name} is judged over {fit.record.horizon_s:g} s, it does not follow longer motion")
        record = record.cut(fit.record.horizon_s)
    test = record.take(np.flatnonzero(~record.training))
    report(f"compare: {base.name} leaves {np.degrees(fit.rmse()):.3g} deg; the noise is {np.degrees(record.noise):.3g}")
    rungs = tuple(make_rung(*of, test) for of in zip(ladder.fits, ladder.estimates, strict=True))
    visited, best = {rung.name for rung in rungs}, verdict.answer.best
    named, failed = [], {}
    for model in [*[best.fit.model] * bool(verdict.nearest), *models]:
        if model.name not in visited:
            visited.add(model.name)
            try:
                beside = _fit_beside((*ladder.fits, best.fit), model, identify, settings.scatter)
                view = View.of(beside, best.view.sensor)
                named.append(make_rung(beside, Hypothesis.of(beside, view, effects).averaged, test))
            except FAILURES as error:
                failed[model.name] = str(error)
                report(f"left out: model {model.name}: {error}")
    for rung in (*rungs, *named):
        train, heldout = np.degrees(rung.seen.rmse), np.degrees(rung.heldout.rmse)
        report(f"{rung.name}: training {train:.3g} deg, held-out {heldout:.3g} deg")
    report(f"verdict: {verdict.kind}, {', '.join(verdict.causes) or 'no effect'}")
    missing = ladder.fits[0] if verdict.kind == "unknown" else ladder.fit
    # A torque of the moment is no way to say what curves or paths do.
    nameless = verdict.follows and not verdict.answer.of_shapes
    draft = draft_effect(missing, verdict.answer.best.view) if nameless else Draft()
    proposals = _proposals(verdict, effects)
    return Diagnosis(trials.dataset, test, verdict, rungs, tuple(named), proposals, draft, failed)


def weigh(
    fit: Fit,
    whole: Record,
    free: Sequence[Free],
    effects: Sequence[Effect],
    report: Callable[[str], None] = lambda line: None,
) -> Verdict:
    """What a fitted model lacks, by the evidence of whole trials or, where it is not led to these, of short pieces.

    A model that lacks much runs away within a second, and what it lacks is why. Over half a second it cannot get far,
    so effects are weighed there. With the most likely ones it is taken to longer pieces and to whole trials, and from
    the motion of that fit the model without any is fitted to whole trials as well; then all are weighed once more.

    Args:
        fit: of the model without effects, to whole trials or pieces of them.
        whole: the trials that were fitted, whole.
    """
    led = None
    if fit.record.pieces is not None:
        short = over_short_pieces(fit.model, whole, free, fit.values) or fit
        found = weigh_models(short, effects, report=report)
        # The most likely model, and then the one without its effects, fitted to whole trials.
        best = found.best.fit
        led = attempt_fit(lambda: lengthen(best, whole, best.free))
        led = None if led is None or led.record.pieces is not None else led
        alone = None if led is None else _alone(led, fit.model, free)
        if led is None or alone is None:
            return _verdict(fit, found, effects)
        fit = alone
        report(f"stages: {led.model.name}, found over short pieces, follows whole trials")
    return _verdict(fit, weigh_models(fit, effects, led, report), effects)


def _alone(led: Fit, base: Model, free: Sequence[Free]) -> Fit | None:
    """The model without the effects that led it to whole trials, fitted to these; None where it has no motion there.

    What it lacks may be why it has none near the measured motion, or that of the fit with effects; then the one that
    its values simulate has to do, however far off.
    """
    values = np.array([led.parameters[p.name] for p in free])
    return attempt_fit(partial(refit, led, base, free)) or fit_nearby(base, led.record, free, values)


def _verdict(fit: Fit, found: Posterior, effects: Sequence[Effect]) -> Verdict:
    answer = answer_of(found)
    return Verdict(answer, ladder_of(fit, found, answer, effects))


def _fit_beside(
    ladder: Sequence[Fit], model: Model, identify: Mapping[str, Identify], scatter: Mapping[str, Scatter]
) -> Fit:
    """Fit a model to the trials of a ladder, from the rung that has most of its effects and none besides."""
    wanted = {effect.name for effect in model.effects}
    within = [fit for fit in ladder if {effect.name for effect in fit.model.effects} <= wanted]
    return refit(within[-1], model, free_parameters(model, identify, ladder[0].record.known, scatter))


def make_rung(fit: Fit, estimate: Mapping[str, tuple[float, float]], test: Record) -> Rung:
    """Try a fitted model on trials it has not seen, with EMG of the same kind, and look at what it leaves."""
    seen = Prediction(fit.residual, fit.rmse()) if fit.record.pieces is None else predict(fit, fit.record)
    heldout = predict(fit, behind_noise(test, fit.record.emg_noise))
    return Rung(fit, seen, heldout, misfit_by(fit), missing_torque(fit), estimate)


def _proposals(verdict: Verdict, effects: Mapping[str, Effect]) -> dict[str, list[Proposal]]:
    """Trials that separate the members of a class, and those that show an absorbed effect a verdict hinges on; none
    where no motion is found with the effects, or no muscle moves the arm."""
    ladder = verdict.ladder
    if not ladder.fit.model.muscles:
        return {}
    proposals, menu_of = {}, cache(lambda rung: Menu.of(ladder.fits[rung]))
    have = [{effect.name for effect in fit.model.effects} for fit in ladder.fits]
    classes = ([name for name in members if name in effects] for members in verdict.named)
    for one, other, *_ in (members for members in classes if len(members) > 1):
        without = max(rung for rung, names in enumerate(have) if not {one, other} & names)
        with suppress(*FAILURES):
            proposals[f"{one} or {other}"] = propose_trials(menu_of(without), effects[one], effects[other])
    for name in verdict.maybe:
        with suppress(*FAILURES):
            proposals[f"{name} or its absence"] = propose_trials(menu_of(len(have) - 1), effects[name])
    return proposals
