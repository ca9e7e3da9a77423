"""Facts on disk: JSON, and files that are never half written. Light enough for the workflow's rules."""

import json
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Write a file in one step: yields a temporary path beside `path` that takes its place if the block succeeds.

    A reader, or a run that is killed half-way, never sees half a file; an OSError names `path`.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        if str(error.filename) == str(temporary):
            error.filename = str(path)
        raise
    finally:
        temporary.unlink(missing_ok=True)


def number_or_none(value: float) -> float | None:
    """A number for JSON; None where it is infinite or none."""
    return float(value) if math.isfinite(value) else None


def write_json(content: Mapping[str, Any], path: str | Path) -> None:
    """Write facts, None where there is no number: JSON has neither NaN nor infinity, and a ValueError refuses them."""
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def read_json(path: str | Path) -> Any:
    """What a file holds; a ValueError for one that is not JSON, an OSError for one that is not there."""
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{path}: this is not JSON ({error}). Correct the file, or remove it.") from None
