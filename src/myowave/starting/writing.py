"""Words of YAML: scalars and lists, quoted only where they must be."""

import json
import re
from collections.abc import Iterable

_PLAIN = re.compile(r"[A-Za-z][A-Za-z0-9_.\-]*")
_TAKEN = {"yes", "no", "on", "off", "true", "false", "null", "y", "n"}


def scalar(value: str | float) -> str:
    """Text, quoted where YAML would read something else, or a number."""
    if not isinstance(value, str):
        return f"{value:g}"
    return value if _PLAIN.fullmatch(value) and value.lower() not in _TAKEN else json.dumps(value, ensure_ascii=False)


def inline_list(values: Iterable[str]) -> str:
    """A list on one line."""
    return f"[{', '.join(map(scalar, values))}]"
