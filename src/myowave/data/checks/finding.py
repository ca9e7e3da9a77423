"""A finding, what is doubtful in a recording and what to do about it; and a check, which finds it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np

from myowave.data.processing.sampled import Sampled

Severity = Literal["warning", "note"]
SAME = 50
"""Different values that a signal has which is in two trials alike, from which it was copied [-]."""


@dataclass(frozen=True)
class Finding:
    """One doubt about a recording.

    Args:
        check: which check found it, such as `mains hum`.
        found: what was found, with numbers and units.
        do: what to do.
        trial: which trial; empty for the whole session.
        signal: which channel or angle; empty where it is about more than one.
        severity: warning: look at it before trusting a result; note: good to know.
    """

    check: str
    found: str
    do: str
    trial: str = ""
    signal: str = ""
    severity: Severity = "warning"


@dataclass(frozen=True)
class Check:
    """A doubt that a recording may raise.

    Args:
        name: in few words.
        finds: what it finds in what it looks at, in words; empty, or nothing, where there is no doubt.
        do: what to do about it: the likely cause, and the setting that mends it.
    """

    name: str
    finds: Callable[[Any], str | None]
    do: str
    severity: Severity = "warning"

    def of(self, what: Any, trial: str = "", signal: str = "") -> Iterator[Finding]:
        """The finding in something, if there is one."""
        if found := self.finds(what):
            yield Finding(self.name, found, self.do, trial, signal, self.severity)


@dataclass(frozen=True, eq=False)
class Looked:
    """A signal of a trial that checks look at.

    Args:
        raw: as recorded, with the sign and offset of the settings.
        earlier: the same signal in trials before, by name.
    """

    raw: Sampled
    earlier: Mapping[str, Sampled] = field(default_factory=dict, kw_only=True)


def _copied(of: Looked) -> str | None:
    """The earlier trial in which a signal is the same, sample for sample."""
    values = of.raw.values
    for trial, other in of.earlier.items():
        samples = min(len(values), len(other.values))
        if np.array_equal(values[:samples], other.values[:samples]) and len(np.unique(values)) >= SAME:
            return f"the same samples as in trial {trial}"
    return None


COPIED = Check(
    "same recording again",
    _copied,
    "One file may have been taken twice: correct file or column, unless it is what drove the trials.",
)


def report(dataset: str, findings: Sequence[Finding], gains: Mapping[str, float]) -> dict[str, Any]:
    """Findings as plain data, with a summary in a sentence and a line for each check, warnings first."""
    warnings = [finding for finding in findings if finding.severity == "warning"]
    kinds = list(dict.fromkeys(finding.check for finding in warnings))
    count = f"{len(warnings)} warning" + "s" * (len(warnings) != 1)
    alike: dict[tuple[bool, str, str], list[Finding]] = {}
    for one in findings:
        alike.setdefault((one.severity != "warning", one.check, one.do), []).append(one)
    return {
        "dataset": dataset,
        "summary": f"{count} ({', '.join(kinds)})" if warnings else "no warnings",
        "lines": [_line(group) for _, group in sorted(alike.items(), key=lambda pair: pair[0][0])],
        "findings": [asdict(finding) for finding in findings],
        "counts_as_1": dict(gains),
    }


def _line(group: Sequence[Finding]) -> dict[str, str]:
    """Findings of one check as one line: where, what was found first, what to do."""
    first = group[0]
    places = dict.fromkeys(", ".join(filter(None, (one.trial and f"trial {one.trial}", one.signal))) for one in group)
    where = [place for place in places if place]
    more = f" and {len(where) - 3} more" if len(where) > 3 else ""
    told = {"check": first.check, "where": "; ".join(where[:3]) + more, "found": first.found, "do": first.do}
    return {**told, "severity": first.severity}
