"""A diagnosis as verdict.json: numbers, names, kinds and units. `tell` makes all sentences of these."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from myowave.data.json_files import number_or_none
from myowave.diagnosis.causes import CAUSE_TITLES, EMG_NOISE, GAIN_PER_TRIAL, OWN_SHAPES
from myowave.diagnosis.search.diagnose import Diagnosis
from myowave.diagnosis.search.next_trial import SEPARATED
from myowave.diagnosis.search.where import locate
from myowave.identification.free_parameters import Free
from myowave.identification.noise import BOUND, SMALLEST_NOISE_DEG
from myowave.identification.output_error import Fit
from myowave.physics.constants import CURVE, GROUP_CONSTANTS, constant_of
from myowave.physics.model import Model

LEAST = 0.01  # of probabilities that are told
# What is said of an arm as it is said of a machine, in titles of effects and meanings of constants.
OF_MACHINES = {" in the hand": "", "the hand": "it", "upper arm": "frame", "forearm": "link", "elbow": "joint"}
OF_MACHINES |= {"EMG": "torque", "flexing positive": "positive as the angle"}
AT_BOUND = 1e-3  # of the way between its bounds: nearer than this a value is at one


def verdict_facts(diagnosis: Diagnosis) -> dict[str, Any]:
    """What a diagnosis has to say: verdict.json but for what comparison, scoring and the run's settings add to it."""
    verdict, (base, *_), last = diagnosis.verdict, diagnosis.rungs, diagnosis.rungs[-1]
    answer, ladder = verdict.answer, verdict.ladder
    # What comes nearest to something unknown is no model that was found.
    found = base if verdict.kind == "unknown" else last
    before = diagnosis.rungs[:-1] if verdict.kind != "adequate" else ()
    # What comes nearest may have been fitted to fewer pieces, and leaves more than noise as well.
    nearest = answer.best.fit.model.name if verdict.nearest else found.name
    worse = [rung for rung in diagnosis.named if rung.name == nearest or rung.fit.rss > last.fit.rss]
    next_trials = (
        {"question": question, **asdict(best)}
        for question, proposals in diagnosis.proposals.items()
        for best in proposals[:1]
        if best.separation > SEPARATED
    )
    return {
        "dataset": diagnosis.dataset,
        "electrodes": list(base.fit.model.channels),  # none on a limb or machine without muscles
        "horizon_s": diagnosis.test.horizon_s,
        "verdict": verdict.kind,
        "effects": list(verdict.causes),
        "model": found.name,
        "alternatives": [list(c) for c in verdict.named if len(c) > 1],
        "where": locate(base.misfit),
        "worst_part_deg": float(base.misfit["rmse_deg"].max()),
        "rmse_deg": {
            rung.name: {
                "train": float(np.degrees(rung.seen.rmse)),
                "heldout": float(np.degrees(rung.heldout.rmse)),
                # What the fit leaves, which may move starts of pieces within their error: to be set beside the noise.
                "fitted": float(np.degrees(rung.fit.rmse())),
                "noise": diagnosis.noise_deg,
            }
            for rung in diagnosis.tried
        },
        "parameters": {rung.name: parameters_of(rung.fit, rung.estimate) for rung in diagnosis.tried},
        "missing_torque_Nm": {rung.name: number_or_none(rung.missing.rms) for rung in (base, found)},
        "torque_noise_Nm": {rung.name: number_or_none(rung.missing.standard_error) for rung in (base, found)},
        "next_trial": next(next_trials, None),
        "absorbed": {name: list(by) for name, by in verdict.absorbed.items()},
        "outside_usual_range": {name: list(by) for name, by in verdict.masked.items()},
        "explained": verdict.explained,
        "rest": OWN_SHAPES if answer.of_shapes else "",
        # Their intervals hold only if the model were right.
        "models_that_leave_more": sorted({rung.name for rung in (*worse, *before, *[last] * verdict.left)}),
        "follows": verdict.follows,
        "missing_deg": float(np.degrees(answer.missing)) if verdict.left else 0.0,
        "emg_noise": answer.emg_noise,
        "probabilities": {
            name: float(p)
            for name, p in sorted(answer.probabilities.items(), key=lambda pair: -pair[1])
            if p > LEAST and verdict.follows
        },
        "emg_motion_deg": float(np.degrees(answer.emg_motion)),
        # Against the model without the effect, which has all others.
        "evidence": {name: {"without": model, "log_odds": nats} for name, (model, nats) in ladder.odds.items()},
        "scored": len(ladder.rankings[0]),
        "nearest": list(verdict.nearest),
        "formula": diagnosis.draft.formula,
        "failed": dict(diagnosis.failed),
        "noise_is_bound": diagnosis.noise_deg <= BOUND * SMALLEST_NOISE_DEG,
        "titles": {c.name: fitting(c.effect.title, base.fit.model) for c in ladder.rankings[0]}
        | ({c: CAUSE_TITLES[c] for c in (EMG_NOISE, GAIN_PER_TRIAL)} if base.fit.model.muscles else {"base": "model"}),
    }


def parameters_of(fit: Fit, estimate: Mapping[str, tuple[float, float]]) -> dict[str, dict[str, Any]]:
    """Value, standard error, bounds, unit and meaning of each free parameter, and the value as fitted, with which the
    model is simulated; whether that is at a bound, and whether it is free only as nobody measured it: then what is
    expected before any trial, with its standard deviation.
    """
    of_effects = fit.model.effect_parameters
    whole = {name for e in fit.model.effects if e.replaces for name in fit.model.parameters_of(e)}

    def at_bound(p: Free, value: float) -> bool:
        near = {end for end in (p.low, p.high) if abs(value - end) < AT_BOUND * (p.high - p.low)}
        # An effect that is not there, or there as a whole, is no news.
        return p.name not in whole and bool(near - {0.0} if p.name in of_effects else near)

    def told(p: Free, ended: float) -> dict[str, Any]:
        mean, error = estimate[p.name]
        return {
            "value": min(max(mean, p.low), p.high),
            "fitted": ended,
            "se": number_or_none(error),
            "assumed": p.assumed,
            "expected": p.start if p.assumed else None,
            "deviation": number_or_none(p.deviation),
            "unit": (of_effects.get(p.name) or constant_of(p.name)).unit,
            "meaning": fitting(of_effects[p.name].meaning if p.name in of_effects else _meaning(p.name), fit.model),
            "low": p.low,
            "high": p.high,
            "at_bound": at_bound(p, ended),
        }

    return {p.name: told(p, float(value)) for p, value in zip(fit.free, fit.values, strict=True)}


def fitting(text: str, model: Model) -> str:
    """A text about an arm, of a machine where the model has no muscles."""
    for of_arm, of_machine in () if model.muscles else OF_MACHINES.items():
        text = text.replace(of_arm, of_machine)
    return text


def _meaning(constant: str) -> str:
    kind, _, owner = constant.partition("_")
    if kind in GROUP_CONSTANTS:
        return f"{kind} of the {owner}, as a multiple of the published"
    return constant_of(constant).meaning + f" of {owner}" * (bool(owner) and owner != CURVE)
