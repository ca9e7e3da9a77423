"""Answers beside the truth: the one place that reads it."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

RIVALS = ("lasso", "pysindy")
# Of answers, and what pages call them.
GRADES = {"named": "right", "class": "right in part", "honest": "left open", "silent": "missed", "wrong": "wrong"}
COLUMNS = [
    *("system", "kind", "withheld", "verdict", "names", "class", "size_true", "size_found", "size_low", "size_high"),
    *("error_before", "error_after", "grade", *RIVALS, "nearest", "masked"),
]


def grade(answer: Mapping[str, Any], truth: Mapping[str, Any]) -> str:
    """How good an answer is: named (all that is known to be missing), class (the same in classes, of which something
    like it may be a member), honest (says no more than that something is missing, or a part of it, or that constants
    may hide the rest), silent, or wrong (names what is not there, or says that nothing else is missing where it is).

    Args:
        answer: with `verdict`, `names`, `class` and `masked`, as `answer.answer_case` gives it.
        truth: of the case, as truth.yaml has it.
    """
    names, kind = answer["names"], answer["verdict"]
    if truth.get("nothing"):
        return "named" if kind == "adequate" else "honest" if kind == "undecidable" else "wrong"
    if not names:
        return "silent" if kind == "adequate" else "honest"
    lists = truth.get("names", [])
    alone = [{name} for name in names]
    meant = [{name}.union(*(c for c in answer["class"] if name in c)) for name in names]
    true = {name for one in lists for name in one}
    if any(not members & true for members in meant):
        return "wrong"
    unsaid = [one for one in lists if not any(members & set(one) for members in meant)]
    if truth.get("outside") or unsaid:  # it says that something else is missing or may be, or that nothing is
        may_be = not truth.get("outside") and all(set(one) & set(answer["masked"]) for one in unsaid)
        return "honest" if kind == "partial" or may_be else "wrong"
    return "named" if all(members & true for members in alone) and not answer["class"] else "class"


def score_cases(
    cases: Mapping[str, Mapping[str, Any]], answers: Mapping[str, Mapping[str, Any]], truth: Mapping[str, Any]
) -> pd.DataFrame:
    """A row for each case.

    Args:
        cases: settings of each, by name.
        answers: of the diagnosis, with what rivals name under `RIVALS`, by case.
        truth: as truth.yaml has it.
    """
    rows = []
    for name, case in cases.items():
        answer, true = answers[name], truth[name]
        size = next(iter(true.get("size", {}).items()), ("", float("nan")))
        found = answer["sizes"].get(size[0], [float("nan")] * 3)
        rows.append(
            {
                **{key: case[key] for key in ("system", "kind", "withheld")},
                "verdict": answer["verdict"],
                "names": ", ".join(answer["names"]),
                "class": "; ".join(" or ".join(members) for members in answer["class"]),
                **dict(zip(COLUMNS[6:10], (size[1], *found), strict=True)),
                **{key: answer[key] for key in ("error_before", "error_after")},
                "grade": grade(answer, true),
                **{rival: _told(answer[rival]) for rival in RIVALS},
                **{key: ", ".join(answer[key]) for key in ("nearest", "masked")},
            }
        )
    return pd.DataFrame(rows, columns=COLUMNS)


def _told(names: Sequence[str] | str) -> str:
    return names if isinstance(names, str) else ", ".join(names) or "nothing"
