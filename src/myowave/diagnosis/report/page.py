"""A diagnosis as one page that needs nothing else: compare, where, which, add, watch.

The page is made of verdict.json, the tables and the pictures; the template stands with the workflow's captions.
"""

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import pandas as pd

from myowave.diagnosis.rooms.telling import tell_horizons, tell_torque

KINDS = {
    "adequate": "The model is adequate",
    "effect": "An effect is missing, and named",
    "class": "An effect is missing; these data leave a choice",
    "partial": "An effect is missing, and named; something else is missing, too",
    "unknown": "Something is missing that the catalogue does not hold",
    "undecidable": "These data cannot decide",
}
RANKING_COLUMNS = {
    "effect": "effect",
    "status": "status",
    "delta_bic": "delta BIC",
    "rmse_deg": "RMSE [deg]",
    "score": "score [chi-square]",
    "folds": "folds won",
    "estimate": "estimate",
    "visible_share": "visible share",
    "smallest_detectable": "smallest detectable",
    "confused_with": "like",
    "reason": "why not",
}


@dataclass(frozen=True)
class Story:
    """What a page is made of.

    Args:
        verdict: verdict.json.
        ladder, parameters: of `ladder.join_ladder` and `ladder.join_parameters`.
        ranking, proposals: the tables of those names of `tables`.
        torque, horizons: of `rooms.compare.compare_rooms`.
        images: {name: PNG file}.
        draft: text of the drafted effect file.
    """

    verdict: Mapping[str, Any]
    ladder: pd.DataFrame
    parameters: pd.DataFrame
    ranking: pd.DataFrame
    proposals: pd.DataFrame
    torque: pd.DataFrame
    horizons: pd.DataFrame
    images: Mapping[str, Path]
    draft: str


def write_page(story: Story, template: str) -> str:
    """The page as HTML, pictures inside.

    Args:
        template: Jinja template; every text that comes from data is escaped.
    """
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True)
    verdict = story.verdict
    news = verdict["verdict"] == "unknown"
    proposed = verdict["next_trial"]
    return environment.from_string(template).render(
        dataset=verdict["dataset"],
        headline=verdict["sentence"].split(" Not decidable with these data")[0],
        strength=_strength(story),
        numbers=_numbers(story),
        images={name: inline(path) for name, path in story.images.items()},
        compare=_compare(verdict),
        rooms=(tell_torque(story.torque, verdict["model"]), tell_horizons(story.horizons, verdict["model"])),
        where=verdict["where"],
        which=_which(story),
        rankings=[(m, _ranking_rows(rows)) for m, rows in story.ranking.groupby("model", sort=False)],
        ranking_columns=list(RANKING_COLUMNS.values()),
        absorbed=[(name, ", ".join(by)) for name, by in verdict["absorbed"].items()],
        next_trial=proposed
        and f"{proposed['trial']}. It would tell {proposed['question']} "
        f"(expected chi-square {proposed['separation']:.3g}, now {proposed['now']:.3g}).",
        proposals=[
            (p.trial, f"{p.separation:.3g}", f"{p.now:.3g}", "yes" if p.separates else "no")
            for p in story.proposals.itertuples()
        ],
        add=_add(verdict),
        command=verdict["command"] if verdict["effects"] else "",
        keep=_keep(verdict),
        draft=story.draft if verdict["formula"] != "0" else "",
        draft_is_news=news,
        ladder_columns=[
            "model",
            "what",
            "training RMSE [deg]",
            "held-out RMSE [deg]",
            "noise [deg]",
            "held-out R2",
            "missing torque [N m]",
        ],
        ladder=[
            (
                r.model,
                r.source,
                _number(r.train_rmse_deg),
                _number(r.heldout_rmse_deg),
                _number(r.noise_deg),
                "" if pd.isna(r.heldout_r2) else f"{r.heldout_r2:.5f}",
                _number(r.missing_torque_Nm),
            )
            for r in story.ladder.itertuples()
        ],
        parameter_columns=["parameter", "model", "what", "value", "± SE", "unit", "true error [%]"],
        parameters=[
            (r.parameter, r.model, r.source, f"{r.value:.5g}", _number(r.se), r.unit, _number(r.error_pct) or "unknown")
            for r in story.parameters.itertuples()
        ],
        score=_score(verdict),
    )


def inline(path: Path) -> str:
    """A PNG file as a data URL."""
    return "data:image/png;base64," + base64.b64encode(Path(path).read_bytes()).decode()


def _number(value: float) -> str:
    return "" if value is None or pd.isna(value) else f"{value:.3g}"


def _strength(story: Story) -> str:
    """How strong the verdict is, in numbers."""
    verdict = story.verdict
    if not verdict["follows"]:
        return tell_torque(story.torque, verdict["model"])
    texts = [KINDS[verdict["verdict"]] + "."]
    ladder = list(dict.fromkeys(story.ranking["model"]))
    for model, rows in story.ranking.groupby("model", sort=False):
        added = _added_to(model, ladder)
        found = rows[rows["effect"] == added]
        if len(found):
            row = found.iloc[0]
            texts.append(
                f"{added}: delta BIC {row['delta_bic']:.0f} where 10 is very strong evidence, better in "
                f"{row['folds_won']} of {row['folds']} trials left out, {_estimates(verdict, added)}."
            )
    return " ".join(texts)


def _estimates(verdict: Mapping[str, Any], effect: str) -> str:
    """The parameters of an effect in the model that was found, with their standard errors."""
    found = verdict["parameters"][verdict["model"]]
    mine = {name.removeprefix(f"{effect}."): p for name, p in found.items() if name.startswith(f"{effect}.")}
    return ", ".join(f"{name} = {p['value']:.4g} ± {p['se']:.2g}" for name, p in mine.items())


def _added_to(model: str, ladder: list[str]) -> str:
    """The effect that the model after this one on the ladder adds; empty for the last."""
    place = ladder.index(model)
    return ladder[place + 1].removeprefix(model).strip("+") if place + 1 < len(ladder) else ""


def _numbers(story: Story) -> list[tuple[str, str]]:
    errors, found = story.verdict["rmse_deg"], story.verdict["model"]
    model, first = next(iter(errors.items()))
    horizon = story.verdict["horizon_s"]
    over = "" if horizon is None else f", over all of the {horizon:g} s after measured states"
    numbers = [(f"held-out RMSE of {model}{over}", f"{first['heldout']:.3g} deg")]
    if found != model:
        numbers.append(("held-out RMSE with what was found", f"{errors[found]['heldout']:.3g} deg"))
    return [*numbers, ("noise of the measured angle", f"{first['noise']:.2g} deg")]


def _compare(verdict: Mapping[str, Any]) -> str:
    model, errors = next(iter(verdict["rmse_deg"].items()))
    ratio = errors["train"] / errors["noise"]
    return _reach(verdict) + (
        f"Fitted to the training trials, the model {model} leaves {errors['train']:.3g} deg there and "
        f"{errors['heldout']:.3g} deg on trials it has not seen. The noise of the measured angle is "
        f"{errors['noise']:.2g} deg, so on the training trials it leaves {ratio:.3g} times the noise."
    )


def _reach(verdict: Mapping[str, Any]) -> str:
    """What the fits stand on where it is not whole trials, and models that could not be fitted."""
    horizon, text = verdict["horizon_s"], ""
    if horizon is not None:
        text += (
            f"Running free over whole trials the model diverges; all below is about predictions over {horizon:g} s, "
            "each from a start of its own, on held-out trials from the measured state. "
        )
    return text + "".join(f"The model {name} could not be fitted: {why} " for name, why in verdict["failed"].items())


def _which(story: Story) -> str:
    verdict = story.verdict
    count = story.ranking[story.ranking["model"] == story.ranking["model"].iloc[0]]["effect"].nunique()
    if not verdict["follows"]:
        return f"{count} effects were scored and none was fitted: the model is too far from the motion to say which."
    text = f"Each of {count} effects was scored against what the model leaves; the promising ones were fitted. "
    if verdict["verdict"] == "unknown":
        near = f" The nearest are {', '.join(verdict['nearest'])}." if verdict["nearest"] else ""
        return text + f"None explains it.{near} As a formula, the missing torque is {verdict['formula']} N m."
    if not verdict["effects"]:
        return text + "No effect is supported by the data."
    classes = [" or ".join(c) for c in verdict["alternatives"]]
    text += f"The evidence asks for {', then '.join(verdict['effects'])}."
    return text + (f" Not told apart: {'; '.join(classes)}." if classes else "")


def _add(verdict: Mapping[str, Any]) -> str:
    if not verdict["follows"]:
        return "Nothing, before the model follows the motion: look at its constants, the EMG, the load and the clocks."
    if verdict["verdict"] == "unknown":
        return (
            "Look at the draft below, give it a physical meaning, list the file in physics.effect_files and run "
            "snakemake again: it then takes part like any other effect."
        )
    if not verdict["effects"]:
        return "There is nothing to add."
    return (
        "Typed in the project's folder with its environment active (. .venv/bin/activate), this trains the network "
        "with the model that was found, and shows it below beside what is there. Nothing is overwritten: a model is a "
        "coordinate."
    )


def _keep(verdict: Mapping[str, Any]) -> str:
    """Settings with which plain `snakemake` makes what was found too; empty where there is nothing to add."""
    if not verdict["effects"]:
        return ""
    base = next(iter(verdict["rmse_deg"]))
    return f"targets: {{models: {{{verdict['dataset']}: [{base}, {verdict['model']}]}}}}"


def _score(verdict: Mapping[str, Any]) -> str:
    """What scoring knows where the trials were simulated."""
    if verdict.get("hidden") is None:
        return ""
    truth = "These trials are simulated, so the truth is known: "
    if not verdict["hidden"]:
        return f"{truth}nothing was hidden in them, and {'nothing' if verdict['hit'] else 'something'} was reported."
    return f"{truth}{', '.join(verdict['hidden'])} was hidden in them, and was {'' if verdict['hit'] else 'not '}found."


def _ranking_rows(rows: pd.DataFrame) -> list[list[str]]:
    """The catalogue at one model, as text, in the order of `RANKING_COLUMNS`."""
    shown = rows.assign(
        folds=[f"{won} of {folds}" for won, folds in zip(rows["folds_won"], rows["folds"], strict=True)],
        confused_with=[
            f"absorbed by {by}" if by else like
            for by, like in zip(rows["absorbed_by"], rows["confused_with"], strict=True)
        ],
    )[list(RANKING_COLUMNS)]
    cells = shown.itertuples(index=False)
    return [[v.replace("+-", "±") if isinstance(v, str) else _number(v) for v in row] for row in cells]
