"""Answers, their grades, and what they come to."""

from collections.abc import Iterable, Mapping
from itertools import combinations
from typing import Any

import pandas as pd

from myowave.data.trials import Trials
from myowave.diagnosis.changed.ask import what_changed
from myowave.physics.effect import Effect
from myowave.physics.model import Model
from myowave.settings import Scatter
from studies.changed.questions import HEAVY, LIGHT, PERSON, Question, trials_of
from studies.shared import GRADES, markdown

HEADS = {"done": "what was done", "of": "arm"}


def answer(
    question: Question,
    person: Trials,
    bases: Mapping[str, Model],
    effects: Iterable[Effect],
    scatter: Mapping[str, Scatter],
) -> dict[str, Any]:
    """A row of the table: the question, what is said, and its grade.

    Args:
        bases: the models of the person's arm, `PERSON`, and of the simulated ones, "arm".
    """
    base = bases[PERSON if question.of == PERSON else "arm"]
    found = what_changed(trials_of(question, person, base), base, effects, question.groups, scatter)
    said = [found.of(name) for name in found.names if name in question.truth]
    size, low, high = (said[0].value, *said[0].interval) if said else (None, None, None)
    return {
        "of": question.of,
        "done": question.done,
        "reference": " ".join(question.groups.reference),
        "against": " ".join(question.groups.against),
        "seed": question.seed,
        "verdict": found.verdict,
        "names": " ".join(found.names),
        "unchanged": round(min(family.unchanged for family in found.families), 3),
        "control": "" if found.control is None else " ".join(found.control.names),
        **{"size_true": question.size, "size_found": size, "size_low": low, "size_high": high},
        "grade": grade(question.truth, found.names, found.verdict),
    }


def grade(truth: frozenset[str], names: tuple[str, ...], verdict: str) -> str:
    """Right: what was done and nothing else, or any of its names; class: beside others. Where nothing was done, any
    name is wrong; where something was, to say that nothing changed is to miss it."""
    if not names:
        return "honest" if verdict == "undecidable" else "silent" if truth else "right"
    if not truth & set(names):
        return "wrong"
    return "right" if set(names) <= truth else "class"


def table(rows: pd.DataFrame, by: str) -> str:
    """How many answers of each grade, by what was done or by what it was done to."""
    lines = []
    for name, group in rows.groupby(by, sort=False):
        counts = [str(n) if (n := int(group["grade"].eq(g).sum())) else "" for g in GRADES]
        sized = group.dropna(subset=["size_true", "size_low"])
        held = sized["size_true"].between(sized["size_low"], sized["size_high"]).sum()
        ends = sized["size_found"].agg(["min", "max"])
        true = sized["size_true"].unique()
        size = f"{ends['min']:.2g} to {ends['max']:.2g} ({true[0]:.3g})" if len(true) == 1 else ""
        lines.append([str(name), *counts, size, f"{held} of {len(sized)}" if len(sized) else ""])
    return markdown([HEADS[by], *GRADES.values(), "size found (true)", "95 % intervals that hold it"], lines)


def trials_needed(rows: pd.DataFrame) -> dict[int, int]:
    """In how many of the 20 orders of the person's loads the load is named alone after so many trials, {trials:
    orders}; of a load trials come in their order."""
    right = {(r.reference, r.against) for r in rows[rows["grade"] == "right"].itertuples()}
    after: dict[int, int] = {}
    for heavy in combinations(range(6), 3):
        for count in range(2, 7):
            more = sum(place < count for place in heavy)
            if (" ".join(LIGHT[: count - more]), " ".join(HEAVY[:more])) in right:
                after[count] = after.get(count, 0) + 1
                break
    return after
