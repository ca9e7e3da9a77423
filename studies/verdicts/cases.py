"""How often the diagnosis is right: effects hidden in trials of several worlds, of many strengths and noises.

A case is one dataset. What was hidden is known here and to `make_trials` only; the diagnosis gets trials.
"""

import time
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import torch

from myowave.data.simulate import simulate_trials
from myowave.data.trials import Trials
from myowave.diagnosis.evidence import EVIDENCE, independent_samples
from myowave.diagnosis.scoring import Answer, answer, holds
from myowave.diagnosis.search.conclude import Findings, search
from myowave.diagnosis.search.score import FAILURES, score_effects
from myowave.diagnosis.search.verdict import Verdict, judge
from myowave.identification.free_parameters import Free, free_parameters
from myowave.identification.output_error import Fit
from myowave.identification.prediction import predict
from myowave.identification.record import make_record
from myowave.identification.stages import fit_in_stages
from myowave.physics.drive import channels_of
from myowave.physics.effect import Effect
from myowave.physics.model import Model
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation
from myowave.settings import DiagnosisSettings, SimulatedDataset
from studies.verdicts.settings import Verdicts
from studies.verdicts.worlds import ALLOWED, CURVES, FINER, World, draw_world, record, sample_and_hold

POWER = 1.2816  # standard deviations above the threshold that 9 of 10 recordings reach
OUTSIDE, ASSUMED = "outside", "as_assumed"


@dataclass(frozen=True)
class Case:
    """A dataset of the benchmark.

    Args:
        world: one of `worlds.ALLOWED`.
        hidden: effects with their parameters by short name.
        taken_out: effects that the catalogue lacks.
        number: of the case in its world; decides all that is drawn.
        noise_deg: of the angle.
    """

    world: str
    hidden: Mapping[str, Mapping[str, float]]
    taken_out: tuple[str, ...]
    number: int
    strength: float
    noise_deg: float

    @property
    def label(self) -> str:
        return "+".join(self.hidden) or "none"

    @property
    def random(self) -> np.random.Generator:
        """What is drawn for this case only, so that cases are independent."""
        return np.random.default_rng([self.number, zlib.crc32(f"{self.world} {self.label}".encode())])


def list_cases(world: str, base: Model, catalogue: Mapping[str, Effect], plan: Verdicts) -> list[Case]:
    """All cases of a world: effects in an order of its own, with strengths and noises that go round, and sets without
    any effect."""
    possible = [name for name in plan.effects or catalogue if not base.refuses(catalogue[name])]
    # Few cases are then a sample of the catalogue, another one in each world, and more cases hold fewer ones.
    names = [str(name) for name in np.random.default_rng(zlib.crc32(world.encode())).permutation(possible)]
    noises = plan.angle_noises_deg if world == ASSUMED else (plan.angle_noise_deg,)
    cases = []
    for i in range(plan.cases * len(noises)):
        chosen = [names[(i // len(noises)) % len(names)]]
        if world == OUTSIDE and i % 2:  # two at once, of which one is not in the catalogue
            chosen.append(names[(i * 7 + 3) % len(names)])
        chosen = list(dict.fromkeys(chosen))
        strength = plan.strengths[(i // len(noises) + i // len(names)) % len(plan.strengths)]
        hidden = {name: hidden_values(base, catalogue[name], strength, i) for name in chosen}
        out = (chosen[0],) if world == OUTSIDE else ()
        cases.append(Case(world, hidden, out, i, strength, noises[i % len(noises)]))
    clean = [Case(world, {}, (), i, 0.0, noises[i % len(noises)]) for i in range(plan.clean_sets)]
    return cases + (clean if world != OUTSIDE else [])


def hidden_values(model: Model, effect: Effect, strength: float, turn: int) -> dict[str, float]:
    """Parameter values: of alternating sign from one turn and from one muscle to the next where bounds allow.

    Args:
        strength: as a fraction of the strongest, which is twice the typical one or as near as the bounds allow.
    """
    named = model.with_effects([effect]).parameters_of(effect)
    room = min(max(p.high, -p.low) / abs(p.typical) for p in named.values())
    factor = strength * min(2.0, room)
    values = {}
    for i, (name, p) in enumerate(named.items()):
        sign = -1.0 if (turn + i) % 2 and p.low < 0 < p.high else 1.0
        values[name.split(".", 1)[1]] = float(np.clip(sign * factor * p.typical, 0.95 * p.low, p.high))
    return values


def diagnose_world(
    cases: Sequence[Case],
    dataset: SimulatedDataset,
    settings: DiagnosisSettings,
    base: Model,
    catalogue: Mapping[str, Effect],
    progress: Callable[[int, int, str], None] = lambda done, total, text: None,
) -> pd.DataFrame:
    """Diagnose cases; one row per case, see `diagnose_case`.

    Args:
        dataset: what the trials are like.
    """
    rows = []
    for case in cases:
        world = draw_world(case.world, base, settings.scatter, case.random)
        made = make_trials(case, world, dataset, catalogue)
        if made is not None:
            rows.append(diagnose_case(case, world, made, dataset, settings, base, catalogue))
        progress(len(rows), len(cases), "")
    return pd.DataFrame(rows)


def make_trials(case: Case, world: World, dataset: SimulatedDataset, catalogue: Mapping[str, Effect]) -> Trials | None:
    """Trials of a case as its recorder reports them; None where no EMG is found that keeps the arm in range."""
    settings = dataset.model_copy(
        update={
            "hidden_effect": case.hidden,
            "seed": case.number + 1,
            "angle_noise_deg": 0.0,
            "hidden_constants": dict(world.constants),
        }
    )
    try:
        trials, _ = simulate_trials(f"{case.world}{case.number}", settings, world.model, catalogue)
    except ValueError:
        return None
    if world.sample_and_hold:
        trials = replace(trials, angle=_with_sample_and_hold(case, trials, settings, world, catalogue))
    random = case.random.spawn(1)[0]
    noisy = trials.angle + np.radians(case.noise_deg) * random.standard_normal(trials.angle.shape)
    return record(replace(trials, angle=noisy), world, random)


def _with_sample_and_hold(
    case: Case, trials: Trials, settings: SimulatedDataset, world: World, catalogue: Mapping[str, Effect]
) -> np.ndarray[Any, np.dtype[np.float64]]:
    """The angle of the same EMG that keeps its value between samples, (T, N)."""
    model = world.model.with_effects(catalogue[name] for name in case.hidden)
    values = {f"{effect}.{p}": v for effect, ps in case.hidden.items() for p, v in ps.items()}
    emg = sample_and_hold(channels_of(model, trials.channels, torch.from_numpy(trials.emg)))
    motion = simulate(Simulation(model, values, emg, trials.dt / FINER), settings.start_rad)
    return motion.angle.numpy()[..., ::FINER]


def diagnose_case(
    case: Case,
    world: World,
    trials: Trials,
    dataset: SimulatedDataset,
    settings: DiagnosisSettings,
    base: Model,
    catalogue: Mapping[str, Effect],
) -> dict[str, Any]:
    """One row of the benchmark: what was hidden, what was found, and how well."""
    known = {name: effect for name, effect in catalogue.items() if name not in case.taken_out}
    began = time.process_time()
    whole = make_record(trials, base)
    free = _displaced(free_parameters(base, dataset.identify, whole.known, settings.scatter), case)
    row = {
        "world": case.world,
        "hidden": case.label,
        "taken_out": " ".join(case.taken_out),
        "number": case.number,
        "strength": case.strength,
        "noise_deg": case.noise_deg,
        "recording": " ".join(f"{name}={value:.3g}" for name, value in world.recording.items()),
    }
    try:
        found = search(fit_in_stages(base, whole.train, free, starts=settings.starts), known.values())
    except FAILURES as error:
        return row | {"verdict": "failed", "found": str(error), "right": False, "wrong_name": False}
    verdict = judge(found)
    seconds = time.process_time() - began
    test = whole.take(np.flatnonzero(~whole.training))
    selection = found.selection
    return {
        **row,
        **score(case, verdict),
        "signal": _signal(case, selection.ladder[0], catalogue),
        "explained": verdict.explained,
        "missing_deg": np.degrees(verdict.missing),
        "emg_noise": verdict.emg_noise,
        "rmse_base_deg": np.degrees(selection.ladder[0].rmse()),
        "rmse_deg": np.degrees(selection.fit.rmse()),
        "heldout_base_deg": np.degrees(predict(selection.ladder[0], test).rmse),
        "heldout_deg": np.degrees(predict(selection.fit, test).rmse),
        **_intervals(case, world, found, base),
        "seconds": seconds,
    }


def score(case: Case, verdict: Verdict) -> dict[str, Any]:
    """The verdict, and whether it is right."""
    named = answer(verdict.causes, verdict.alternatives)
    allowed = ALLOWED[case.world] | frozenset(case.hidden) - set(case.taken_out)
    if CURVES & set(case.taken_out):
        allowed |= CURVES
    # A class that holds what is not in the catalogue is no wrong name where the arm has such a thing.
    strange = bool(case.taken_out) or case.world == "other_curves"
    wrong = names_wrongly(tuple(c for c in named if not (strange and c[0] in verdict.stand_ins)), allowed)
    if case.taken_out:
        says_so = verdict.kind == "partial" or bool(verdict.stand_ins) or any(len(members) > 1 for members in named)
        right = not named or (says_so and not wrong)
    elif case.hidden:
        right = holds(named, case.hidden)
    else:
        right = verdict.kind in ("adequate", "undecidable") or (bool(named) and not wrong)
    return {
        "verdict": verdict.kind,
        "found": " + ".join("/".join(members) for members in named),
        "nearest": " ".join(verdict.nearest),
        "or_else": "; ".join(names[0] for names in verdict.stand_ins.values()),
        "right": bool(right),
        "wrong_name": wrong,
        "absorbed": " ".join(sorted(verdict.absorbed)),
    }


def _displaced(free: Iterable[Free], case: Case) -> list[Free]:
    """What to estimate, expected where the truth is up to its spread away: nobody knows the values before."""
    random = case.random.spawn(2)[1]
    return [replace(p, start=p.start / (1 + p.spread * random.uniform(-1, 1))) for p in free]


def _signal(case: Case, fit: Fit, catalogue: Mapping[str, Effect]) -> float:
    """How far the weakest hidden effect, or of those not in the catalogue the weakest, is above what 9 of 10 recordings
    would show: at least 1 for one that is [-]."""
    signals = []
    for name, score in score_effects(fit, (catalogue[name] for name in case.taken_out or case.hidden)).items():
        truth = np.array([case.hidden[name][p.name.split(".", 1)[1]] / p.scale for p in score.free])
        seen = np.sqrt(truth @ score.information @ truth) / fit.record.noise
        threshold = np.sqrt(EVIDENCE + len(truth) * np.log(independent_samples(fit))) + POWER
        signals.append(0.0 if score.absorbed else float(seen / threshold))
    return min(signals, default=0.0)


def _intervals(case: Case, world: World, found: Findings, base: Model) -> dict[str, Any]:
    """How many 95 % intervals of the last model hold the truth, where it has the effects that were hidden, and the
    largest error of what was to be identified."""
    last = found.selection.fit
    truth = {**base.defaults, **world.constants}
    truth |= {f"{e}.{p}": v for e, ps in case.hidden.items() for p, v in ps.items()}
    identified = [p.name for p in last.free if p.spread > 0]
    worst = max((abs(last.parameters[name] / truth[name] - 1) * 100 for name in identified), default=np.nan)
    if set(found.selection.effects) != set(case.hidden):
        return {"worst_error_pct": worst, "intervals": 0, "covered": 0}
    errors = last.standard_errors()
    names = [p.name for p in last.free if not (p.name.endswith("_curve") and case.world == "other_curves")]
    inside = [abs(last.parameters[name] - truth[name]) <= 1.96 * errors[name] for name in names]
    return {"worst_error_pct": worst, "intervals": len(inside), "covered": int(sum(inside))}


def groups(rows: pd.DataFrame) -> Iterator[tuple[str, str, float, pd.DataFrame]]:
    """The rows that are counted together: of each world and noise those with an effect, and those without."""
    for world, with_effect in rows[rows["hidden"] != "none"].groupby("world", sort=False):
        for noise, part in with_effect.groupby("noise_deg"):
            yield str(world), "effect", float(noise), part
    for world, part in rows[rows["hidden"] == "none"].groupby("world", sort=False):
        yield str(world), "nothing", np.nan, part


def names_wrongly(named: Answer, hidden: Collection[str]) -> bool:
    """Whether something was named, by itself or as a class, that is not in the data."""
    return any(not set(members) & set(hidden) for members in named)
