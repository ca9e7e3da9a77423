"""A finding: what is doubtful in a recording, and what to do about it."""

from dataclasses import asdict, dataclass
from typing import Literal


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
    severity: Literal["warning", "note"] = "warning"

    def to_json(self) -> dict[str, str]:
        """As plain data."""
        return asdict(self)
