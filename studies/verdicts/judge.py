"""What the diagnosis says of a set, and what that is worth."""

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from myowave.diagnosis.causes import EMG_NOISE, OUTSIDE
from myowave.diagnosis.report.numbers import Z95
from myowave.diagnosis.scoring import Named, grade, is_wrong
from myowave.diagnosis.search.diagnose import weigh
from myowave.identification.output_error import Fit
from myowave.identification.stages import FAILURES
from myowave.physics.effect import Effect
from studies.verdicts.cases import SIMULATORS
from studies.verdicts.sets import Drawn


@dataclass(frozen=True)
class Judged:
    """An answer."""

    kind: str  # see `scoring.grade`
    named: Named
    probabilities: Mapping[str, float]  # of each name that was weighed; none where what is left is no noise
    effects: tuple[str, ...] = ()  # of the model that the intervals are of
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # low and high of each parameter, 95 %
    nothing_missing: float | None = None  # p-value of that; None where nobody was asked


def by_evidence(fit: Fit, effects: Iterable[Effect]) -> Judged:
    """What the diagnosis says."""
    verdict = weigh(fit, fit.record.whole, fit.free, list(effects))
    found = verdict.answer
    # A page calls curves or paths of another shape "unknown", as no effect of the catalogue is them, and names them
    # beside that.
    kind = found.kind if found.of_shapes else verdict.kind
    given = {} if kind == "unknown" else {k: p for k, p in found.probabilities.items() if k != OUTSIDE}
    estimates = verdict.ladder.estimates[-1].items()
    intervals = {name: (mean - Z95 * error, mean + Z95 * error) for name, (mean, error) in estimates}
    return Judged(kind, found.named, given, verdict.ladder.effects, intervals, found.white)


def judge_set(
    drawn: Drawn,
    name: str,
    fit: Fit,
    catalogue: Mapping[str, Effect],
    asked: Callable[[Fit, Iterable[Effect]], Judged] = by_evidence,
) -> dict[str, Any]:
    """One row: what was hidden, what was found, and what that is worth.

    Args:
        name: of the judge.
        fit: the first.
        asked: who answers.
    """
    case, began = drawn.case, time.process_time()
    try:
        judged = asked(fit, drawn.known_to(catalogue))
    except FAILURES as error:
        judged = Judged("failed", ((str(error),),), {})
    held, named = _held(drawn, judged), drawn.graded_as(judged.named)
    return {
        "draw": case.draw,
        "world": case.world,
        "turn": case.turn,
        "hidden": " + ".join(case.hidden),
        "taken_out": " ".join(case.taken_out),
        "strength": case.strength,
        "noise_deg": case.noise_deg,
        "recording": _listed(drawn.recording),
        "signals": _listed(drawn.signals),
        "shows": _worded(drawn.wanted),
        "judge": name,
        "verdict": judged.kind,
        "named": " + ".join(" / ".join(members) for members in judged.named),
        "grade": grade(judged.kind, named, drawn.true, drawn.wanted),
        "wrong_name": is_wrong(named, drawn.true),
        "wrong_emg_noise": EMG_NOISE not in drawn.true and (EMG_NOISE,) in judged.named,
        "probabilities": _listed({k: p for k, p in judged.probabilities.items() if p >= 0.01}),
        "true": _worded(drawn.true & set(judged.probabilities)),
        "nothing_missing": judged.nothing_missing,
        "intervals": len(held),
        "held": int(sum(held)),
        "seconds": round(time.process_time() - began, 1),
    }


def _held(drawn: Drawn, judged: Judged) -> list[bool]:
    """Whether each interval holds the true value, where the model has what was hidden and the arm such a parameter."""
    case = drawn.case
    # The constants of another simulator are its own.
    if case.taken_out or case.world in SIMULATORS or set(judged.effects) != set(case.hidden):
        return []
    truth = {**drawn.constants, **case.values}
    curved = case.world in ("other_curves", "all_at_once")
    return [
        bool(low <= truth[name] <= high)
        for name, (low, high) in judged.intervals.items()
        if name in truth and not (curved and name.endswith("_curve"))
    ]


def _worded(names: Iterable[str]) -> str:
    return " ".join(sorted(name.replace(" ", "_") for name in names))


def _listed(values: Mapping[str, float]) -> str:
    return " ".join(f"{name.replace(' ', '_')}={value:.3g}" for name, value in values.items())
