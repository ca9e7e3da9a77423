"""How often the diagnosis is right: effects hidden in simulated trials, of many strengths and noises.

A case is one dataset. Its motion is simulated once and used with every noise. What was hidden is known here and to
`simulate_case` only; the diagnosis gets trials.
"""

import time
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import torch

from myowave.data.simulate import ANGLE_RANGE, simulate_trials
from myowave.data.trials import Trials
from myowave.diagnosis.scoring import answer, is_right, names_wrongly
from myowave.diagnosis.search.conclude import search
from myowave.diagnosis.search.rank import EVIDENCE, independent_samples
from myowave.diagnosis.search.selection import Selection
from myowave.diagnosis.search.verdict import Verdict, judge
from myowave.identification.free_parameters import Free, free_parameters
from myowave.identification.prediction import predict
from myowave.identification.record import make_record
from myowave.identification.stages import fit_in_stages
from myowave.physics.drive import channels_of
from myowave.physics.effect import Effect
from myowave.physics.model import Model
from myowave.physics.simulation import Simulation
from myowave.physics.trajectory import solve
from myowave.settings import Diagnosis as DiagnosisSettings
from myowave.settings import SimulatedDataset

POWER = 1.2816  # standard deviations above the threshold that 9 of 10 recordings reach


@dataclass(frozen=True)
class Case:
    """A dataset of the study: hidden effects with their parameters by full name, and a seed."""

    hidden: Mapping[str, Mapping[str, float]]
    seed: int
    strength: float = 1.0

    @property
    def label(self) -> str:
        return "+".join(self.hidden) or "none"

    @property
    def digits(self) -> tuple[int, ...]:
        """Seed of what is drawn for this case only, so that cases are independent."""
        return self.seed, round(1000 * self.strength), zlib.crc32(self.label.encode())


def study_effect(
    hidden: str,
    clean: Sequence[Trials],
    dataset: SimulatedDataset,
    settings: DiagnosisSettings,
    base: Model,
    catalogue: Mapping[str, Effect],
    progress: Callable[[int, int, str], None] = lambda done, total, text: None,
) -> pd.DataFrame:
    """All cases with one effect, with a pair ("one+other"), or with none.

    Args:
        clean: trials of the seeds 1, 2, ... as `clean_trials` gives them.
        dataset: what they were simulated with.

    Returns:
        One row per case and noise, see `diagnose_case`.
    """
    study = settings.study
    if hidden == "none":
        cases = [Case({}, seed) for seed in range(1, study.clean_sets + 1)]
    else:
        effects, seeds = [catalogue[name] for name in hidden.split("+")], range(1, study.seeds + 1)
        if len(effects) > 1:
            cases = [*pair_cases(base, effects, seeds)]
        else:
            cases = [*single_cases(base, effects[0], study.strengths, seeds)]
    rows = []
    for case in cases:
        trials = simulate_case(case, clean[case.seed - 1], dataset, base, catalogue)
        for noise in study.angle_noises_deg:
            noisy = add_noise(trials, noise, *case.digits)
            rows.append(diagnose_case(case, noisy, dataset, base, catalogue.values(), settings, noise))
            progress(len(rows), len(cases) * len(study.angle_noises_deg), "")
    return pd.DataFrame(rows)


def clean_trials(dataset: SimulatedDataset, base: Model, seed: int) -> Trials:
    """Trials of a seed without hidden effect, with a perfect sensor."""
    plain = dataset.model_copy(update={"hidden_effect": {}, "angle_noise_deg": 0.0, "seed": seed})
    return simulate_trials(f"study{seed}", plain, base, {})[0]


def single_cases(model: Model, effect: Effect, strengths: Sequence[float], seeds: Sequence[int]) -> Iterator[Case]:
    """An effect in several strengths and seeds, of both signs where it has them.

    Args:
        strengths: as fractions of the strongest, which is twice the typical one or as near as the bounds allow.
    """
    for strength in strengths:
        for i, seed in enumerate(seeds):
            yield Case({effect.name: _values(model, effect, strength, i)}, seed, strength)


def pair_cases(model: Model, pair: Sequence[Effect], seeds: Sequence[int]) -> Iterator[Case]:
    """Two effects at once, each of its typical strength."""
    for i, seed in enumerate(seeds):
        yield Case({e.name: _values(model, e, 0.5, i) for e in pair}, seed, 0.5)


def _values(model: Model, effect: Effect, strength: float, turn: int) -> dict[str, float]:
    """Parameter values: of alternating sign from one turn and from one muscle to the next where bounds allow."""
    named = model.with_effects([effect]).parameters_of(effect)
    room = min(max(p.high, -p.low) / abs(p.typical) for p in named.values())
    factor = strength * min(2.0, room)
    values = {}
    for i, (name, p) in enumerate(named.items()):
        sign = -1.0 if (turn + i) % 2 and p.low < 0 < p.high else 1.0
        values[name.split(".", 1)[1]] = float(np.clip(sign * factor * p.typical, 0.95 * p.low, p.high))
    return values


def simulate_case(
    case: Case, clean: Trials, settings: SimulatedDataset, base: Model, catalogue: Mapping[str, Effect]
) -> Trials:
    """Trials with the hidden effects and a perfect sensor.

    Args:
        clean: the trials of this seed without effects or noise; their EMG is used where the motion it gives stays in
            range, else the EMG is drawn again.
    """
    if not case.hidden:
        return clean
    model = base.with_effects(catalogue[name] for name in case.hidden)
    values = {f"{effect}.{p}": v for effect, ps in case.hidden.items() for p, v in ps.items()}
    emg = channels_of(base, clean.channels, torch.from_numpy(clean.emg))
    start = torch.full((len(clean.names),), settings.start_rad, dtype=torch.float64)
    velocity = np.gradient(clean.angle, clean.dt, axis=-1)
    guess = torch.from_numpy(np.stack([clean.angle, velocity], -1))
    guess = torch.nn.functional.pad(guess, (0, model.state_size - 2))
    params = {name: torch.tensor(value, dtype=torch.float64) for name, value in values.items()}
    motion = solve(Simulation(model, params, emg, clean.dt), start, torch.zeros_like(start), guess=guess).motion
    q = motion.q.numpy()
    if np.isfinite(q).all() and ANGLE_RANGE[0] < q.min() and q.max() < ANGLE_RANGE[1]:
        return replace(clean, angle=motion.angle.numpy())
    noiseless = settings.model_copy(update={"hidden_effect": case.hidden, "seed": case.seed, "angle_noise_deg": 0.0})
    return simulate_trials(clean.dataset, noiseless, base, catalogue)[0]


def add_noise(trials: Trials, noise_deg: float, *seed: int) -> Trials:
    """Trials with white noise on the angle [deg]."""
    random = np.random.default_rng([*seed, round(1000 * noise_deg)])
    return replace(trials, angle=trials.angle + np.radians(noise_deg) * random.standard_normal(trials.angle.shape))


def diagnose_case(
    case: Case,
    trials: Trials,
    settings: SimulatedDataset,
    base: Model,
    effects: Iterable[Effect],
    diagnosis: DiagnosisSettings,
    noise_deg: float,
) -> dict[str, Any]:
    """One row of the study: what was hidden, what was found, and how well."""
    effects = list(effects)
    began = time.process_time()
    record = make_record(trials, base)
    free = _displaced(free_parameters(base, settings.identify, record.known, diagnosis.scatter), case)
    found = search(fit_in_stages(base, record.train, free, starts=diagnosis.starts), effects)
    selection, verdict = found.selection, judge(found)
    seconds = time.process_time() - began
    test = record.take(np.flatnonzero(~record.training))
    return {
        "hidden": case.label,
        "seed": case.seed,
        "strength": case.strength,
        "noise_deg": noise_deg,
        **_found(case, verdict),
        "signal": _signal(case, selection),
        "rmse_over_noise": np.degrees(selection.fit.rmse()) / noise_deg,
        "heldout_base_deg": np.degrees(predict(selection.ladder[0], test).rmse),
        "heldout_deg": np.degrees(predict(selection.fit, test).rmse),
        **_accuracy(case, selection, base),
        "seconds": seconds,
    }


def _found(case: Case, verdict: Verdict) -> dict[str, Any]:
    """The verdict, and whether it is right."""
    named = answer(verdict.causes, verdict.alternatives)
    return {
        "verdict": verdict.kind,
        "found": " + ".join("/".join(members) for members in named),
        "hit": bool(case.hidden) and is_right(named, case.hidden),
        "wrong_name": names_wrongly(named, case.hidden),
        "absorbed": " ".join(sorted(verdict.absorbed)),
    }


def _displaced(free: Iterable[Free], case: Case) -> list[Free]:
    """What to estimate, expected where the truth is up to its spread away: nobody knows the values before."""
    random = np.random.default_rng(case.digits)
    return [replace(p, start=p.start / (1 + p.spread * random.uniform(-1, 1))) for p in free]


def _signal(case: Case, selection: Selection) -> float:
    """How far the weakest hidden effect is above what 9 of 10 recordings would show: at least 1 for one that is [-]."""
    fit, signals = selection.ladder[0], []
    for score in (c.score for c in selection.rankings[0] if c.name in case.hidden):
        truth = np.array([case.hidden[score.effect][p.name.split(".", 1)[1]] / p.scale for p in score.free])
        seen = np.sqrt(truth @ score.information @ truth) / fit.record.noise
        threshold = np.sqrt(EVIDENCE + len(truth) * np.log(independent_samples(fit))) + POWER
        signals.append(0.0 if score.absorbed else float(seen / threshold))
    return min(signals, default=0.0)


def _accuracy(case: Case, selection: Selection, base: Model) -> dict[str, Any]:
    """Errors of the estimates, and how many 95 % intervals hold the truth (of the right model only)."""
    first, last = selection.ladder[0], selection.fit
    worst = {
        f"worst_error_{label}_pct": max(abs(fit.parameters[p] / base.defaults[p] - 1) * 100 for p in first.parameters)
        for label, fit in (("base", first), ("final", last))
    }
    if set(selection.effects) != set(case.hidden):
        return {**worst, "intervals": 0, "covered": 0}
    truth = {f"{e}.{p}": v for e, ps in case.hidden.items() for p, v in ps.items()}
    errors = last.standard_errors()
    inside = [
        abs(value - truth.get(name, base.defaults.get(name, 0.0))) <= 1.96 * errors[name]
        for name, value in last.parameters.items()
    ]
    return {**worst, "intervals": len(inside), "covered": sum(inside)}


def confusion_matrix(rows: pd.DataFrame) -> pd.DataFrame:
    """How often each hidden effect (rows) was answered in each way (columns), of the cases above what is detectable."""
    shown = rows[(rows["signal"] >= 1) | (rows["hidden"] == "none")]
    answer = shown["found"].where(shown["found"] != "", shown["verdict"])
    return pd.crosstab(shown["hidden"], answer)


def summarize(rows: pd.DataFrame) -> dict[str, Any]:
    """Rates of right and wrong answers, errors, intervals and times; rates in percent.

    Counted as right: every hidden effect named, or in a class of at most two. Only effects above their own smallest
    detectable value count.
    """
    single = rows[~rows["hidden"].str.contains("+", regex=False) & (rows["hidden"] != "none")]
    shown = single[single["signal"] >= 1]
    hits = shown[shown["hit"]]
    clean = rows[rows["hidden"] == "none"]
    aliases = single.groupby("hidden").filter(lambda group: (group["signal"] == 0).all())
    reported = [name in by.split() for name, by in zip(aliases["hidden"], aliases["absorbed"], strict=True)]
    pairs = rows[rows["hidden"].str.contains("+", regex=False) & (rows["signal"] >= 1)]
    by_noise = {
        str(noise): {
            "shown": len(group),
            "hit_pct": 100 * group["hit"].mean(),
            "wrong_name_pct": 100 * group["wrong_name"].mean(),
            "worst_error_median_pct": group.loc[group["hit"], "worst_error_final_pct"].median(),
            "worst_error_at_most_1_pct": 100 * (group.loc[group["hit"], "worst_error_final_pct"] <= 1).mean(),
            "worst_error_95_pct": group.loc[group["hit"], "worst_error_final_pct"].quantile(0.95),
            "worst_error_base_median_pct": group.loc[group["hit"], "worst_error_base_pct"].median(),
        }
        for noise, group in shown.groupby("noise_deg")
    }
    return {
        "cases": len(rows),
        "by_noise": by_noise,
        "wrong_name_pct": 100 * shown["wrong_name"].mean(),
        "wrong_name_below_detectable_pct": 100 * single.loc[single["signal"] < 1, "wrong_name"].mean(),
        "false_alarms": int((clean["verdict"] != "adequate").sum()),
        "clean": len(clean),
        "aliases": sorted(aliases["hidden"].unique()),
        "aliases_reported_pct": 100 * float(np.mean(reported)) if reported else None,
        "pairs_hit_pct": 100 * pairs["hit"].mean(),
        "pairs": len(pairs),
        "rmse_over_noise_max": hits["rmse_over_noise"].max(),
        "heldout_falls_pct": 100 * (hits["heldout_deg"] < hits["heldout_base_deg"]).mean(),
        "interval_coverage_pct": 100 * rows["covered"].sum() / max(int(rows["intervals"].sum()), 1),
        "seconds_mean": rows["seconds"].mean(),
        "seconds_total": rows["seconds"].sum(),
    }
