"""What is said in a case, as plain data that a scorer can read."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from myowave.data.trials import Trials
from myowave.diagnosis.changed.ask import what_changed
from myowave.diagnosis.report.numbers import Z95
from myowave.diagnosis.search.diagnose import diagnose
from myowave.identification.output_error import Fit
from myowave.identification.prediction import predict
from myowave.identification.record import make_record
from myowave.physics.effect import Effect
from myowave.physics.model import Model
from myowave.settings import DiagnosisSettings, Identify
from studies.reality.rivals import lasso, pysindy
from studies.reality.settings import Case
from studies.shared import put_in


def answer_case(
    case: Case,
    trials: Trials,
    base: Model,
    catalogue: Mapping[str, Effect],
    identify: Mapping[str, Identify],
    settings: DiagnosisSettings,
    say: Callable[[str], None] = lambda line: None,
) -> dict[str, Any]:
    """Ask what is missing in all trials, or what changed between two groups of them, with what is withheld taken out.

    Returns:
        Verdict, names, classes, what unusual constants may stand for, and sizes by parameter, [value, low, high] in SI
        units; errors of whole trials kept for testing, with nothing found and with what was named or, where nothing
        was, came nearest [deg], None where only torques were compared; and what rivals name.
    """
    effects = {name: effect for name, effect in catalogue.items() if name not in case.leave_out}
    trials = as_asked(trials, case)
    if case.changed is not None:
        return _changed(case, trials, base, effects, settings, say)
    found = diagnose(trials, base, effects.values(), identify, settings, say)
    verdict, first, last = found.verdict, found.rungs[0].fit, found.tried[-1].fit
    sizes = {name: (value, Z95 * error) for name, (value, error) in found.rungs[-1].estimate.items() if "." in name}
    return {
        "verdict": verdict.kind,
        "names": list(verdict.causes),
        "class": [list(members) for members in verdict.named if len(members) > 1],
        "nearest": list(verdict.nearest),
        "masked": list(verdict.maybe),
        "sizes": {name: [value, value - half, value + half] for name, (value, half) in sizes.items()},
        "error_before": held_out_deg(first, trials),
        "error_after": held_out_deg(last, trials),
        "lasso": lasso(trials, base, effects),
        "pysindy": pysindy(trials, base),
    }


def as_asked(trials: Trials, case: Case) -> Trials:
    """The trials with what is withheld taken out, and with what is put in."""
    told = {n: {**trials.conditions.get(n, {}), **case.told} for n in trials.names}
    over_time = {name: signal for name, signal in trials.over_time.items() if name not in case.told}
    trials, put = replace(trials, conditions=told, over_time=over_time), case.put_in
    return trials if put is None else put_in(trials, put.trials, put.channels, put.gain, put.delay_s)


def held_out_deg(fit: Fit, trials: Trials) -> float:
    """Error of trials kept for testing, simulated from their start to their end [deg]; infinite where one diverges."""
    record = make_record(trials, fit.model)
    test = record.take(np.flatnonzero(~record.training))
    try:
        return float(np.degrees(predict(fit, test).rmse))
    except ValueError:
        return math.inf


def _changed(
    case: Case,
    trials: Trials,
    base: Model,
    effects: Mapping[str, Effect],
    settings: DiagnosisSettings,
    say: Callable[[str], None],
) -> dict[str, Any]:
    """The likeliest change is named, with the class that it cannot leave; where nobody can tell, it is the nearest."""
    assert case.changed is not None
    found = what_changed(trials, base, effects.values(), case.changed, settings.scatter, say)
    changes = {name: found.of(name) for name in found.names}
    return {
        "verdict": found.verdict,
        "names": list(found.names[:1]),
        "class": [list(found.names)] if found.verdict == "class" else [],
        "nearest": [found.changes[0].effect] if found.verdict == "undecidable" else [],
        "masked": [],
        "sizes": {change.parameters[0]: [change.value, *change.interval] for change in changes.values()},
        **dict.fromkeys(["error_before", "error_after"]),
        **dict.fromkeys(["lasso", "pysindy"], "not run"),
    }
