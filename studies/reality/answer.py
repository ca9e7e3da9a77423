"""What the diagnosis says in a case, as plain data that a scorer can read."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from myowave.data.trials import Trials
from myowave.diagnosis.search.diagnose import Diagnosis, diagnose
from myowave.identification.output_error import Fit
from myowave.identification.prediction import predict
from myowave.identification.record import make_record
from myowave.physics.effect import Effect
from myowave.physics.model import Model
from myowave.settings import DiagnosisSettings, Identify

WIDE = 1.96  # standard errors on either side of an estimate: a 95 % interval


def answer_case(
    trials: Trials,
    base: Model,
    effects: Mapping[str, Effect],
    identify: Mapping[str, Identify],
    settings: DiagnosisSettings,
    say: Callable[[str], None] = lambda line: None,
) -> dict[str, Any]:
    """Diagnose a dataset: verdict, names, classes, sizes with intervals, and errors of whole trials kept for testing,
    with nothing found and with what was named or, where nothing was, came nearest.

    Args:
        effects: the catalogue, without what is withheld.
    """
    found = diagnose(trials, base, effects.values(), identify, settings, say)
    verdict, fits = found.verdict, [rung.fit for rung in found.rungs]
    return {
        "verdict": verdict.kind,
        "names": list(verdict.causes),
        "class": [list(members) for members in verdict.alternatives],
        "nearest": list(verdict.nearest),
        "sizes": _sizes(fits[-1]),
        "error_before": held_out_deg(fits[0], trials),
        "error_after": held_out_deg(fits[-1], trials),
        "stages": _stages(found),
    }


def held_out_deg(fit: Fit, trials: Trials) -> float | None:
    """Error of trials kept for testing, simulated from their start to their end [deg]; None where a motion diverges."""
    record = make_record(trials, fit.model)
    test = record.take(np.flatnonzero(~record.training))
    try:
        return float(np.degrees(predict(fit, test).rmse))
    except ValueError:
        return None


def _sizes(fit: Fit) -> dict[str, list[float]]:
    """Estimates of effects with their intervals, by parameter: [value, low, high], SI units."""
    errors = fit.standard_errors()
    values = {name: value for name, value in fit.parameters.items() if "." in name}
    return {name: [v, v - WIDE * errors[name], v + WIDE * errors[name]] for name, v in values.items()}


def _stages(found: Diagnosis) -> dict[str, float | None]:
    """How far each model was followed [s]; None for whole trials."""
    return {rung.name: rung.fit.record.horizon_s for rung in found.rungs}
