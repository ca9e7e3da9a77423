"""All sentences about a diagnosis, from the facts in verdict.json and nothing else: `tell` has them for the page, the
index, the titles of pictures, the log and MLflow."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from myowave.diagnosis.causes import EMG_NOISE_TITLE, OWN_CURVES
from myowave.diagnosis.comparison.names import EMG_ONLY, HORIZON_BASELINES, NOISE, POSTURE, POSTURE_LOAD
from myowave.diagnosis.report.numbers import degrees, estimate, r2_text, two_digits
from myowave.diagnosis.report.words import BASE, kind_of

Verdict = Mapping[str, Any]

QUIET = 1.1  # an adequate model that leaves no more than so many times the noise has nothing to locate
AS_GOOD = 0.02  # difference of R2 that is none
WORTH_TELLING = 0.99  # below this R2 noise is worth a sentence
IF_RIGHT = 'Where it says "were it right" the model leaves more than noise: its SE holds only if the model were right.'
RECORD_INSTEAD = (
    "Record trials in which the same posture and speed need different torques: holds at several angles against a hand "
    "that pushes and yields, lifts with different known loads, starts and stops at different speeds."
)
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
        base: which model is the one to start from.
        headline, strength: the answer, and paragraphs on how much it claims.
        numbers: (what, value) of the few that count most.
        compare, torque, horizons, where, missing, which, next_trial, add, keep, score: by the steps of the page; `keep`
            is what to write in the settings.
        restart, ladder, parameters: captions.
        noise: of the angle; `noise_with_emg`: what this and noise of the EMG make together [deg], if that is there.
        over: what the model is judged over.
        titles: of the pictures, by name.
        quiet: whether there is nothing to locate: no effect shows, and no more than noise is left.
    """

    base: str
    headline: str
    strength: list[str]
    numbers: list[tuple[str, str]]
    compare: str
    torque: str
    horizons: str
    where: str
    missing: str
    which: str
    next_trial: str
    add: str
    keep: str
    score: str
    restart: str
    ladder: str
    parameters: str
    noise: str
    noise_with_emg: float | None
    over: str
    titles: Mapping[str, str]
    quiet: bool


def tell(verdict: Verdict) -> Told:
    """Everything that is said of a verdict.

    Args:
        verdict: verdict.json.
    """
    model, _ = base_of(verdict)
    horizon, proposed, torque, where = verdict["horizon_s"], verdict["next_trial"], _torque(verdict), _where(verdict)
    return Told(
        base=f"Here {model} is the model to start from: {BASE}.",
        headline=_headline(verdict) if verdict["follows"] else f"{torque[0]} {_headline(verdict)}",
        strength=_strength(verdict) if verdict["follows"] else [*torque[1:], _stands_on(verdict)],
        numbers=_numbers(verdict),
        compare=_compare(verdict),
        torque=" ".join(torque),
        horizons=" ".join(_horizons(verdict)),
        where=" ".join(where),
        missing=_missing(verdict),
        which=_which(verdict),
        next_trial=f"{proposed['trial']}. It would tell {proposed['question']} "
        f"(expected chi-square {proposed['separation']:.3g}, now {proposed['now']:.3g})."
        if proposed
        else "",
        add=_add(verdict),
        keep=f"targets: {{models: {{{verdict['dataset']}: [{model}, {verdict['model']}]}}}}" if added(verdict) else "",
        score=_score(verdict),
        restart="" if horizon is None else f"Every {horizon:g} s the prediction starts again at the measured state.",
        ladder=_ladder_caption(verdict),
        parameters=IF_RIGHT if verdict["models_that_leave_more"] else "",
        noise=noise(verdict),
        noise_with_emg=_noise_with_emg(verdict),
        over="whole trials" if horizon is None else f"all of the {horizon:g} s after a measured state",
        titles=_titles(verdict, torque[0], where[0]),
        quiet=_quiet(verdict),
    )


def base_of(verdict: Verdict) -> tuple[str, Mapping[str, float]]:
    """The model without effects, and its errors [deg]."""
    return next(iter(verdict["rmse_deg"].items()))


def added(verdict: Verdict) -> list[str]:
    """The named effects that the model has which was found: noise of the EMG is a cause, and no part of a model."""
    return [effect for effect in verdict["effects"] if effect in verdict["model"].split("+")]


def noise(verdict: Verdict) -> str:
    """The noise of the measured angle, said to be a bound where it is one."""
    return f"{'at most ' * bool(verdict['noise_is_bound'])}{degrees(base_of(verdict)[1]['noise'])}"


def _noise_with_emg(verdict: Verdict) -> float | None:
    if not verdict["emg_noise"]:
        return None
    return math.hypot(base_of(verdict)[1]["noise"], verdict["emg_motion_deg"])


def _quiet(verdict: Verdict) -> bool:
    errors = base_of(verdict)[1]
    return verdict["verdict"] in ("adequate", "undecidable") and errors["fitted"] <= QUIET * errors["noise"]


def _headline(verdict: Verdict) -> str:
    """The answer in a sentence or two."""
    kind, classes = verdict["verdict"], {c[0]: c for c in verdict["alternatives"]}
    if not verdict["follows"]:
        return (
            f"The model does not follow these trials: over the {verdict['horizon_s']:g} s after a measured state "
            "it misses more than the mean angle of that time does. No effect was weighed."
        )
    named = [" or ".join(classes.get(name, [name])) for name in added(verdict) or verdict["nearest"]]
    of_emg = f"{EMG_NOISE_TITLE} of {verdict['emg_noise']:.2g}"
    missing = " and ".join([*named, *[of_emg] * bool(verdict["emg_noise"])])
    leaves = f"{degrees(verdict['fitted_deg'])}; the noise is {noise(verdict)}"
    if verdict["emg_noise"]:
        moved = f"that of the EMG moves the simulated arm by {degrees(verdict['emg_motion_deg'])}"
        leaves = f"{degrees(verdict['fitted_deg'])}; the noise of the angle is {noise(verdict)}, and {moved}"
    left = f"{verdict['missing_deg']:.2g} deg of motion" + (
        f", {verdict['missing_Nm']:.2g} N m of torque" if verdict["missing_Nm"] > 0 else ""
    )
    match kind:
        case "adequate":
            return f"The model is adequate: it leaves {leaves}, and no effect in the catalogue would explain more."
        case "effect":
            them = "them" if " and " in missing else "it"
            return f"Missing: {missing}. With {them} the model leaves {leaves}."
        case "class":
            like = "" if classes else " or something like it"
            text = f"Missing: {missing}{like}; these data cannot tell which. The model then leaves {leaves}."
            return " ".join([text, *_stand_ins(verdict)])
        case "partial":
            rest = verdict["rest"] or "something that is not in the catalogue"
            return " ".join([f"Missing: {missing}, and {rest} ({left}).", *_stand_ins(verdict)])
        case "unknown":
            would = f"; {missing} would explain {verdict['explained']:.0%} of it" if named else ""
            would = f"; {OWN_CURVES} would explain it" if verdict["rest"] and not named else would
            return f"Something is missing that no effect in the catalogue explains ({left}){would}."
        case "undecidable":
            return f"Not decidable: {tell_masked(verdict['outside_usual_range'])}."
    raise AssertionError(kind)


def _stand_ins(verdict: Verdict) -> list[str]:
    return [
        f"Outside the catalogue, {' or '.join(others)} would do as well as {name}."
        for name, others in verdict["stand_ins"].items()
    ]


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
    # Where more is left, no rounding makes it nothing.
    rest = f"goes with {verdict['rest']}" if verdict["rest"] else "has no name"
    claim = kind_of(verdict).sentence.format(explained=min(verdict["explained"], 0.99), rest=rest)
    if verdict["emg_noise"]:
        claim += (
            f" Noise of the angle is {noise(verdict)} of it; noise of the recorded EMG, with a standard deviation of "
            f"{two_digits(verdict['emg_noise'])} where EMG goes from 0 to 1 if it is white, moves the simulated arm by "
            f"{degrees(verdict['emg_motion_deg'])}. Squares add: together that is about "
            f"{degrees(_noise_with_emg(verdict) or 0.0)}."
        )
    effects = [f"{effect}: {_evidence(verdict, effect)}; {_estimates(verdict, effect)}." for effect in added(verdict)]
    return [*([] if verdict["verdict"] == "adequate" else [claim]), *effects]


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


def _stands_on(verdict: Verdict) -> str:
    """Where the parameters of a model come from that does not follow."""
    if verdict["stands_on"] != "torque":
        return f"Its parameters are those of a fit over {verdict['horizon_s']:g} s, and hold for no longer."
    left_out = verdict["torque_left_out"].values()
    scores = (
        f"Each training trial left out in turn: R2 {min(left_out):.2f} to {max(left_out):.2f}."
        if left_out
        else "No training trial could be left out, so nothing says how far they hang on the trials."
    )
    return f"Its parameters are fitted to torque along the measured motion. {scores}"


def _numbers(verdict: Verdict) -> list[tuple[str, str]]:
    errors, found, horizon = verdict["rmse_deg"], verdict["model"], verdict["horizon_s"]
    model, first = base_of(verdict)
    over = "" if horizon is None else f", over all of the {horizon:g} s after measured states"
    numbers = [(f"held-out RMSE of {model}{over}", degrees(first["heldout"]))]
    if found != model:
        numbers.append(("held-out RMSE with what was found", degrees(errors[found]["heldout"])))
    numbers.append(("noise of the measured angle", noise(verdict)))
    if verdict["emg_noise"]:
        numbers.append(("moved by noise of the recorded EMG", degrees(verdict["emg_motion_deg"])))
    return numbers


def _compare(verdict: Verdict) -> str:
    """What the fits stand on, models that could not be fitted, and errors beside the noise."""
    (model, errors), horizon = base_of(verdict), verdict["horizon_s"]
    train, heldout = degrees(errors["train"]), degrees(errors["heldout"])
    times = (
        f"{'more than ' * verdict['noise_is_bound']}{two_digits(errors['fitted'] / errors['noise'])} times the noise"
    )
    failed = [f"The model {name} could not be fitted: {why}" for name, why in verdict["failed"].items()]
    if horizon is None:
        text = (
            f"Fitted to the training trials, the model {model} leaves {train} there and {heldout} on held-out trials."
        )
        return " ".join([*failed, text, *[f"On the training trials that is {times}."] * (not _quiet(verdict))])
    reach = (
        f"The model does not follow the motion for {horizon:g} s, so its parameters stand on torque and no fit to "
        f"motion; all below is about predictions over {horizon:g} s with them, each from a measured state."
        if verdict["stands_on"] == "torque"
        else f"Running free over whole trials the model diverges; all below is about predictions over {horizon:g} s, "
        "each from a measured state."
    )
    fitted = (
        f"So predicted, the model {model} misses by {train} on training trials and by {heldout} on held-out trials. "
        f"Given the best start of each piece instead, as the fit takes it, it leaves {degrees(errors['fitted'])} on "
        f"the training trials, {times}."
    )
    return " ".join([reach, *failed, fitted])


def _part(facts: Mapping[str, Any]) -> str:
    return "On held-out trials" if facts["held_out"] else "On training trials"


def _torque(verdict: Verdict) -> list[str]:
    """How much of the torque posture, EMG and the models explain, and what to do where it is little; the finding
    first."""
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
            f"So EMG and muscles explain {less} posture and speed do, and no verdict on the muscles can stand on "
            f"these trials. {'' if POSTURE_LOAD in r2 else SAME_LOAD}{RECORD_INSTEAD}"
        )
    elif r2[found] < r2[EMG_ONLY] - AS_GOOD:
        texts.append("A straight line through EMG explains more than the muscles: the physics is wrong, or its EMG is.")
    elif r2[found] < r2.get(POSTURE_LOAD, -math.inf) - AS_GOOD:
        texts.append(
            "So EMG tells what posture does not, above all the load; but who knows the load needs no EMG here, as "
            f"every movement is much like every other. {RECORD_INSTEAD}"
        )
    return texts


def _horizons(verdict: Verdict) -> list[str]:
    """How far the models miss after half a second and over whole trials."""
    facts, found = verdict["horizons"], verdict["model"]
    rmse, whole, horizon = facts["rmse_deg"], facts["whole_deg"], facts["horizon_s"]
    if horizon is None:
        return ["The trials are too short to predict over short horizons."]
    models = dict.fromkeys((base_of(verdict)[0], found))
    rival = min((name for name in HORIZON_BASELINES if name in rmse), key=lambda name: rmse[name])
    parts = [f"{m} misses by {rmse[m]:.2g} deg" for m in models]
    parts.append(f"the best predictor without a model of the arm ({rival}) by {rmse[rival]:.2g}")
    texts = [f"{_part(facts)}, {horizon:g} s after a measured state {', '.join(parts)}."]
    if whole:
        texts.append(f"Running free over whole trials, {' and '.join(f'{m} by {whole[m]:.2g} deg' for m in models)}.")
    return texts


def _where(verdict: Verdict) -> list[str]:
    """Where the misfit is, the strongest finding first; said once where it is no more than the noise."""
    if _quiet(verdict):
        return [f"What the model leaves is no more than the noise of the angle, {noise(verdict)}: nothing to locate."]
    if verdict["worst_part_deg"] <= base_of(verdict)[1]["noise"]:
        texts = [f"In every part of the trials the misfit is below the noise, {noise(verdict)}: nothing to locate."]
    else:
        texts = [f"It {_finding(**finding)}." for finding in verdict["where"]] or ["It is the same everywhere."]
        texts = [texts[0].replace("It ", "The misfit ", 1), *texts[1:], f"The noise is {noise(verdict)}."]
    pieces = "These are errors of the fit, with the best start of each piece."
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


def _missing(verdict: Verdict) -> str:
    """The torque that the model without effects lacks, and that of the one that was found."""
    texts = [
        f"{model} lacks a torque of {rms:.2g} N m RMS."
        if rms > 0
        else f"{model} lacks no torque beyond what noise shows."
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
    return " ".join(texts)


def _left(verdict: Verdict) -> str:
    """What is left: with muscle curves it goes, or as a formula, with the units of what it is made of."""
    if verdict["rest"]:
        return f"It goes with {verdict['rest']}: small bumps on them explain it and leave nothing to an effect."
    if verdict["formula"] == "0":
        return "No short formula of angle, velocity and activation describes the missing torque."
    used = [text for symbol, text in SYMBOLS.items() if re.search(rf"\b{symbol}\b", verdict["formula"])]
    return f"As a formula, the missing torque is {verdict['formula']} N m{', with ' * bool(used)}{', '.join(used)}."


def _add(verdict: Verdict) -> str:
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
    if verdict["verdict"] == "undecidable":
        names = " and ".join(verdict["outside_usual_range"]) or "the parameters"
        record = "Record the trial that is proposed above, or measure" if verdict["next_trial"] else "Measure"
        return f"Nothing yet. {record} {names} on the subject; then run again."
    if not added(verdict):
        return "There is nothing to add." + " No model makes up for noise of the EMG." * bool(verdict["effects"])
    if not verdict["command"]:
        return "The model that was found, named in the settings as below, is then trained and compared in every run."
    return (
        "Typed in the project's folder with its environment active (. .venv/bin/activate), this trains the network "
        "with the model that was found, and shows it below beside what is there. Nothing is overwritten: a model is a "
        "coordinate."
    )


def _ladder_caption(verdict: Verdict) -> str:
    text, horizon = f"The noise of the measured angle is {noise(verdict)}.", verdict["horizon_s"]
    if horizon is None:
        return text
    return (
        f"{text} Errors of the physical model are over the {horizon:g} s after measured states; a network's "
        "are over whole trials, running free."
    )


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


def _titles(verdict: Verdict, torque: str, where: str) -> dict[str, str]:
    """What each picture shows."""
    (model, first), found, errors = base_of(verdict), verdict["model"], verdict["rmse_deg"]
    models = dict.fromkeys((model, found))
    texts = [f"{_spaced(m)} misses by {degrees(errors[m]['heldout'])}" for m in models]
    heldout = f"On held-out trials {', '.join(texts)}; noise is {noise(verdict)}"
    asked = [
        f"{verdict['titles'].get(name) or name}"
        + (f" ($\\Delta$BIC {verdict['evidence'][name]['delta_bic']:.0f})" if name in verdict["evidence"] else "")
        for name in added(verdict)
    ]
    if not verdict["follows"]:
        ranking = f"No effect was weighed, as {model} does not follow the trials; these are first guesses"
    elif asked:
        ranking = f"The evidence asks for {' and '.join(asked)}, and for no other effect"
    else:
        ranking = f"The evidence asks for no effect beside {model}"
    ladder = f"Nothing added: {degrees(first['heldout'])} on held-out trials, noise is {noise(verdict)}"
    if found != model:
        before, after = (verdict["missing_torque_Nm"][m] for m in models)
        ladder = (
            f"With what was found the held-out error falls from {degrees(first['heldout'])} to "
            f"{degrees(errors[found]['heldout'])}, missing torque from {before:.2g} to {after:.2g} N m"
        )
    return {
        "overlay": heldout,
        "errors": heldout,
        "torque": torque.rstrip("."),
        "horizons": _horizons(verdict)[0].rstrip("."),
        "correlations": "How alike the estimates are: with a correlation near 1 or -1 two are only known together",
        "misfit": where.rstrip("."),
        "missing_torque": _missing(verdict).split(". ")[0].rstrip("."),
        "ranking": ranking,
        "ladder": ladder,
        "parameters": "Parameters with 95 % intervals",
    }


def _spaced(model: str) -> str:
    """A model's name with room for a line break."""
    return model.replace("+", " + ")
