"""What a verdict is worth where the truth is known. Nothing that decides a verdict imports this."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any, Literal

from myowave.diagnosis.causes import EMG_NOISE, LEFT

LARGEST_CLASS = 3  # members of a class that is still an answer
UNSURE = (*LEFT, "undecidable")  # verdicts that claim no more than that something is or may be missing

Named = tuple[tuple[str, ...], ...]
Grade = Literal["right", "class", "honest", "silent", "wrong"]


def answer(causes: Sequence[str], alternatives: Sequence[Sequence[str]]) -> Named:
    """What a verdict names: one class for each cause, of the cause only where the data tell it from all others, which
    stand behind it in `alternatives`."""
    classes = {members[0]: tuple(members) for members in alternatives}
    return tuple(classes.get(c, (c,)) for c in causes)


def is_wrong(named: Named, true: Collection[str]) -> bool:
    """Whether something is named, by itself or as a class, of which nothing is true."""
    return any(not set(members) & set(true) for members in named)


def grade(kind: str, named: Named, true: Collection[str], wanted: Collection[str] | None = None) -> Grade:
    """What an answer is worth.

    Wrong: a name, or a class without any, that is not true; or that something is missing where nothing is. Silent: what
    shows is not named, and nothing is said to be missing. Honest: it is not named, and this is said; or in a class
    larger than `LARGEST_CLASS`. Class: in a smaller one. Right: named, with nothing said to be missing beside it.

    Args:
        true: all names that are true of the arm, `OUTSIDE` where something that the catalogue lacks shows.
        wanted: those that show in the trials, and so have to be named; all that are true where this is not known.
    """
    wanted = set(true if wanted is None else wanted)
    if is_wrong(named, true) or (kind in LEFT and not true):
        return "wrong"
    if kind in UNSURE:
        return "honest"
    if wanted - {name for members in named for name in members}:
        return "silent"
    largest = max((len(members) for members in named), default=1)
    return "right" if largest == 1 else "class" if largest <= LARGEST_CLASS else "honest"


def add_truth(summary: Mapping[str, Any], truth: Mapping[str, Any] | None) -> dict[str, Any]:
    """verdict.json: the summary with the true value of each parameter, the error of its estimate in percent, the
    effects that were hidden in the data, and what the verdict is worth (`grade`); null where the truth is not known, as
    of a measured dataset."""
    parameters = {
        model: {name: {**entry, **_against(entry["value"], name, truth)} for name, entry in values.items()}
        for model, values in summary["parameters"].items()
    }
    if truth is None:
        return {**summary, "parameters": parameters, "hidden": None, "grade": None, "hit": None}
    hidden = [*truth["effects"], *([EMG_NOISE] if truth.get("recorder_noise") else [])]
    named = answer(summary["effects"], summary["alternatives"])
    worth = grade(summary["verdict"], named, hidden)
    return {**summary, "parameters": parameters, "hidden": hidden, "grade": worth, "hit": worth in ("right", "class")}


def _against(value: float, name: str, truth: Mapping[str, Any] | None) -> dict[str, float | None]:
    """The true value of a parameter, 0 for that of an effect the data lack, and the error in percent of it."""
    if truth is None:
        return {"true": None, "error_pct": None}
    true = truth["parameters"].get(name, 0.0)
    return {"true": true, "error_pct": None if true == 0.0 else 100.0 * (value / true - 1)}
