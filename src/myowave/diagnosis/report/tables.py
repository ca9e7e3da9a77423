"""A diagnosis as tables: plain data, from which pictures and pages are drawn."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from myowave.diagnosis.report.facts import parameters_of
from myowave.diagnosis.report.numbers import estimate
from myowave.diagnosis.report.templates import templates, with_unit
from myowave.diagnosis.search.diagnose import Diagnosis, Rung
from myowave.diagnosis.search.draft import LARGEST
from myowave.diagnosis.search.ladder import Candidate
from myowave.diagnosis.search.score import confusion

CONFUSED = 0.8  # one effect imitates at least this much of another


def ranking_table(diagnosis: Diagnosis) -> pd.DataFrame:
    """Every candidate at every rung: refitted error, log odds, value, what it may be confused with."""
    ladder = diagnosis.verdict.ladder
    rows = [(fit, c, ranking) for fit, ranking in zip(ladder.fits, ladder.rankings, strict=True) for c in ranking]
    return pd.DataFrame(
        {
            "model": [fit.model.name for fit, _, _ in rows],
            "effect": [c.name for _, c, _ in rows],
            "status": [c.status for _, c, _ in rows],
            "rmse_deg": [None if c.with_it is None else np.degrees(c.with_it.fit.rmse()) for _, c, _ in rows],
            "log_odds": [c.log_odds for _, c, _ in rows],
            "estimate": [_estimates(c) for _, c, _ in rows],
            "smallest_detectable": [c.detectable for _, c, _ in rows],
            "unit": [next(iter(c.effect.parameters.values())).unit for _, c, _ in rows],  # of that
            "absorbed_by": [" ".join(c.score.absorbed_by) if c.score.absorbed else "" for _, c, _ in rows],
            "confused_with": [" ".join(_confused_with(c, ranking)) for _, c, ranking in rows],
            "reason": [c.score.failure for _, c, _ in rows],
        }
    )


def _confused_with(candidate: Candidate, ranking: Sequence[Candidate]) -> list[str]:
    """The effects that imitate a candidate best, if they do."""
    scores = {c.name: c.score for c in ranking if not c.score.failure and not c.score.absorbed}
    if candidate.name not in scores:
        return []
    shares = {name: confusion(scores, candidate.name, name) for name in scores if name != candidate.name}
    return sorted((name for name in shares if shares[name] > CONFUSED), key=lambda name: -shares[name])[:3]


def ladder_table(diagnosis: Diagnosis) -> pd.DataFrame:
    """A row for each model: errors, R2 as the mean over trials, and what is left. `named` are those that the search did
    not visit."""
    named = {rung.name for rung in diagnosis.named}
    r2: Mapping[Any, float] = {}
    if diagnosis.test.horizon_s is None:  # pieces start at measured states spread over all of the motion
        r2 = errors_by_trial(diagnosis).groupby(["model", "role"])["r2"].mean().to_dict()
    return pd.DataFrame(
        {
            "model": rung.name,
            "effects": len(rung.fit.model.effects),
            "named": rung.name in named,
            "train_rmse_deg": np.degrees(rung.seen.rmse),
            "heldout_rmse_deg": np.degrees(rung.heldout.rmse),
            "noise_deg": diagnosis.noise_deg,
            "train_r2": r2.get((rung.name, "train"), np.nan),
            "heldout_r2": r2.get((rung.name, "test"), np.nan),
            "missing_torque_Nm": rung.missing.rms,
            "converged": rung.fit.converged,
        }
        for rung in diagnosis.tried
    )


def parameters_table(diagnosis: Diagnosis) -> pd.DataFrame:
    """Every estimated parameter of every model, see `facts.parameters_of`."""
    return pd.DataFrame(
        {"model": rung.name, "parameter": name, **entry}
        for rung in diagnosis.tried
        for name, entry in parameters_of(rung.fit, rung.estimate).items()
    )


def errors_by_trial(diagnosis: Diagnosis) -> pd.DataFrame:
    """RMSE and R2 of every model on every trial; no `horizon_s` where these are whole trials."""
    motion = predictions_table(diagnosis)
    motion["square"] = np.degrees(motion["angle_rad"] - motion["predicted_rad"]) ** 2
    trials = motion.groupby(["model", "trial", "role"], sort=False)
    mse, variance = trials["square"].mean(), np.degrees(trials["angle_rad"].std(ddof=0)) ** 2
    errors = pd.DataFrame({"rmse_deg": np.sqrt(mse), "r2": 1 - mse / variance}).reset_index()
    return errors.assign(noise_deg=diagnosis.noise_deg, horizon_s=diagnosis.test.horizon_s)


def predictions_table(diagnosis: Diagnosis) -> pd.DataFrame:
    """Measured and simulated angle of every trial and model; each `piece` starts at a measured state."""
    tables = []
    for rung in diagnosis.tried:
        parts = (("train", rung.fit.record, rung.seen.residual), ("test", diagnosis.test, rung.heldout.residual))
        for role, record, residual in parts:
            left = record.joined(residual)
            piece = record.joined(np.broadcast_to(np.arange(len(residual))[:, None], residual.shape))
            for trial, measured in record.joined(record.angle).items():
                motion = {"time_s": np.arange(len(measured)) * record.dt, "angle_rad": measured}
                motion |= {"predicted_rad": measured - left[trial], "piece": piece[trial]}
                tables.append(pd.DataFrame({"model": rung.name, "trial": trial, "role": role, **motion}))
    return pd.concat(tables, ignore_index=True)


def _of_each(part: Callable[[Rung], pd.DataFrame], diagnosis: Diagnosis) -> pd.DataFrame:
    return pd.concat([part(rung).assign(model=rung.name) for rung in diagnosis.tried], ignore_index=True)


def draft_source(diagnosis: Diagnosis) -> str:
    """A formula for what is missing as a complete effect file, for `physics.effect_files`."""
    about = {"draft": diagnosis.draft, "dataset": diagnosis.dataset, "largest": LARGEST}
    return templates().get_template("draft_effect.py.j2").render(about)


def _estimates(candidate: Candidate) -> str:
    """Values, standard errors and units of the effect's parameters, to first order where it was not fitted."""
    if candidate.score.failure:
        return ""
    pairs = zip(candidate.score.free, candidate.score.estimate, strict=True)
    first_order = {p.name: (float(e) * p.scale, None) for p, e in pairs}
    found = first_order if candidate.with_it is None else candidate.with_it.averaged
    units = candidate.score.start.model.effect_parameters
    return ", ".join(
        f"{p.name.split('.', 1)[1]} = {estimate(*found[p.name])}{with_unit(units[p.name].unit)}"
        for p in candidate.score.free
    )


# The CSV files of a diagnosis, by the names in `contents.TABLE_NAMES`.
TABLES: Mapping[str, Callable[[Diagnosis], pd.DataFrame]] = {
    "ladder": ladder_table,
    "ranking": ranking_table,
    "parameters": parameters_table,
    "errors": errors_by_trial,
    "misfit": partial(_of_each, lambda rung: rung.misfit),  # RMSE in parts of the data
    "missing_torque": partial(_of_each, lambda rung: rung.missing.points),  # in each window
}
