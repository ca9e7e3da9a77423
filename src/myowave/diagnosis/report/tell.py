"""All sentences about a diagnosis, from the facts in verdict.json and nothing else: `tell` has them for the page, the
index, the titles of pictures, the log and MLflow."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from myowave.diagnosis.causes import CAUSE_TITLES, OWN_CURVES
from myowave.diagnosis.comparison.names import EMG_ONLY, HORIZON_BASELINES, NOISE, POSTURE, POSTURE_LOAD
from myowave.diagnosis.report.advice import AS_GOOD, SESSION, added, base_of, disagrees, needs_others, next_steps, todo
from myowave.diagnosis.report.ladder import PLAIN, shown_network
from myowave.diagnosis.report.numbers import degrees, estimate, r2_text, two_digits
from myowave.diagnosis.report.words import BASE, kind_of

Verdict = Mapping[str, Any]

ERROR = "heldout_rmse_deg"
QUIET = 1.1  # an adequate model that leaves no more than so many times the noise has nothing to locate
WORTH_TELLING = 0.99  # below this R2 noise is worth a sentence
NO_EFFECT = "With no effect that was tried does it follow, so none is named."
SAME_LOAD = "The settings give all training trials the same load; where it was another, correct it under conditions. "
SYMBOLS = {
    "q": "the angle q in rad",
    "qdot": "its velocity qdot in rad/s",
    "a": "the mean activation a of all muscles",
}


@dataclass(frozen=True)
class Told:
    """What is said of a verdict, each part without the others; empty where there is nothing to say.

    Args:
        headline: the answer in a sentence with one number; `lead`, paragraphs below it.
        todo: what to do next in a few words, `next` in sentences; `session`, trials to record: what, load, seconds.
        compare, torque, horizons, where, missing, which: by the steps of the page.
        command, keep: what to type, and what to write in the settings, to add what was found.
        parameters: what those of a model stand on that does not follow.
        score: what scoring knows where the trials were simulated.
        noise: of the angle; `noise_with_emg`: what this and noise of the EMG make together [deg], if that is there.
        quiet: whether there is nothing to locate: no effect shows, and no more than noise is left.
    """

    headline: str
    lead: list[str]
    todo: str
    next: list[str]
    session: Sequence[tuple[str, str, int]]
    compare: str
    torque: str
    horizons: str
    where: str
    missing: str
    which: str
    command: str
    keep: str
    parameters: str
    score: str
    noise: str
    noise_with_emg: float | None
    quiet: bool


def tell(verdict: Verdict) -> Told:
    """Everything that is said of a verdict.

    Args:
        verdict: verdict.json.
    """
    torque, follows = _torque(verdict), verdict["follows"]
    model, added_ones = base_of(verdict)[0], added(verdict)
    return Told(
        headline=_headline(verdict),
        lead=_strength(verdict) if follows else [" ".join([NO_EFFECT, *torque[1:]])],
        todo=todo(verdict),
        next=next_steps(verdict),
        session=SESSION if needs_others(verdict) else (),
        compare=_compare(verdict),
        torque=" ".join(torque if follows else torque[:1]),
        horizons=_horizons(verdict),
        where=" ".join(_where(verdict)),
        missing=_missing(verdict),
        which=_which(verdict),
        command=verdict["command"] if added_ones else "",
        keep=f"targets: {{models: {{{verdict['dataset']}: [{model}, {verdict['model']}]}}}}" if added_ones else "",
        parameters="" if follows else _basis(verdict),
        score=_score(verdict),
        noise=noise(verdict),
        noise_with_emg=_noise_with_emg(verdict),
        quiet=_quiet(verdict),
    )


def noise(verdict: Verdict) -> str:
    """The noise of the measured angle, said to be a bound where it is one."""
    return f"{'at most ' * bool(verdict['noise_is_bound'])}{degrees(base_of(verdict)[1]['noise'])}"


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
        name = best["source"].removeprefix(f"{PLAIN}, ")
        text += f" Of {len(plain)} predictors without physics the best, {name}, is off by {degrees(best[ERROR])}."
    return text


def _noise_with_emg(verdict: Verdict) -> float | None:
    if not verdict["emg_noise"]:
        return None
    return math.hypot(base_of(verdict)[1]["noise"], verdict["emg_motion_deg"])


def _quiet(verdict: Verdict) -> bool:
    errors = base_of(verdict)[1]
    return verdict["verdict"] in ("adequate", "undecidable") and errors["fitted"] <= QUIET * errors["noise"]


def _named(verdict: Verdict) -> str:
    """What is missing, by titles: those of a class joined by `or`."""
    classes = {c[0]: c for c in verdict["alternatives"]}

    def title(name: str) -> str:
        return CAUSE_TITLES.get(name) or verdict["titles"].get(name) or name

    causes = verdict["effects"] or verdict["nearest"]
    return " and ".join(" or ".join(map(title, classes.get(name, [name]))) for name in causes)


def _held_out(verdict: Verdict) -> str:
    return "held-out trials" if verdict["horizon_s"] is None else "short pieces of held-out trials"


def _headline(verdict: Verdict) -> str:
    """The answer in a sentence with one number."""
    error, left = degrees(verdict["rmse_deg"][verdict["model"]]["heldout"]), degrees(verdict["missing_deg"])
    named, trials, kind = _named(verdict), _held_out(verdict), verdict["verdict"]
    if not verdict["follows"]:
        rmse, horizon = verdict["horizons"]["rmse_deg"], verdict["horizons"]["horizon_s"]
        model = base_of(verdict)[0]
        after = "half a second" if horizon == 0.5 else f"{horizon:g} s" if horizon else ""
        far = f"{degrees(rmse[model])} off after {after}" if model in rmse else f"{error} off within short pieces"
        return f"The muscle model does not follow this arm: {far}."
    match kind:
        case "adequate" if disagrees(verdict):
            return f"The model explains the training trials, but misses {trials} by {error}."
        case "adequate":
            return f"Nothing is missing: the model predicts {trials} within {error}."
        case "effect":
            return (
                f"Missing: {named}. With {'them' if ' and ' in named else 'it'} the model misses {trials} by {error}."
            )
        case "class":
            like = " or something like it" * (not verdict["alternatives"])
            return f"Missing: {named}{like}; these trials cannot tell which. The error is then {error}."
        case "partial":
            return f"Missing: {named}, and {verdict['rest'] or 'something else'} that moves the arm by {left}."
        case "unknown":
            what = OWN_CURVES if verdict["rest"] and not named else "something that no effect explains"
            return f"Missing: {what}. It moves the arm by {left}."
        case "undecidable" if not verdict["outside_usual_range"]:
            likeliest = max(verdict["probabilities"], key=lambda name: verdict["probabilities"][name])
            title = CAUSE_TITLES.get(likeliest) or verdict["titles"].get(likeliest) or likeliest
            return f"These trials cannot tell: {title} may be missing, or nothing is."
        case "undecidable":
            return f"These trials cannot tell: {tell_masked(verdict['outside_usual_range'])}."
    raise AssertionError(kind)


def tell_masked(masked: Mapping[str, Sequence[str]]) -> str:
    """Parameters with unusual values, and the effects that would explain these; those of the same effects together.

    Args:
        masked: {parameter: effects}.
    """
    groups: dict[tuple[str, ...], list[str]] = {}
    for parameter, effects in masked.items():
        groups.setdefault(tuple(effects), []).append(parameter)
    return "; ".join(
        f"{' and '.join(names)} {'is outside its' if len(names) == 1 else 'are outside their'} usual range, or "
        f"{' or '.join(effects)} is there"
        for effects, names in groups.items()
    )


def _strength(verdict: Verdict) -> list[str]:
    """How much a verdict claims, in numbers, a paragraph for each effect."""
    (model, first), found = base_of(verdict), verdict["model"]
    # Where more is left, no rounding makes it nothing.
    rest = f"goes with {verdict['rest']}" if verdict["rest"] else "has no name"
    claim = kind_of(verdict).sentence.format(explained=min(verdict["explained"], 0.99), rest=rest)
    if found != model:
        claim += (
            f" The model without {'them' if len(added(verdict)) > 1 else 'it'} misses by {degrees(first['heldout'])}."
        )
    claim += f" The noise of the angle is {noise(verdict)}."
    if verdict["emg_noise"]:
        claim += (
            f" Noise of the recorded EMG, with a standard deviation of {two_digits(verdict['emg_noise'])} where EMG "
            "goes from 0 to 1 if it is white, moves the simulated arm by "
            f"{degrees(verdict['emg_motion_deg'])}. Squares add: together that is about "
            f"{degrees(_noise_with_emg(verdict) or 0.0)}."
        )
    if verdict["verdict"] == "adequate" and disagrees(verdict):
        claim += (
            " The verdict is of the training trials alone. The held-out trials hold something that these do not show: "
            "believe neither that nothing is missing, nor the parameters."
        )
    effects = [f"{effect}: {_evidence(verdict, effect)}; {_estimates(verdict, effect)}." for effect in added(verdict)]
    others = [
        f"Outside the catalogue, {' or '.join(stand_ins)} would do as well as {name}."
        for name, stand_ins in verdict["stand_ins"].items()
    ]
    return [claim.strip() + _probabilities(verdict), *effects, *others]


def _probabilities(verdict: Verdict) -> str:
    """How likely each name is, where the evidence of whole trials was weighed."""
    titles = {**verdict["titles"], **CAUSE_TITLES}
    said = [f"{titles.get(name) or name} {min(p, 0.99):.0%}" for name, p in verdict["probabilities"].items()]
    return f" By the evidence of the trials: {'; '.join(said)}." if said else ""


def _evidence(verdict: Verdict, effect: str) -> str:
    """What the data say for an effect."""
    known = verdict["evidence"].get(effect)
    if known is None:
        return "found together with the others"
    given = f"given {known['without']}, " * (len(added(verdict)) > 1)
    return (
        f"{given}delta BIC {known['delta_bic']:.0f} where 10 is very strong evidence, and {known['folds_won']} of "
        f"{known['folds']} training trials, each left out in turn, are predicted better with it"
    )


def _estimates(verdict: Verdict, effect: str) -> str:
    """The parameters of an effect in the model that was found, with their standard errors."""
    texts = []
    for name, p in verdict["parameters"][verdict["model"]].items():
        if name.startswith(f"{effect}."):
            unit = "" if p["unit"] in ("-", "") else f" {p['unit']}"
            texts.append(f"{name.removeprefix(f'{effect}.')} = {estimate(p['value'], p['se'])}{unit}")
    return ", ".join(texts)


def _basis(verdict: Verdict) -> str:
    """Where the parameters of a model come from that does not follow."""
    if verdict["stands_on"] != "torque":
        return f"They are those of a fit over {verdict['horizon_s']:g} s, and hold for no longer."
    left_out = verdict["torque_left_out"].values()
    scores = (
        f"Each training trial left out in turn: R2 {min(left_out):.2f} to {max(left_out):.2f}."
        if left_out
        else "No training trial could be left out, so nothing says how far they hang on the trials."
    )
    return f"They are fitted to torque along the measured motion. {scores}"


def _compare(verdict: Verdict) -> str:
    """What the fits stand on, and models that could not be fitted."""
    model, horizon = base_of(verdict)[0], verdict["horizon_s"]
    texts = [f"Here {model} is the model to start from: {BASE}."]
    if horizon is not None:
        texts.append(
            f"It does not follow the motion for {horizon:g} s, so its parameters stand on torque and no fit to motion."
            if verdict["stands_on"] == "torque"
            else "Running free over whole trials the model diverges."
        )
        texts.append(f"In the picture it starts again at the measured state every {horizon:g} s; a network never does.")
    return " ".join(
        [*texts, *(f"The model {name} could not be fitted: {why}" for name, why in verdict["failed"].items())]
    )


def _part(facts: Mapping[str, Any]) -> str:
    return "On held-out trials" if facts["held_out"] else "On training trials"


def _torque(verdict: Verdict) -> list[str]:
    """How much of the torque posture, EMG and the models explain; the finding first, then what follows from it."""
    r2, first, found = verdict["torque"]["r2"], base_of(verdict)[0], verdict["model"]
    if r2[POSTURE] is None or r2[first] is None:
        return ["The trials are too short, or too still, to compare torques."]
    texts = [
        f"{_part(verdict['torque'])}, the muscles of {first}, driven by EMG, explain R2 {r2_text(r2[first])} of the "
        f"torque that the motion needs{f' ({found}: {r2_text(r2[found])})' if found != first else ''}, posture and "
        f"speed alone {r2_text(r2[POSTURE])}"
        + (f" and, given the load too, {r2_text(r2[POSTURE_LOAD])}" if POSTURE_LOAD in r2 else "")
        + f"; EMG without physics {r2_text(r2[EMG_ONLY])}."
    ]
    if r2.get(NOISE, 1.0) < WORTH_TELLING:
        texts.append(f"The noise of the angle leaves about {r2_text(r2[NOISE])} for a model that is right.")
    if min(r2[POSTURE], r2[EMG_ONLY], r2[first], r2[found]) < 0:
        texts.append("Below 0 is worse than a constant torque.")
    if not r2[found] > r2[POSTURE] + AS_GOOD:
        less = "less than" if r2[found] < r2[POSTURE] - AS_GOOD else "no more than"
        texts.append(
            f"EMG and muscles explain {less} posture and speed do, and no verdict on the muscles can stand on these "
            f"trials. {'' if POSTURE_LOAD in r2 else SAME_LOAD}"
        )
    elif r2[found] < r2[EMG_ONLY] - AS_GOOD:
        texts.append("A straight line through EMG explains more than the muscles: the physics is wrong, or its EMG is.")
    elif r2[found] < r2.get(POSTURE_LOAD, -math.inf) - AS_GOOD:
        texts.append(
            "EMG tells what posture does not, above all the load; but who knows the load needs no EMG here, as every "
            "movement is much like every other."
        )
    return [text.strip() for text in texts]


def _horizons(verdict: Verdict) -> str:
    """How far the models miss after half a second."""
    facts, found = verdict["horizons"], verdict["model"]
    rmse, horizon = facts["rmse_deg"], facts["horizon_s"]
    if horizon is None:
        return "The trials are too short to predict over short horizons."
    rival = min((name for name in HORIZON_BASELINES if name in rmse), key=lambda name: rmse[name])
    parts = [f"{m} misses by {degrees(rmse[m])}" for m in dict.fromkeys((base_of(verdict)[0], found))]
    parts.append(f"the best predictor without a model of the arm ({rival}) by {degrees(rmse[rival])}")
    return f"{_part(facts)}, {horizon:g} s after a measured state {', '.join(parts)}."


def _where(verdict: Verdict) -> list[str]:
    """Where the misfit is, the strongest finding first; said once where it is no more than the noise."""
    if _quiet(verdict):
        return [f"What the model leaves is no more than the noise of the angle, {noise(verdict)}: nothing to locate."]
    if verdict["worst_part_deg"] <= base_of(verdict)[1]["noise"]:
        texts = [f"In every part of the trials the misfit is below the noise, {noise(verdict)}: nothing to locate."]
    else:
        texts = [f"It {_finding(**finding)}." for finding in verdict["where"]] or ["It is the same everywhere."]
        texts = [texts[0].replace("It ", "The misfit ", 1), *texts[1:], f"The noise is {noise(verdict)}."]
    pieces = "These are errors of the fit to training trials, with the best start of each piece."
    return [*texts, *[pieces] * (verdict["horizon_s"] is not None)]


def _finding(kind: str, of: Sequence[str], parts: Sequence[Mapping[str, Any]]) -> str:
    """What the misfit does, by a finding of `misfit.where.locate`."""
    one, other = parts
    errors = [degrees(part["rmse_deg"]) for part in parts]
    if kind in ("trend", "extremes"):
        name, unit = _name_and_unit(of)
        ranges = [f"{_end(part['low'])} to {_end(part['high'])}{unit}" for part in parts]
        if kind == "extremes":
            return f"is largest at {name} {ranges[0]} ({errors[0]}) and smallest at {ranges[1]} ({errors[1]})"
        grows = "grows" if other["rmse_deg"] > one["rmse_deg"] else "falls"
        return f"{grows} with {name}, from {errors[0]} ({ranges[0]}) to {errors[1]} ({ranges[1]})"
    if kind == "shift":
        where = "ahead of" if one["mean_deg"] > 0 else "behind"
        by = f"{abs(one['mean_deg']):.2g} deg in {one['part']} and {abs(other['mean_deg']):.2g} in {other['part']}"
        return f"goes with the direction: the arm is {where} the model, by {by}"
    if kind == "direction":
        return f"is larger in {one['part']} ({errors[0]}) than in {other['part']} ({errors[1]})"
    names = [str(part["part"]).removeprefix("trial") for part in parts]
    return f"is largest in trial {names[0]} ({errors[0]}), smallest in trial {names[1]} ({errors[1]})"


def _end(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 10 else f"{value:.2g}"


def _name_and_unit(factors: Sequence[str]) -> tuple[str, str]:
    """`speed [deg/s]` as "speed" and " deg/s"; a number without a unit has none. Of several the names together."""
    names, units = zip(*(factor.removesuffix("]").rsplit(" [", 1) for factor in factors), strict=True)
    others = " and ".join(name.removeprefix("activation ") for name in names[1:])
    name = names[0].replace("activation", "activation of") + (f" and {others}" if others else "")
    return name, "" if units[0] == "-" else f" {units[0]}"


def torque_text(verdict: Verdict, model: str) -> str:
    """Torque that a model lacks, as everywhere: RMS over the training trials [N m], or what noise hides."""
    rms, hidden = verdict["missing_torque_Nm"][model], verdict["torque_noise_Nm"][model]
    return f"{two_digits(rms)} N m" if rms > 0 else f"under {two_digits(hidden)} N m"


def _missing(verdict: Verdict) -> str:
    """The torque that the model without effects lacks, and that of the one that was found."""
    texts = [
        f"{model} lacks a torque of {torque_text(verdict, model)} RMS."
        if rms > 0
        else f"{model} lacks no torque that noise would not show, {torque_text(verdict, model)}."
        for model, rms in verdict["missing_torque_Nm"].items()
    ]
    if verdict["emg_noise"]:
        texts.append("Noise of the recorded EMG is such a torque, too, without a pattern over angle and velocity.")
    return " ".join(texts)


def _which(verdict: Verdict) -> str:
    count, effects, nearest = verdict["scored"], verdict["effects"], verdict["nearest"]
    if not verdict["follows"]:
        return f"{count} effects were scored and none was fitted: the model is too far from the motion to say which."
    texts = [f"Each of {count} effects was scored against what the model leaves; the promising ones were fitted."]
    if not effects and kind_of(verdict).unexplained:
        texts += ["None explains it.", *[f"Nearest to it: {' and '.join(nearest)}."] * bool(nearest), _left(verdict)]
    elif not effects:
        texts.append("No effect is supported by the data.")
        if verdict["verdict"] == "undecidable" and verdict["outside_usual_range"]:
            texts.append(f"But {tell_masked(verdict['outside_usual_range'])}.")
    else:
        texts.append(f"The evidence asks for {', then '.join(effects)}.")
        weak = [name for name, known in verdict["evidence"].items() if not known["alone"]]
        if weak:
            texts.append(f"By itself, {' or '.join(weak)} would not pass: its worth shows given the others.")
        texts += ["More is left.", _left(verdict)] if kind_of(verdict).unexplained else []
    if verdict["absorbed"]:
        texts.append(
            f"{len(verdict['absorbed'])} of the {count} cannot be seen in these trials, as parameters that are fitted "
            "anyway take their place; the table says which."
        )
    return " ".join(texts)


def _left(verdict: Verdict) -> str:
    """What is left: with muscle curves it goes, or as a formula, with the units of what it is made of."""
    if verdict["rest"]:
        return f"It goes with {verdict['rest']}: small bumps on them explain it and leave nothing to an effect."
    if verdict["formula"] == "0":
        return "No short formula of angle, velocity and activation describes the missing torque."
    used = [text for symbol, text in SYMBOLS.items() if re.search(rf"\b{symbol}\b", verdict["formula"])]
    return f"As a formula, the missing torque is {verdict['formula']} N m{', with ' * bool(used)}{', '.join(used)}."


def _score(verdict: Verdict) -> str:
    """What scoring knows where the trials were simulated."""
    if verdict["hidden"] is None:
        return ""
    truth = "These trials are simulated, so the truth is known: "
    if not verdict["hidden"]:
        return f"{truth}nothing was hidden in them, and {'nothing' if verdict['hit'] else 'something'} was reported."
    was = "was" if len(verdict["hidden"]) == 1 else "were"
    named = f"the verdict names {'that' if verdict['hit'] else 'less, more or something else'}"
    return f"{truth}{' and '.join(verdict['hidden'])} {was} hidden in them, and {named}."
