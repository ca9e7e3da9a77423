"""What is said of a diagnosis, from the facts in verdict.json and nothing else: the sentences stand in
workflow/report/sentences.j2, and `tell` fills them for the page, the index, the terminal and MLflow."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from myowave.diagnosis.causes import CAUSE_TITLES
from myowave.diagnosis.comparison.baselines import HORIZON_BASELINES, POSTURE, POSTURE_LOAD
from myowave.diagnosis.report.ladder import ERROR, PLAIN, baseline_of, shown_network
from myowave.diagnosis.report.numbers import degrees, r2_text
from myowave.diagnosis.report.templates import PAGES, paragraphs, templates_in
from myowave.diagnosis.report.words import BASE

Verdict = Mapping[str, Any]

QUIET = 1.1  # an adequate model that leaves no more than so many times the noise has nothing to locate
AS_GOOD = 0.02  # difference of R2 that is none
# ASSUME: errors of held-out trials scatter, as parameters are estimated; three times what is left on training trials,
# and what noise would leave, is more than that.
DISAGREES = 3.0


def tell(verdict: Verdict, folder: Path = PAGES) -> dict[str, Any]:
    """All that is said of a verdict, by the names that sentences.j2 sets: `headline`, `lead`, `todo`, `plan`, ...

    Args:
        verdict: verdict.json.
        folder: of the templates.

    Returns:
        Texts, empty where there is nothing to say, with an empty line between paragraphs; `session` is a list of trials
        to record, each what to do, load and seconds.
    """
    base, errors = base_of(verdict)
    rmse = verdict["horizons"]["rmse_deg"]
    rivals = [name for name in HORIZON_BASELINES if name in rmse]
    likely = verdict["probabilities"]

    def title(name: str) -> str:
        return CAUSE_TITLES.get(name) or verdict["titles"].get(name) or name

    variables = {
        "v": verdict,
        "base": base,
        "base_text": BASE,
        "errors": errors,  # of the base model
        "added": added(verdict),
        "named": " and ".join(" or ".join(map(title, members)) for members in classes_of(verdict)),
        "title": title,
        "likeliest": title(max(likely, key=lambda name: likely[name])) if likely else "an effect",
        "noise": noise(verdict),
        "noise_with_emg": noise_with_emg(verdict),
        "rival": min(rivals, key=lambda name: rmse[name], default=""),
        "as_good": AS_GOOD,
        "quiet": is_quiet(verdict),
        "unexplained": leaves_more(verdict),
        "disagrees": disagrees(verdict),
        "needs_others": needs_others(verdict),
    }
    told = templates_in(folder).get_template("sentences.j2").make_module(variables)
    parts = {name: part for name, part in vars(told).items() if not name.startswith("_")}
    return {name: "\n\n".join(paragraphs(part)) if isinstance(part, str) else part for name, part in parts.items()}


def base_of(verdict: Verdict) -> tuple[str, Mapping[str, float]]:
    """The model without effects, and its errors [deg]."""
    return next(iter(verdict["rmse_deg"].items()))


def added(verdict: Verdict) -> list[str]:
    """The named effects that the model has which was found: noise of the EMG is a cause, and no part of a model."""
    return [effect for effect in verdict["effects"] if effect in verdict["model"].split("+")]


def classes_of(verdict: Verdict) -> list[list[str]]:
    """What is missing, or comes nearest to it: for each cause those that may be it."""
    classes = {members[0]: members for members in verdict["alternatives"]}
    causes = verdict["effects"] or verdict["nearest"]
    like = {name: ["something like it"] * (name in verdict["stand_ins"]) for name in causes}
    return [[*classes.get(name, [name]), *like[name]] for name in causes]


def noise(verdict: Verdict) -> str:
    """The noise of the measured angle, said to be a bound where it is one."""
    return f"{'at most ' * bool(verdict['noise_is_bound'])}{degrees(base_of(verdict)[1]['noise'])}"


def noise_with_emg(verdict: Verdict) -> float:
    """What noise of the angle and of the EMG make together [deg]."""
    return math.hypot(base_of(verdict)[1]["noise"], verdict["emg_motion_deg"])


def leaves_more(verdict: Verdict) -> bool:
    """Whether something is left that no effect explains, so that a drafted effect is news."""
    return verdict["follows"] and verdict["verdict"] in ("partial", "unknown")


def is_quiet(verdict: Verdict) -> bool:
    """Whether there is nothing to locate: no effect shows, and no more than noise is left."""
    errors = base_of(verdict)[1]
    return verdict["verdict"] in ("adequate", "undecidable") and errors["fitted"] <= QUIET * errors["noise"]


def disagrees(verdict: Verdict) -> bool:
    """Whether held-out trials are missed by far more than the training trials and their noise."""
    errors = verdict["rmse_deg"][verdict["model"]]
    return errors["heldout"] > DISAGREES * max(errors["train"], errors["noise"])


def needs_others(verdict: Verdict) -> bool:
    """Whether the trials say too little of the muscles, so that others should be recorded: posture and speed, with the
    load where it is known, explain the torque as well as EMG and muscles do, or the model does not follow."""
    r2, found = verdict["torque"]["r2"], verdict["model"]
    if not verdict["follows"] or r2[POSTURE] is None or r2[found] is None:
        return not verdict["follows"]
    return not r2[found] > r2[POSTURE] + AS_GOOD or r2[found] < r2.get(POSTURE_LOAD, -math.inf) - AS_GOOD


def tell_network(ladder: pd.DataFrame, found: str) -> str:
    """How well the network that is shown predicts the held-out trials, and what predicts them without physics.

    Args:
        ladder: of `ladder.join_ladder`.
        found: the model that was found.
    """
    network, plain = shown_network(ladder, found), ladder[ladder["source"].str.startswith(PLAIN)]
    if network is None:
        return ""
    text = "The network does not follow the held-out trials."
    if network["heldout_r2"] > 0:
        error, r2 = degrees(network[ERROR]), r2_text(network["heldout_r2"])
        text = f"The network, fed by its own predictions over whole held-out trials, misses by {error} (R2 {r2})."
    if plain[ERROR].notna().any():
        best = plain.loc[plain[ERROR].idxmin()]
        name, error = baseline_of(best["source"]), degrees(best[ERROR])
        text += f" The best predictor without physics, {name}, misses by {error}."
    return text
