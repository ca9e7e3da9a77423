"""Files that paths and patterns of the settings name."""

import re
from collections.abc import Collection, Sequence
from pathlib import Path

from myowave.settings.section import odd_name


def find_files(
    dataset: str, patterns: Sequence[str], endings: Collection[str], root: str | Path = "."
) -> dict[str, Path]:
    """Files that the paths and patterns of a dataset name.

    Args:
        dataset: its name, for messages.
        patterns: paths, or patterns with * ? [ ], absolute or relative to `root`.
        endings: that a file may have, such as `.csv`.
        root: where relative ones start from.

    Returns:
        {trial name: path}, those of a pattern in natural order (trial2 before trial10).

    Raises:
        ValueError: one line for each pattern without a file, file of another kind or that is not there, name taken
            twice, or name that a trial cannot have.
    """
    found: dict[str, Path] = {}
    problems = []
    for pattern in patterns:
        matches = match_files(Path(root), pattern)
        if not matches:
            problems.append(nothing_found(Path(root), pattern))
        for path in matches:
            if broken := broken_link(path):
                problems.append(broken)
            elif why := odd_name(path.stem):
                problems.append(f"{path}: {why}, which is named after its file.")
            elif path.suffix.lower() not in endings:
                problems.append(f"{path}: the ending is {path.suffix!r}; expected {' or '.join(endings)}.")
            elif path.stem in found and found[path.stem] != path:
                problems.append(
                    f"{path}: another trial is called {path.stem!r} as well ({found[path.stem]}); trials are named "
                    "after their files, so rename one."
                )
            else:
                found[path.stem] = path
    if problems:
        raise ValueError(f"data.datasets.{dataset}.files:\n" + "\n".join(problems))
    return found


def all_files(key: str, patterns: Sequence[str], root: str | Path = ".") -> list[Path]:
    """Files that paths and patterns stand for, each once.

    Args:
        key: of the settings that they are from, for messages.

    Raises:
        ValueError: one line for each pattern without a file, link to nothing, and path with braces, which would be
            placeholders to the workflow.
    """
    found: dict[Path, None] = {}
    problems = []
    for pattern in patterns:
        if not (matches := match_files(Path(root), pattern)):
            problems.append(
                f"{pattern!r} matches no file, looked up from {Path(root).resolve()}. Correct the name, or run "
                "snakemake from the folder that the name starts from."
            )
        found |= dict.fromkeys(matches)
    problems += [broken for path in found if (broken := broken_link(path))]
    problems += [f"{path} holds braces; rename the file or folder." for path in found if set("{}") & set(str(path))]
    if problems:
        raise ValueError("\n".join(f"{key}: {problem}" for problem in problems))
    return list(found)


def broken_link(path: Path) -> str:
    """What is wrong with a link to a file that is not there; empty for all else."""
    if not path.is_symlink() or path.exists():
        return ""
    return f"{path}: a link to {path.readlink()}, which is not there. Put the file there, or remove the link."


def match_files(root: Path, pattern: str) -> list[Path]:
    """Files that a path or pattern stands for, in natural order, links to nothing among them."""
    if re.search(r"[*?\[]", pattern) is None:
        path = root / pattern
        return [path] if path.is_file() or broken_link(path) else []
    whole = root / pattern
    anchor = Path(whole.anchor) if whole.is_absolute() else Path()
    matches = anchor.glob(str(whole.relative_to(anchor)))
    return sorted(
        (path for path in matches if path.is_file() or broken_link(path)), key=lambda path: natural(str(path))
    )


def natural(text: str) -> list[tuple[int, int | str]]:
    """Key of the natural order, in which numbers count as numbers."""
    return [(0, int(part)) if part.isdigit() else (1, part) for part in re.split(r"(\d+)", text)]


def nothing_found(root: Path, pattern: str) -> str:
    """Where a pattern without a match was looked up, and what is there instead."""
    tried = root.resolve() / pattern
    folder = tried.parent
    while re.search(r"[*?\[]", str(folder)) or not folder.is_dir():
        folder = folder.parent
    inside = sorted(path.name + "/" * path.is_dir() for path in folder.iterdir() if not path.name.startswith("."))
    listed = ", ".join(inside[:12]) + (f" and {len(inside) - 12} more" if len(inside) > 12 else "")
    return f"{pattern}: no such file; looked for {tried}. The folder {folder} holds {listed or 'nothing'}."
