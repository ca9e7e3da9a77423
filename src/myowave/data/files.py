"""Files that paths and patterns of the settings name."""

import re
import shlex
from collections.abc import Collection, Iterator, Sequence
from glob import glob
from pathlib import Path
from time import ctime, time

from myowave.data.problems import say_once
from myowave.settings.files import require_regular
from myowave.settings.section import NOT_PLAIN, PLAIN

SKEW_S = 5.0  # by how much clocks of two machines may differ [s]


def all_files(key: str, patterns: Sequence[str]) -> list[Path]:
    """Files that paths and patterns stand for, each once.

    Args:
        key: of the settings that they are from, for messages.
        patterns: paths, or patterns with * ? [ ].

    Raises:
        ValueError: one line for patterns without a file, link to nothing, and file that the workflow cannot use.
    """
    found: dict[Path, None] = {}
    problems = []
    for pattern in patterns:
        try:
            found |= dict.fromkeys(look_up(pattern))
        except ValueError as error:
            problems.append(str(error))
    problems += [problem for path in found for problem in _unusable(path)]
    if problems:
        raise ValueError("\n".join(f"{key}: {problem}" for problem in say_once(problems)))
    return list(found)


def _unusable(path: Path) -> Iterator[str]:
    if set("{}") & set(str(path)):  # they would be placeholders
        yield f"{path} holds braces; rename the file or folder."
    if (dated := path.stat().st_mtime) > time() + SKEW_S:
        yield (
            f"{path}: its date is in the future ({ctime(dated)}), so that all made of it would look older. Give it "
            f"that of now: touch {shlex.quote(str(path))}"
        )


def name_trials(paths: Sequence[Path], endings: Collection[str]) -> dict[str, Path]:
    """Trials that are named after their files, one each: {name: path}. A ValueError has a line for each file of
    another ending, name taken twice, or name that a trial cannot have."""
    trials: dict[str, Path] = {}
    problems = []
    for path in paths:
        if not re.fullmatch(PLAIN, path.stem):
            problems.append(f"{path}: {NOT_PLAIN}, which is named after its file.")
        elif path.suffix.lower() not in endings:
            problems.append(f"{path}: the ending is {path.suffix!r}; expected {' or '.join(endings)}.")
        elif trials.setdefault(path.stem, path) is not path:
            problems.append(
                f"{path}: another trial is called {path.stem!r} as well ({trials[path.stem]}); trials are named after "
                "their files, so rename one."
            )
    if problems:
        raise ValueError("\n".join(problems))
    return trials


def look_up(pattern: str) -> list[Path]:
    """Files that a path or pattern stands for, in natural order (trial2 before trial10), hidden ones only where it says
    so, and `~$` files, by which Office says that it has one open, never. A ValueError if there is none, or one is a
    link to nothing, a pipe, a device or far too large."""
    found = (Path(name) for name in sorted(glob(pattern, recursive=True), key=natural))
    matches = [path for path in found if not path.name.startswith("~$")]
    for path in matches:
        require_regular(path)
    files = [path for path in matches if path.is_file()]
    if not files:
        raise ValueError(_nothing_found(pattern))
    return files


def natural(text: str) -> list[tuple[int, int | str]]:
    """Key of the natural order, in which numbers count as numbers."""
    return [(0, int(part)) if part.isdecimal() else (1, part) for part in re.split(r"(\d+)", text)]


def _nothing_found(pattern: str) -> str:
    """Where a pattern without a match was looked up, and what is there instead."""
    tried = Path.cwd() / pattern
    folder = next(one for one in tried.parents if one.is_dir())
    inside = sorted(path.name + "/" * path.is_dir() for path in folder.iterdir() if not path.name.startswith("."))
    listed = ", ".join(inside[:12]) + (f" and {len(inside) - 12} more" if len(inside) > 12 else "")
    return (
        f"{pattern}: no such file; looked for {tried}. The folder {folder} holds {listed or 'nothing'}. Correct the "
        "name, or start from the folder that it is relative to."
    )
