"""What the data say for each effect that is named, and how much of what is left is noise, in sentences."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from myowave.diagnosis.report.cells import estimate
from myowave.diagnosis.report.ladder import steps
from myowave.diagnosis.report.words import degrees, noise, noise_with_emg, two_digits


def added(verdict: Mapping[str, Any]) -> list[str]:
    """The named effects that the model has which was found: noise of the EMG is a cause, and no part of a model."""
    return [effect for effect in verdict["effects"] if effect in verdict["model"].split("+")]


def evidence(verdict: Mapping[str, Any], ranking: pd.DataFrame, effect: str) -> str:
    """What the data say for an effect: beside all others that were found; when it was added where it is the only one,
    or where no more is known.

    Args:
        ranking: the table `ranking` of `tables`.
    """
    several = len(added(verdict)) > 1
    known = verdict["beside"].get(effect) if several else None
    if known is not None:
        when = "beside the rest of the model that was found, "
    else:
        model = next((model for model, other in steps(ranking).items() if other == effect), None)
        if model is None:
            return "found together with the others"
        known = ranking.set_index(["model", "effect"]).loc[model, effect]
        when = f"when it was added to {model}, " * several
    return (
        f"{when}delta BIC {known['delta_bic']:.0f} where 10 is very strong evidence, and {known['folds_won']} of "
        f"{known['folds']} training trials, each left out in turn, are predicted better with it"
    )


def estimates(verdict: Mapping[str, Any], parameters: pd.DataFrame, effect: str) -> str:
    """The parameters of an effect in the model that was found, with their standard errors.

    Args:
        parameters: of `ladder.join_parameters`.
    """
    units = parameters.drop_duplicates("parameter").set_index("parameter")["unit"].dropna()
    texts = []
    for name, p in verdict["parameters"][verdict["model"]].items():
        if name.startswith(f"{effect}."):
            unit = f" {units[name]}" if units.get(name, "-") != "-" else ""
            texts.append(f"{name.removeprefix(f'{effect}.')} = {estimate(p['value'], p['se'])}{unit}")
    return ", ".join(texts)


def only_beside_others(verdict: Mapping[str, Any], ranking: pd.DataFrame) -> str:
    """The named effects that would not have been accepted by themselves where they were added; empty without any."""
    status = ranking.set_index(["model", "effect"])["status"]
    weak = [
        f"{effect} added to {model}"
        for model, effect in steps(ranking).items()
        if effect in verdict["effects"] and status.get((model, effect)) != "supported"
    ]
    return f" By itself, {' or '.join(weak)} would not pass: its worth shows beside the others." * bool(weak)


def share_of_noise(verdict: Mapping[str, Any]) -> str:
    """How much of what is left each noise makes, where it is not only that of the angle; else empty."""
    together = noise_with_emg(verdict)
    if together is None:
        return ""
    return (
        f" Noise of the angle is {noise(verdict)} of it; noise of the recorded EMG, with a standard deviation of "
        f"{two_digits(verdict['emg_noise'])} where EMG goes from 0 to 1 if it is white, moves the simulated arm by "
        f"{degrees(verdict['emg_motion_deg'])}. Squares add: together that is about {degrees(together)}."
    )
