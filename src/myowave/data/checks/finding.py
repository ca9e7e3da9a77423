"""A finding, what is doubtful in a recording and what to do about it; and a check, which finds it."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

Severity = Literal["warning", "note"]


@dataclass(frozen=True)
class Finding:
    """One doubt about a recording."""

    check: str  # which check found it, such as `mains hum`
    found: str  # what was found, with numbers and units
    do: str
    trial: str = ""  # which trial; empty for the whole session
    signal: str = ""  # which channel or angle; empty where it is about more than one
    severity: Severity = "warning"  # warning: look at it before trusting a result; note: good to know


@dataclass(frozen=True)
class Check:
    """A doubt that a recording may raise."""

    name: str  # in few words
    finds: Callable[[Any], str | None]  # in what it looks at, in words; empty or None for no doubt
    do: str  # what to do about it: the likely cause, and the setting that mends it
    severity: Severity = "warning"

    def of(self, what: Any, trial: str = "", signal: str = "") -> Iterator[Finding]:
        if found := self.finds(what):
            yield Finding(self.name, found, self.do, trial, signal, self.severity)


def find_all(checks: Iterable[Check], what: Any, trial: str = "", signal: str = "") -> Iterator[Finding]:
    """What several checks find."""
    return (finding for check in checks for finding in check.of(what, trial, signal))


def report(dataset: str, findings: Sequence[Finding], gains: Mapping[str, float]) -> dict[str, Any]:
    """Findings as plain data, with a summary in a sentence and a line for each check, warnings first."""
    warnings = [finding for finding in findings if finding.severity == "warning"]
    kinds = list(dict.fromkeys(finding.check for finding in warnings))
    count = f"{len(warnings)} warning" + "s" * (len(warnings) != 1)
    alike: dict[tuple[str, str, str], list[Finding]] = {}
    for one in sorted(findings, key=lambda finding: finding.severity == "note"):
        alike.setdefault((one.severity, one.check, one.do), []).append(one)
    return {
        "dataset": dataset,
        "summary": f"{count} ({', '.join(kinds)})" if warnings else "no warnings",
        "lines": [_line(group) for group in alike.values()],
        "findings": [asdict(finding) for finding in findings],
        "counts_as_1": dict(gains),
    }


def in_sentences(report: Mapping[str, Any]) -> list[str]:
    """Warnings of a report in sentences: where, which check, what it found, what to do."""
    lines = (line for line in report["lines"] if line["severity"] == "warning")
    return [f"{': '.join(filter(None, (one['where'], one['check'], one['found'])))}. {one['do']}" for one in lines]


def _line(group: Sequence[Finding]) -> dict[str, str]:
    """Findings of one check as one line: where, what was found in the first place, what to do."""
    where = [", ".join(filter(None, (one.trial and f"trial {one.trial}", one.signal))) for one in group]
    where = [place for place in dict.fromkeys(where) if place]
    more = f" and {len(where) - 3} more" if len(where) > 3 else ""
    found = "in the first, " * (len(where) > 1) + group[0].found
    return {**asdict(group[0]), "found": found, "where": "; ".join(where[:3]) + more}
