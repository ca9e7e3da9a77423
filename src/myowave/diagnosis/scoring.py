"""What a verdict is worth where the truth is known. Nothing that decides a verdict imports this."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from myowave.diagnosis.causes import EMG_NOISE

LARGEST_CLASS = 2  # effects that data do not tell apart and that still count as an answer

Answer = tuple[tuple[str, ...], ...]


def answer(causes: Sequence[str], alternatives: Sequence[Sequence[str]]) -> Answer:
    """What a verdict names: one class for each cause, of the cause only where the data tell it from all others.

    Args:
        causes: that it names, in the order they were added.
        alternatives: classes of those that others stand in for equally well, the accepted effect first.
    """
    classes = {members[0]: tuple(members) for members in alternatives}
    return tuple(classes.get(name, (name,)) for name in causes)


def is_right(named: Answer, hidden: Collection[str]) -> bool:
    """Whether each hidden effect was named, by itself or in a class of at most two, and no other."""
    return holds(named, hidden) and len(named) == len(hidden)


def holds(named: Answer, hidden: Collection[str]) -> bool:
    """Whether each hidden effect was named, by itself or in a class of at most two, maybe beside others."""
    return all(any(effect in members and len(members) <= LARGEST_CLASS for members in named) for effect in hidden)


def add_truth(summary: Mapping[str, Any], truth: Mapping[str, Any] | None) -> dict[str, Any]:
    """verdict.json: the summary with the true value of each parameter, the error of its estimate in percent, the
    effects that were hidden in the data, and whether the verdict is right; null where the truth is not known.

    Args:
        summary: from `report.facts.verdict_facts`.
        truth: of a simulated dataset; None for a measured one.
    """
    parameters = {
        model: {name: {**entry, **_against(entry["value"], name, truth)} for name, entry in values.items()}
        for model, values in summary["parameters"].items()
    }
    if truth is None:
        return {**summary, "parameters": parameters, "hidden": None, "hit": None}
    hidden = [*truth["effects"], *([EMG_NOISE] if truth.get("recorder_noise") else [])]
    named = answer(summary["effects"], summary["alternatives"])
    hit = is_right(named, hidden) and (bool(hidden) or summary["verdict"] == "adequate")
    return {**summary, "parameters": parameters, "hidden": hidden, "hit": hit}


def _against(value: float, name: str, truth: Mapping[str, Any] | None) -> dict[str, float | None]:
    """The true value of a parameter, 0 for that of an effect the data lack, and the error in percent of it."""
    if truth is None:
        return {"true": None, "error_pct": None}
    true = truth["parameters"].get(name, 0.0)
    return {"true": true, "error_pct": None if true == 0.0 else 100.0 * (value / true - 1)}
