"""What to do next, by a verdict: trials to record as a person at a table does them, and what to add or to measure."""

import math
from collections.abc import Mapping
from typing import Any

from myowave.diagnosis.comparison.names import POSTURE, POSTURE_LOAD
from myowave.diagnosis.report.words import kind_of

Verdict = Mapping[str, Any]

AS_GOOD = 0.02  # difference of R2 that is none
# ASSUME: errors of held-out trials scatter, as parameters are estimated; three times what is left on training trials,
# and what noise would leave, is more than that.
DISAGREES = 3.0
# What a person records at a table where the trials so far say little of the muscles: what to do, load, seconds. The
# same posture and speed need different torques in them, which is what tells muscles from habit.
SESSION = (
    ("hold the elbow at 45, 90 and 120 deg, 5 s each, upper arm hanging", "none", 20),
    ("the same again", "2 kg", 20),
    ("curl slowly, 4 s up and 4 s down", "1 kg", 30),
    ("curl fast, and stop each time at another height", "1 kg", 30),
    ("curl at your own speed, with stops", "2 kg", 30),
    ("elbow at 90 deg: a helper pushes the wrist up and down and lets go, you hold against it", "none", 30),
    ("elbow at 90 deg, against something fixed, as hard as you can: bend 3 s, rest a minute, stretch 3 s", "-", 80),
    ("for testing: curl as you like", "1.5 kg", 30),
)
SESSION_NOTE = (
    "Record EMG and angle together, without a pause within a trial. Weigh what the hand holds, and write it in the "
    "settings: conditions: {trial2: {load: 2}}."
)
# The trials that a diagnosis may propose, told to a person.
DO = {
    "as recorded": "repeat one of your trials just as it was",
    "faster": "move as in your trials, nearly twice as fast",
    "slower": "move as in your trials, half as fast",
    "passive swing": "let all muscles go; a helper lifts the forearm and lets it swing",
    "co-contraction": "move as in your trials with biceps and triceps tensed together",
    "known load of 1 kg": "move as in your trials with 1 kg in the hand (conditions: load 1)",
    "other posture, upper arm 30 deg forward": "move as in your trials, the upper arm 30 deg forward (conditions: tilt "
    "0.52)",
}


def base_of(verdict: Verdict) -> tuple[str, Mapping[str, float]]:
    """The model without effects, and its errors [deg]."""
    return next(iter(verdict["rmse_deg"].items()))


def added(verdict: Verdict) -> list[str]:
    """The named effects that the model has which was found: noise of the EMG is a cause, and no part of a model."""
    return [effect for effect in verdict["effects"] if effect in verdict["model"].split("+")]


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


def todo(verdict: Verdict) -> str:
    """What to do next, in a few words."""
    if needs_others(verdict):
        return "record trials that differ more: the page lists them"
    if verdict["next_trial"]:
        return f"record one trial: {_do(verdict)}"
    if verdict["verdict"] == "undecidable":
        return f"measure {' and '.join(verdict['outside_usual_range']) or 'the parameters'} on the subject"
    if kind_of(verdict).unexplained:
        return "see where it fails, and give what is left a physical meaning"
    if verdict["verdict"] == "adequate" and disagrees(verdict):
        return "record training trials more like the held-out ones"
    return "train with what was found: the command is on the page" if added(verdict) else "nothing: use the parameters"


def _do(verdict: Verdict) -> str:
    """The proposed trial, told to a person."""
    trial = verdict["next_trial"]["trial"]
    return f"{DO.get(trial, trial)}, as long as the others"


def next_steps(verdict: Verdict) -> list[str]:
    """What to do next in sentences: what to record, then what to add or to write."""
    return [*_record(verdict), *[_add(verdict)] * verdict["follows"]]


def plan(verdict: Verdict) -> list[str]:
    """What to record next as lines for a person at a table."""
    if not needs_others(verdict):
        return _record(verdict) or ["No further trial would tell more of what was weighed."]
    trials = [
        f"{n:>3}. {what[0].upper()}{what[1:]}; in the hand: {load}; {seconds} s."
        for n, (what, load, seconds) in enumerate(SESSION, 1)
    ]
    return [*_record(verdict), *trials, SESSION_NOTE]


def _record(verdict: Verdict) -> list[str]:
    texts = []
    if proposed := verdict["next_trial"]:
        texts.append(
            f"Record one more trial: {_do(verdict)}. It would tell {proposed['question']} "
            f"(expected chi-square {proposed['separation']:.3g}, now {proposed['now']:.3g})."
        )
    if not verdict["follows"]:
        texts.append(
            "These trials say too little of the muscles: whoever knows posture, speed and load hardly needs them. "
            "Before more trials, look at the constants, the EMG, the loads and the clocks of these; then record:"
        )
    elif needs_others(verdict):
        texts.append("To say more of the muscles, record trials in which one posture needs different torques:")
    return texts


def _add(verdict: Verdict) -> str:
    if verdict["rest"] and not verdict["effects"]:
        return (
            "Add no effect. No family of curves in physics.curves follows these muscles, so forces and lengths hold as "
            "far as their curves do: judge them by their intervals, or measure a curve on the subject."
        )
    if kind_of(verdict).unexplained and not verdict["effects"]:
        begin = "Look at the draft below" if verdict["formula"] != "0" else "Write an effect file of your own"
        return (
            f"{begin}, give it a physical meaning, list the file in physics.effect_files and run snakemake again: it "
            "then takes part like any other effect."
        )
    if verdict["verdict"] == "undecidable":
        names = " and ".join(verdict["outside_usual_range"]) or "the parameters"
        measure = "Or measure" if verdict["next_trial"] else "Measure"
        return f"Add nothing yet. {measure} {names} on the subject; run again."
    if not added(verdict):
        return "There is nothing to add." + " No model makes up for noise of the EMG." * bool(verdict["effects"])
    if not verdict["command"]:
        return "The model that was found, named in the settings as below, is then trained and compared in every run."
    return (
        "Typed in the project's folder with its environment active (. .venv/bin/activate), this trains the network "
        "with the model that was found, and shows it below beside what is there:"
    )
