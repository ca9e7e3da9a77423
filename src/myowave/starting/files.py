"""The recordings in a folder: which files there are, what format each has, and how their names make trials of them."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from myowave.data.files import natural
from myowave.data.readers import ENDINGS, delsys, ending_of, noraxon, vicon
from myowave.data.readers.text import read_head
from myowave.settings.recording import TRIAL

_HEAD = 60
_MVC = ("mvc", "mvic")
_SEPARATORS = "_ \\-"
_MOST = 20_000  # files that are looked at


@dataclass(frozen=True)
class Naming:
    """How the names of files make trials of them.

    Args:
        trials: names of the trials, in natural order.
        patterns: files relative to the folder, {trial} for the trial's name; each is there for every trial.
        mvc: names of recordings of maximum contractions.
        left_out: files that are of no trial.
    """

    trials: tuple[str, ...]
    patterns: tuple[str, ...]
    mvc: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()


def recordings_in(folder: Path) -> list[PurePosixPath]:
    """Files in a folder, and in those in it, whose ending is one that a reader knows; relative, in natural order.

    Raises:
        ValueError: if there is no such folder, no such file in it, or far too many.
    """
    if not folder.is_dir():
        raise ValueError(f"{folder}: no such folder; expected one with recordings. Name it with --from.")
    found: list[PurePosixPath] = []
    other: Counter[str] = Counter()
    for path in folder.rglob("*"):
        relative = PurePosixPath(path.relative_to(folder).as_posix())
        if any(part.startswith(".") for part in relative.parts) or not path.is_file():
            continue
        if ending_of(path) in ENDINGS:
            found.append(relative)
        else:
            other[path.suffix or "no ending"] += 1
        if len(found) > _MOST:
            raise ValueError(f"{folder}: more than {_MOST} recordings; name the folder of one dataset with --from.")
    if not found:
        held = ", ".join(f"{count} files {ending}" for ending, count in other.most_common(5)) or "nothing"
        raise ValueError(
            f"{folder}: no recording in it; found {held}, expected files that end in {', '.join(ENDINGS)} (text also "
            "as .gz). Export the recordings in one of these formats, or name another folder with --from."
        )
    return sorted(found, key=lambda path: natural(str(path)))


def format_of(path: Path) -> str:
    """The reader's name for a file: by its ending, and tables of text by their first rows.

    Raises:
        ValueError: if a table of text is no text.
    """
    form = ENDINGS[ending_of(path)]
    if form == "csv":
        lines = read_head(path, _HEAD)
        if lines and noraxon.is_header(lines[0]):
            return "noraxon"
        if any(map(delsys.is_header, lines)):
            return "delsys"
        if any(map(vicon.is_header, lines)):
            return "vicon"
    return form


def name_trials(files: Sequence[PurePosixPath]) -> list[Naming]:
    """Ways to split names into a trial and the rest, such as `{trial}/biceps.csv` or `{trial}_emg.csv`, the best first.

    Best is what leaves out the fewest files, goes by folders, and needs the fewest files per trial; among equals the
    longest name.
    """
    deepest = max(len(path.parts) - 1 for path in files)
    most = max(len(_tokens(path)) for path in files)
    ways = [(0, _by_folder(files, depth)) for depth in range(1, deepest + 1)]
    ways += [(1, _by_name(files, start, end)) for start in range(most) for end in _ends(start, most)]
    namings = [(kind, naming) for kind, split in ways if (naming := _naming(files, split))]

    def badness(one: tuple[int, Naming]) -> tuple[int, int, int, int]:
        kind, naming = one
        return len(naming.left_out), kind, len(naming.patterns), -sum(map(len, naming.trials))

    return list(dict.fromkeys(naming for _, naming in sorted(namings, key=badness)))


Split = dict[PurePosixPath, tuple[str, str]]
"""Trial and pattern of each file."""


def _by_folder(files: Sequence[PurePosixPath], depth: int) -> Split:
    """Trials are folders, 1 for that in which a file lies; their name may be in that of the file as well."""
    split = {}
    for path in files:
        if len(path.parts) > depth:
            before, trial = path.parts[: -depth - 1], path.parts[-depth - 1]
            alone = rf"(?<![A-Za-z0-9]){re.escape(trial)}(?![A-Za-z0-9])"
            split[path] = (trial, "/".join([*before, TRIAL, *(re.sub(alone, TRIAL, p) for p in path.parts[-depth:])]))
    return split


def _ends(start: int, most: int) -> Iterator[int | None]:
    """Where a range of tokens may end: with the last, so many before it, or so many after the first."""
    yield None
    yield from range(-1, start - most, -1)
    yield from range(start + 1, most)


def _by_name(files: Sequence[PurePosixPath], start: int, end: int | None) -> Split:
    """Trials are the files' names, tokens from `start` to `end` of them."""
    split = {}
    for path in files:
        tokens = _tokens(path)
        part = "".join(tokens[start:end])
        if trial := part.lstrip(_SEPARATORS):
            head = "".join(tokens[:start]) + part.removesuffix(trial)
            tail = path.name[len(head) + len(trial) :]
            split[path] = (trial, "/".join([*path.parts[:-1], head + TRIAL + tail]))
    return split


def _tokens(path: PurePosixPath) -> list[str]:
    """Parts of a file's name without its ending, each with the separator before it: `t1_emg` is `t1`, `_emg`."""
    name = path.name[:-3] if path.name.lower().endswith(".gz") else path.name
    return re.findall(rf"[{_SEPARATORS}]*[^{_SEPARATORS}]+", name.rsplit(".", 1)[0])


def _naming(files: Sequence[PurePosixPath], split: Split) -> Naming | None:
    """The trials of a split: those which have all the files that more than half of them have."""
    of_trial: dict[str, set[str]] = {}
    for trial, pattern in split.values():
        of_trial.setdefault(trial, set()).add(pattern)
    mvc = {name for name in of_trial if any(word in name.lower() for word in _MVC)}
    counts = Counter(pattern for name, patterns in of_trial.items() if name not in mvc for pattern in patterns)
    core = {pattern for pattern, count in counts.items() if 2 * count > len(of_trial) - len(mvc)}
    trials = sorted((n for n, patterns in of_trial.items() if n not in mvc and core <= patterns), key=natural)
    if len(trials) < 2 or not core:
        return None
    kept_mvc = sorted((name for name in mvc if core & of_trial[name]), key=natural)
    kept = {(name, pattern) for name in (*trials, *kept_mvc) for pattern in core}
    left_out = [str(path) for path in files if split.get(path) not in kept]
    return Naming(tuple(trials), tuple(sorted(core, key=natural)), tuple(kept_mvc), tuple(left_out))
