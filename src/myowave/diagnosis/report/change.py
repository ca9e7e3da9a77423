"""What changed, in facts, in sentences and on a page."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from myowave.diagnosis.changed.ask import Answered, Change
from myowave.diagnosis.report.numbers import number, two_digits
from myowave.diagnosis.report.templates import fill
from myowave.diagnosis.report.words import explained, titled


def changed_facts(dataset: str, found: Answered) -> dict[str, Any]:
    """All that the page tells, as plain data; no sentence."""
    families = [found.arm, *([found.electrodes] if found.electrodes else [])]
    likeliest: dict[str, Change] = {}
    for change in (c for family in families for c in family.changes):
        likeliest.setdefault(change.effect, change)
    order = {name: place for place, name in enumerate(found.names)}
    ranked = sorted(likeliest.values(), key=lambda c: (order.get(c.effect, len(order)), -c.probability))
    control = found.control
    return {
        "dataset": dataset,
        "reference": list(found.reference),
        "against": list(found.against),
        "electrodes_stayed": found.electrodes is None,
        "class": list(found.names),
        "unchanged": min(family.unchanged for family in families),
        "changes": [
            {
                "effect": c.effect,
                "title": c.title,
                "electrode": c.electrode,
                "value": c.value,
                "low": c.interval[0],
                "high": c.interval[1],
                "unit": c.unit,
                "nats": c.nats / found.scale,
                "probability": c.probability,
            }
            for c in ranked
        ],
        "control": None if control is None else {"class": list(control.names), "unchanged": control.unchanged},
        "scale": found.scale,
        "left_out": list(found.left_out),
    }


def tell_change(facts: Mapping[str, Any]) -> list[str]:
    """The sentences of the page, the answer first."""
    named = [change for change in facts["changes"] if change["effect"] in facts["class"]]
    against, reference = ", ".join(facts["against"]), ", ".join(facts["reference"])
    if not named:
        first = (
            f"Nothing that a candidate explains has changed in {against} against {reference} (probability of no change "
            f"{facts['unchanged']:.2g})."
        )
    else:
        first = f"In {against} against {reference} this has changed: " + ", or ".join(map(_amount, named)) + "."
        if len(named) > 1:
            first += " The trials do not tell these apart; the likeliest stands first."
    control = facts["control"]
    if control is None:
        second = "There is no control, as the first group has one trial: record two or more before you believe a name."
    elif control["class"]:
        second = (
            f"The same question within the first group, split in two, finds {', '.join(control['class'])} where "
            "nothing should have changed: do not believe the name."
        )
    else:
        second = (
            "The same question within the first group, split in two, finds nothing, as it should (probability of no "
            f"change {control['unchanged']:.2g})."
        )
    third = (
        "The electrodes are said to have stayed on, so EMG of the second group means what it did in the first."
        if facts["electrodes_stayed"]
        else "Nobody said that the electrodes stayed on (changed.electrodes_stayed): where they were placed anew, "
        "another gain of the EMG looks like another load or strength."
    )
    return [first, second, third]


def _amount(change: Mapping[str, Any]) -> str:
    at = f" at {change['electrode']}" if change["electrode"] else ""
    unit = "" if change["unit"] == "-" else f" {change['unit']}"
    low, high = (two_digits(change[end]) for end in ("low", "high"))
    return f"{change['title']} ({change['effect']}{at}) by {change['value']:+.2g}{unit} (95 %: {low} to {high})"


def change_page(facts: Mapping[str, Any], template: Path) -> str:
    """The page as HTML.

    Args:
        template: changed.html.j2.
    """
    titles = {change["effect"]: change["title"] for change in facts["changes"]}
    rows = [
        {
            "effect": change["effect"],
            "electrode": change["electrode"],
            "change": f"{number(change['value'])} {change['unit']}".removesuffix(" -"),
            "95 %": f"{number(change['low'])} to {number(change['high'])}",
            "nats": f"{change['nats']:.1f}",
            "probability": f"{change['probability']:.2g}",
        }
        for change in facts["changes"]
    ]
    content = {
        "facts": facts,
        "told": tell_change(facts),
        "candidates": pd.DataFrame(rows),
        "explained": partial(explained, titles=titles),
        "titled": partial(titled, titles=titles),
        "named": str,
    }
    return fill(template, content)
