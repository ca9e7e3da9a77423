"""What changed between two groups of trials: in facts, in sentences and on a page."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import pandas as pd

from myowave.diagnosis.causes import NAMED
from myowave.diagnosis.changed.ask import Answered, Change
from myowave.diagnosis.report.numbers import signed
from myowave.diagnosis.report.templates import fill, paragraphs, templates, with_unit

LEAST = 0.001  # no smaller probability is told


def changed_facts(dataset: str, found: Answered) -> dict[str, Any]:
    """All that the page tells, as plain data; no sentence."""
    order, control = dict.fromkeys([*found.names, *(change.effect for change in found.changes)]), found.control
    return {
        "dataset": dataset,
        **found.groups.model_dump(mode="json"),
        "verdict": found.verdict,
        "class": list(found.names),
        "unchanged": min(family.unchanged for family in found.families),
        "sure": NAMED,
        "changes": [_facts_of(found.of(name)) for name in order],
        "control": control
        and {"verdict": control.verdict, "class": list(control.names), "unchanged": control.unchanged},
        "known": list(found.known),
        "left_out": dict(found.left_out),
    }


def _facts_of(change: Change) -> dict[str, Any]:
    """A change as plain data; None for the log evidence of one that needed no weighing."""
    facts = asdict(change) | {"low": change.interval[0], "high": change.interval[1]}
    return facts | {name: None for name in ("changed", "anyway") if facts[name] == -math.inf}


def tell_change(facts: Mapping[str, Any]) -> list[str]:
    """The sentences of the page, the answer first, as they stand in changed.j2."""
    named = [change for change in facts["changes"] if change["effect"] in facts["class"]]
    return paragraphs(templates().get_template("changed.j2").render(facts=facts, named=named))


def change_page(facts: Mapping[str, Any]) -> str:
    """The page as HTML."""
    titles = {change["effect"]: change["title"] for change in facts["changes"]}
    rows = [
        {
            "effect": change["effect"],
            "electrode": change["electrode"],
            "change": signed(change["value"]) + with_unit(change["unit"]),
            "95 % interval": f"{signed(change['low'])} to {signed(change['high'])}{with_unit(change['unit'])}",
            **{
                head: "" if change[name] is None else f"{change[name]:.1f}"
                for head, name in (("changed [nats]", "changed"), ("trials differ [nats]", "anyway"))
            },
            "probability": f"{change['probability']:.2g}" if change["probability"] >= LEAST else f"under {LEAST}",
        }
        for change in facts["changes"]
    ]
    cells = pd.DataFrame(rows)
    content = {"facts": facts, "told": tell_change(facts), "candidates": cells.loc[:, (cells != "").any()]}
    return fill("changed.html.j2", titles, content)
