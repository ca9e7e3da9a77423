"""A diagnosis as one page that needs nothing else: compare, where, which, add, watch.

The page is made of verdict.json, the tables and the pictures; the template stands with the workflow's captions.
"""

import base64
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from myowave.diagnosis.comparison.telling import tell_horizons, tell_torque
from myowave.diagnosis.report.cells import (
    LADDER_COLUMNS,
    ladder_rows,
    named,
    parameter_columns,
    parameter_rows,
    proposal_rows,
    ranking_table,
)
from myowave.diagnosis.report.evidence import added, estimates, evidence, only_beside_others, share_of_noise
from myowave.diagnosis.report.ladder import PHYSICS, tell_failed_seeds
from myowave.diagnosis.report.motion import list_motion
from myowave.diagnosis.report.pattern import tell_missing_torque
from myowave.diagnosis.report.templates import fill
from myowave.diagnosis.report.words import (
    BASE,
    GLOSSARY,
    degrees,
    kind_of,
    noise,
    tell,
    tell_masked,
    titled,
    two_digits,
)

PIXELS = 1.9  # of a picture in one of the page
UNDECIDABLE = "undecidable"
IF_RIGHT = 'Where it says "were it right" the model leaves more than noise: its SE holds only if the model were right.'
QUIET = 1.1  # an adequate model that leaves no more than so many times the noise has nothing to locate


@dataclass(frozen=True)
class Story:
    """What a page is made of.

    Args:
        verdict: verdict.json.
        ladder, parameters: of `ladder.join_ladder` and `ladder.join_parameters`.
        ranking, proposals, missing: the tables `ranking`, `next_trials` and `missing_torque` of `tables`.
        predictions: measured and simulated angle, of `tables.predictions_table`.
        torque, horizons: of `comparison.compare.compare_models`.
        images: {name: PNG file}; the page draws the overlay itself.
        draft: text of the drafted effect file.
    """

    verdict: Mapping[str, Any]
    ladder: pd.DataFrame
    parameters: pd.DataFrame
    ranking: pd.DataFrame
    proposals: pd.DataFrame
    missing: pd.DataFrame
    predictions: pd.DataFrame
    torque: pd.DataFrame
    horizons: pd.DataFrame
    images: Mapping[str, Path]
    draft: str


def write_page(story: Story, template: Path) -> str:
    """The page as HTML, pictures, styles and scripts inside.

    Args:
        template: verdict.html.j2; every text that comes from data is escaped.
    """
    verdict, titles = story.verdict, story.verdict["titles"]
    proposed = verdict["next_trial"]
    free = story.parameters["assumed"].astype(bool)
    named_ones, assumed = story.parameters[~free], story.parameters[free]
    content = {
        "dataset": verdict["dataset"],
        "tell": partial(tell, titles=titles),
        "titled": partial(titled, titles=titles),
        "named": named,
        "glossary": GLOSSARY,
        "headline": _headline(story),
        "base": f"Here {_base(verdict)[0]} is the model to start from: {BASE}.",
        "strength": _strength(story),
        "numbers": _numbers(story),
        "images": {name: inline(path) for name, path in story.images.items() if name != "overlay"},
        "widths": {name: shown_width(path) for name, path in story.images.items()},
        "motion": list_motion(story.predictions, verdict["model"], _base(verdict)[1]["noise"]),
        "restart": f"Every {verdict['horizon_s']:g} s the prediction starts again at the measured state."
        if verdict["horizon_s"] is not None
        else "",
        "quiet": _quiet(verdict),
        "weighed": verdict["follows"] and not _quiet(verdict),
        "compare": _compare(verdict),
        "comparison": (tell_torque(story.torque, verdict["model"]), tell_horizons(story.horizons, verdict["model"])),
        "where": _where(verdict),
        "missing": _missing(story),
        "which": _which(story),
        "rankings": [(m, *ranking_table(rows, titles)) for m, rows in story.ranking.groupby("model", sort=False)],
        "absorbed": [(name, ", ".join(by) or "parameters together") for name, by in verdict["absorbed"].items()]
        if verdict["follows"]
        else [],
        "next_trial": proposed
        and f"{proposed['trial']}. It would tell {proposed['question']} "
        f"(expected chi-square {proposed['separation']:.3g}, now {proposed['now']:.3g}).",
        "proposals": proposal_rows(story.proposals),
        "add": _add(verdict),
        "command": verdict["command"] if added(verdict) else "",
        "keep": _keep(verdict),
        "draft": story.draft if verdict["formula"] != "0" else "",
        "draft_is_news": kind_of(verdict).unexplained,
        "ladder_columns": LADDER_COLUMNS,
        "ladder": ladder_rows(story.ladder),
        "ladder_caption": _ladder_caption(verdict),
        "failed_seeds": tell_failed_seeds(story.ladder),
        "parameter_columns": parameter_columns(named_ones),
        "parameters": parameter_rows(named_ones),
        "parameter_caption": IF_RIGHT if named_ones["if_right"].any() else "",
        "assumed_columns": parameter_columns(assumed),
        "assumed": parameter_rows(assumed),
        "score": _score(verdict),
    }
    return fill(template, content)


def inline(path: Path) -> str:
    """A PNG file as a data URL."""
    return "data:image/png;base64," + base64.b64encode(Path(path).read_bytes()).decode()


def shown_width(path: Path) -> int:
    """Width of a picture on the page [px], so that letters are as large in all of them; from the header of the PNG."""
    return round(int.from_bytes(Path(path).read_bytes()[16:20]) / PIXELS)


def _base(verdict: Mapping[str, Any]) -> tuple[str, Mapping[str, float]]:
    """The model without effects, and its errors [deg]."""
    model, errors = next(iter(verdict["rmse_deg"].items()))
    return model, errors


def _quiet(verdict: Mapping[str, Any]) -> bool:
    """Whether there is nothing to locate: no effect shows in the motion, and no more than the noise is left."""
    errors = _base(verdict)[1]
    return bool(verdict["verdict"] in ("adequate", UNDECIDABLE) and errors["fitted"] <= QUIET * errors["noise"])


def _headline(story: Story) -> str:
    """The answer in a sentence or two: where the model does not follow, first how far physics explains the torque."""
    sentence = str(story.verdict["sentence"])
    for told_below in (" Not decidable with these data", " As a formula:"):
        sentence = sentence.split(told_below)[0]
    if story.verdict["follows"]:
        return sentence
    return f"{tell_torque(story.torque, story.verdict['model']).split('. ')[0].rstrip('.')}. {sentence}"


def _strength(story: Story) -> list[str]:
    """How strong the verdict is, in numbers, a paragraph for each effect."""
    verdict = story.verdict
    if not verdict["follows"]:
        first, _, rest = tell_torque(story.torque, verdict["model"]).partition(". ")
        return [text for text in (rest, _stands_on(verdict)) if text]
    # Where more is left, no rounding makes it nothing.
    rest = f"goes with {verdict['rest']}" if verdict["rest"] else "has no name"
    sentence = kind_of(verdict).sentence.format(explained=min(verdict["explained"], 0.99), rest=rest)
    texts = [] if sentence.rstrip(".") in verdict["sentence"] else [sentence + share_of_noise(verdict)]
    return texts + [
        f"{effect}: {evidence(verdict, story.ranking, effect)}; {estimates(verdict, story.parameters, effect)}."
        for effect in added(verdict)
    ]


def _stands_on(verdict: Mapping[str, Any]) -> str:
    """Where the parameters of a model come from that does not follow."""
    if verdict["stands_on"] != "torque":
        return f"Its parameters are those of a fit over {verdict['stands_on']}, and hold for no longer."
    left_out = verdict["torque_left_out"].values()
    scores = (
        f" Each training trial left out in turn: R2 {min(left_out):.2f} to {max(left_out):.2f}."
        if left_out
        else " No training trial could be left out, so nothing says how far they hang on the trials."
    )
    return f"Its parameters are fitted to torque along the measured motion, the last stage that stands.{scores}"


def _numbers(story: Story) -> list[tuple[str, str]]:
    errors, found = story.verdict["rmse_deg"], story.verdict["model"]
    model, first = _base(story.verdict)
    horizon = story.verdict["horizon_s"]
    over = "" if horizon is None else f", over all of the {horizon:g} s after measured states"
    numbers = [(f"held-out RMSE of {model}{over}", degrees(first["heldout"]))]
    if found != model:
        numbers.append(("held-out RMSE with what was found", degrees(errors[found]["heldout"])))
    numbers.append(("noise of the measured angle", noise(story.verdict)))
    if story.verdict["emg_noise"]:
        numbers.append(("moved by noise of the recorded EMG", degrees(story.verdict["emg_motion_deg"])))
    return numbers


def _compare(verdict: Mapping[str, Any]) -> str:
    model, errors = _base(verdict)
    more = "more than " if verdict["noise_is_bound"] else ""
    times = f"{more}{two_digits(errors['fitted'] / errors['noise'])} times the noise"
    if verdict["horizon_s"] is None:
        text = _reach(verdict) + (
            f"Fitted to the training trials, the model {model} leaves {degrees(errors['train'])} there and "
            f"{degrees(errors['heldout'])} on held-out trials."
        )
        return text if _quiet(verdict) else f"{text} On the training trials that is {times}."
    return _reach(verdict) + (
        f"So predicted, the model {model} misses by {degrees(errors['train'])} on training trials and by "
        f"{degrees(errors['heldout'])} on held-out trials. Given the best start of each piece instead, as the fit "
        f"takes it, it leaves {degrees(errors['fitted'])} on the training trials, {times}."
    )


def _ladder_caption(verdict: Mapping[str, Any]) -> str:
    text = f"The noise of the measured angle is {noise(verdict)}."
    if verdict["horizon_s"] is not None:
        text += (
            f" Errors of the physical model are over the {verdict['horizon_s']:g} s after measured states; a network's "
            "are over whole trials, running free."
        )
    return text


def _where(verdict: Mapping[str, Any]) -> str:
    """Where the misfit is; said once where it is no more than the noise."""
    if _quiet(verdict):
        return f"What the model leaves is no more than the noise of the angle, {noise(verdict)}: nothing to locate."
    pieces = " These are errors of the fit, with the best start of each piece." * (verdict["horizon_s"] is not None)
    return f"{verdict['where']}{pieces}"


def _missing(story: Story) -> str:
    """The map of missing torque of the model without effects, and of the one that was found."""
    rows = story.ladder[story.ladder["source"] == PHYSICS].set_index("model")["missing_torque_Nm"]
    models = dict.fromkeys([_base(story.verdict)[0], story.verdict["model"]])
    cells = story.missing.groupby("model")
    empty = story.missing.iloc[:0]
    maps = {m: cells.get_group(m) if m in cells.groups else empty for m in models}
    texts = [tell_missing_torque(maps[m], float(rows[m]), m) for m in models]
    if story.verdict["emg_noise"]:
        texts.append("Noise of the recorded EMG is such a torque without a pattern, too.")
    return " ".join(texts)


def _reach(verdict: Mapping[str, Any]) -> str:
    """What the fits stand on where it is not whole trials, and models that could not be fitted."""
    horizon, text = verdict["horizon_s"], ""
    if horizon is not None and verdict["stands_on"] == "torque":
        text += (
            f"The model does not follow the motion for {horizon:g} s, so its parameters stand on torque and no fit to "
            f"motion; all below is about predictions over {horizon:g} s with them, each from a measured state. "
        )
    elif horizon is not None:
        text += (
            f"Running free over whole trials the model diverges; all below is about predictions over {horizon:g} s, "
            "each from a measured state. "
        )
    return text + "".join(f"The model {name} could not be fitted: {why} " for name, why in verdict["failed"].items())


def _which(story: Story) -> str:
    verdict = story.verdict
    count = story.ranking[story.ranking["model"] == story.ranking["model"].iloc[0]]["effect"].nunique()
    if not verdict["follows"]:
        return f"{count} effects were scored and none was fitted: the model is too far from the motion to say which."
    text = f"Each of {count} effects was scored against what the model leaves; the promising ones were fitted. "
    if kind_of(verdict).unexplained and not verdict["effects"]:
        near = f" Nearest to it: {' and '.join(verdict['nearest'])}." if verdict["nearest"] else ""
        return text + f"None explains it.{near} {_left(verdict)}"
    if not verdict["effects"]:
        hidden = verdict["outside_usual_range"] if verdict["verdict"] == UNDECIDABLE else {}
        open_question = f" But {tell_masked(hidden)}." if hidden else ""
        return text + "No effect is supported by the data." + open_question
    classes = [" or ".join(c) for c in verdict["alternatives"]]
    text += f"The evidence asks for {', then '.join(verdict['effects'])}."
    text += only_beside_others(verdict, story.ranking)
    text += f" Not told apart: {'; '.join(classes)}." if classes else ""
    for name, others in verdict["stand_ins"].items():
        text += f" Outside the catalogue, {' or '.join(others)} would do as well as {name}."
    return text + (f" More is left. {_left(verdict)}" if kind_of(verdict).unexplained else "")


def _left(verdict: Mapping[str, Any]) -> str:
    """What is left: with muscle curves it goes, or as a formula, with the units of what it is made of."""
    if verdict["rest"]:
        return f"It goes with {verdict['rest']}: small bumps on them explain it and leave nothing to an effect."
    if verdict["formula"] == "0":
        return "No short formula of angle, velocity and activation describes the missing torque."
    symbols = {
        "q": "the angle q in rad",
        "qdot": "its velocity qdot in rad/s",
        "a": "the mean activation a of all muscles",
    }
    used = [text for symbol, text in symbols.items() if re.search(rf"\b{symbol}\b", verdict["formula"])]
    return f"As a formula, the missing torque is {verdict['formula']} N m{', with ' * bool(used)}{', '.join(used)}."


def _add(verdict: Mapping[str, Any]) -> str:
    if not verdict["follows"]:
        return "Nothing, before the model follows the motion: look at its constants, the EMG, the load and the clocks."
    if verdict["rest"] and not verdict["effects"]:
        return (
            "No effect. No family of curves in physics.curves follows these muscles, so forces and lengths hold as far "
            "as their curves do: judge them by their intervals, or measure a curve on the subject."
        )
    if kind_of(verdict).unexplained and not verdict["effects"]:
        begin = "Look at the draft below" if verdict["formula"] != "0" else "Write an effect file of your own"
        return (
            f"{begin}, give it a physical meaning, list the file in physics.effect_files and run snakemake again: it "
            "then takes part like any other effect."
        )
    if verdict["verdict"] == UNDECIDABLE:
        names = " and ".join(verdict["outside_usual_range"]) or "the parameters"
        record = "Record the trial that is proposed above, or measure" if verdict["next_trial"] else "Measure"
        return f"Nothing yet. {record} {names} on the subject; then run again."
    if not added(verdict):
        return "There is nothing to add." + " No model makes up for noise of the EMG." * bool(verdict["effects"])
    return (
        "Typed in the project's folder with its environment active (. .venv/bin/activate), this trains the network "
        "with the model that was found, and shows it below beside what is there. Nothing is overwritten: a model is a "
        "coordinate."
    )


def _keep(verdict: Mapping[str, Any]) -> str:
    """Settings with which plain `snakemake` makes what was found too; empty where there is nothing to add."""
    if not added(verdict):
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
    was = "was" if len(verdict["hidden"]) == 1 else "were"
    named = f"the verdict names {'that' if verdict['hit'] else 'less, more or something else'}"
    return f"{truth}{' and '.join(verdict['hidden'])} {was} hidden in them, and {named}."
