"""What is said of a diagnosis, from the facts in verdict.json and nothing else: the sentences stand in
workflow/report/sentences.j2, and `tell` fills them for the page, the index, the terminal and MLflow."""

import math
import shlex
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import pandas as pd

from myowave.diagnosis.causes import CAUSE_TITLES, LEFT, OUTSIDE
from myowave.diagnosis.comparison.baselines import HORIZON_BASELINES, POSTURE, POSTURE_LOAD
from myowave.diagnosis.report.ladder import ERROR, PLAIN, baseline_of, shown_network
from myowave.diagnosis.report.numbers import degrees
from myowave.diagnosis.report.templates import called, described, listed, paragraphs, templates
from myowave.diagnosis.scoring import answer

Verdict = Mapping[str, Any]

QUIET = 1.1  # an adequate model that leaves no more than so many times the noise has nothing to locate
AS_GOOD = 0.02  # difference of R2 that is none
# ASSUME: errors of held-out trials scatter, as parameters are estimated; three times what is left on training trials,
# and what noise would leave, is more than that.
DISAGREES = 3.0


def tell(verdict: Verdict, ladder: pd.DataFrame | None = None) -> dict[str, Any]:
    """All that is said of a verdict, by the names that sentences.j2 sets: `headline`, `lead`, `todo`, `plan`, ...

    Args:
        verdict: verdict.json.
        ladder: of `ladder.join_ladder`, where what networks and predictors without physics are worth is to be told.

    Returns:
        Texts, empty where there is nothing to say, with an empty line between paragraphs; `session` is a list of trials
        to record, each what to do, load and seconds.
    """
    base, errors = base_of(verdict)
    likely = verdict["probabilities"]
    of_plain = pd.DataFrame() if ladder is None else ladder[ladder["source"].str.startswith(PLAIN)].dropna(subset=ERROR)
    named = answer(verdict["effects"] or verdict["nearest"], verdict["alternatives"])

    def title(name: str) -> str:
        return CAUSE_TITLES.get(name) or called(name, verdict["titles"])

    variables = {
        "v": verdict,
        "base": base,
        "errors": errors,  # of the base model
        # Noise of the EMG is a cause, and no part of a model.
        "added": [effect for effect in verdict["effects"] if effect in verdict["model"].split("+")],
        "named": listed(
            [" or ".join("something like it" if m == OUTSIDE else title(m) for m in c) for c in named],
            ", and " if any(len(c) > 1 for c in named) else " and ",
        ),
        "title": title,
        "model": partial(described, titles=verdict["titles"]),
        "likeliest": title(max(likely, key=lambda name: likely[name])) if likely else "an effect",
        "noise": noise(verdict),
        "noise_with_emg": noise_with_emg(verdict),
        "network": None if ladder is None else shown_network(ladder, verdict["model"]),
        "plain": None if of_plain.empty else of_plain.loc[of_plain[ERROR].idxmin()],
        "baseline_of": baseline_of,
        "rival": best_rival(verdict),
        "as_good": AS_GOOD,
        "quiet": is_quiet(verdict),
        "unexplained": leaves_more(verdict),
        "disagrees": disagrees(verdict),
        "needs_others": needs_others(verdict),
        "says_little": says_little(verdict),
        "outdone": is_outdone(verdict),
        "doubtful": is_doubtful(verdict),
    }
    told = templates().get_template("sentences.j2").make_module(variables)
    parts = {name: part for name, part in vars(told).items() if not name.startswith("_")}
    return {name: "\n\n".join(paragraphs(part)) if isinstance(part, str) else part for name, part in parts.items()}


def base_of(verdict: Verdict) -> tuple[str, Mapping[str, float]]:
    """The model without effects, and its errors [deg]."""
    return next(iter(verdict["rmse_deg"].items()))


def best_rival(verdict: Verdict) -> str:
    """The best predictor without a model of the arm over a short horizon; empty where there is none."""
    rmse = verdict["horizons"]["rmse_deg"]
    errors = {name: math.inf if rmse[name] is None else rmse[name] for name in HORIZON_BASELINES if name in rmse}
    return min(errors, key=lambda name: errors[name], default="")


def noise(verdict: Verdict) -> str:
    """The noise of the measured angle, said to be a bound where it is one."""
    return f"{'at most ' * bool(verdict['noise_is_bound'])}{degrees(base_of(verdict)[1]['noise'])}"


def noise_with_emg(verdict: Verdict) -> float:
    """What noise of the angle and of the EMG make together [deg]."""
    return math.hypot(base_of(verdict)[1]["noise"], verdict["emg_motion_deg"])


def leaves_more(verdict: Verdict) -> bool:
    """Whether something is left that no effect explains, so that a drafted effect is news."""
    return verdict["follows"] and verdict["verdict"] in LEFT


def is_quiet(verdict: Verdict) -> bool:
    """Whether there is nothing to locate: no effect shows, and no more than noise is left."""
    errors = base_of(verdict)[1]
    return verdict["verdict"] in ("adequate", "undecidable") and errors["fitted"] <= QUIET * errors["noise"]


def disagrees(verdict: Verdict) -> bool:
    """Whether held-out trials are missed by far more than the training trials and their noise."""
    errors = verdict["rmse_deg"][verdict["model"]]
    return errors["heldout"] > DISAGREES * max(errors["train"], errors["noise"])


def needs_others(verdict: Verdict) -> bool:
    """Whether other trials should be recorded: these say too little of the muscles, or the model does not follow."""
    return bool(verdict["electrodes"]) and (not verdict["follows"] or says_little(verdict))


def is_outdone(verdict: Verdict) -> bool:
    """Whether a constant, or posture and speed, explain the torque as well as EMG and muscles do."""
    r2, found = verdict["torque"]["r2"], verdict["model"]
    if r2[POSTURE] is None or r2[found] is None:
        return False
    return not r2[found] > max(r2[POSTURE], 0) + AS_GOOD


def is_doubtful(verdict: Verdict) -> bool:
    """Whether no verdict on the muscles can stand: they are outdone, and their model leaves more than noise. One that
    leaves noise alone of whole trials has shown more than torques do, from which noise of the angle takes most."""
    leaves = not verdict["follows"] or leaves_more(verdict)
    return bool(verdict["electrodes"]) and leaves and is_outdone(verdict)


def says_little(verdict: Verdict) -> bool:
    """Whether a constant, posture and speed, or these with the load where it is known, explain the torque as well as
    EMG and muscles do."""
    r2 = verdict["torque"]["r2"]
    explained = r2[verdict["model"]]
    with_load = explained is not None and explained < r2.get(POSTURE_LOAD, -math.inf) - AS_GOOD
    return is_outdone(verdict) or (r2[POSTURE] is not None and with_load)


def adding_command(verdict: Verdict, *, recipes: Sequence[str] = ("rollout",), config_files: Sequence[str] = ()) -> str:
    """The command that trains networks with the model that was found, then shows them beside those without it: two
    calls, as the page shows every network that is there when its call begins. None where there is no EMG.

    Args:
        config_files: what the run was given after --configfile, in order; none where it had only config.yaml.
    """
    if not verdict["electrodes"]:
        return ""
    dataset, model = verdict["dataset"], verdict["model"]
    trained = [f"results/figures/{dataset}/{model}/{recipe}/predictions.png" for recipe in recipes]
    page = f"results/diagnosis/{dataset}/verdict.html"
    # Targets come first: --configfile takes all words that follow it.
    settings = ["--configfile", *config_files] if config_files else []
    calls = (shlex.join(["snakemake", "--cores", "2", *targets, *settings]) for targets in (trained, [page]))
    return " && ".join(calls)
