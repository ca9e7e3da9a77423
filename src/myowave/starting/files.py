"""The recordings in a folder: which files there are, what format each has, and how their names make trials of them."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path, PurePosixPath

from myowave.data.files import natural
from myowave.data.readers import ENDINGS, delsys, ending_of, noraxon, vicon
from myowave.data.readers.text import read_lines
from myowave.settings.files import require_regular
from myowave.settings.recording import TRIAL

_HEAD = 60  # rows in which a text may say which program wrote it
_WRITTEN_BY = {"noraxon": noraxon.is_header, "delsys": delsys.is_header, "vicon": vicon.is_header}
_MVC = ("mvc", "mvic")
_SEPARATORS = "_ \\-"
_MOST = 20_000  # files that are looked at


@dataclass(frozen=True)
class Naming:
    """How the names of files make trials of them."""

    trials: tuple[str, ...]  # names of the trials, in natural order
    patterns: tuple[str, ...]  # relative to the folder, {trial} for the trial's name; each is there for every trial
    mvc: tuple[str, ...] = ()  # names of recordings of maximum contractions
    left_out: tuple[str, ...] = ()  # files that are of no trial


def recordings_in(folder: Path) -> list[PurePosixPath]:
    """Files in a folder, and in those in it, whose ending is one that a reader knows; relative, in natural order. A
    ValueError if there is no such folder, no such file in it, or far too many files."""
    if not folder.is_dir():
        raise ValueError(f"{folder}: no such folder; expected one with recordings. Name it with --from.")
    inside = list(islice(folder.rglob("*"), _MOST + 1))
    if len(inside) > _MOST:
        raise ValueError(f"{folder}: more than {_MOST} files; name the folder of one dataset with --from.")
    relative = [PurePosixPath(path.relative_to(folder).as_posix()) for path in inside if not path.is_dir()]
    files = [path for path in relative if not any(part.startswith((".", "~$")) for part in path.parts)]
    if odd := [path for path in files if re.search(r"[\x00-\x1f\x7f\ud800-\udfff]", str(path))]:
        raise ValueError(f"{folder}: {str(odd[0])!r} has a line break or a byte that is no UTF-8; rename it.")
    found = [path for path in files if ending_of(Path(path)) in ENDINGS]
    if not found:
        other = Counter(path.suffix or "no ending" for path in files)
        there = ", ".join(f"{count} files {ending}" for ending, count in other.most_common(5)) or "nothing"
        raise ValueError(
            f"{folder}: no recording in it; found {there}, expected files that end in {', '.join(ENDINGS)} (text also "
            "as .gz). Export the recordings in one of these formats, or name another folder with --from."
        )
    return sorted(found, key=lambda path: natural(str(path)))


def format_of(path: Path) -> str:
    """The reader's name for a file: by its ending, and tables of text by their first rows. A ValueError if a table of
    text is no text."""
    require_regular(path)
    form = ENDINGS[ending_of(path)]
    lines = read_lines(path, head_only=True)[:_HEAD] if form == "csv" else []
    return next((program for program, wrote in _WRITTEN_BY.items() if any(map(wrote, lines))), form)


def ways_to_name(files: Sequence[PurePosixPath], in_folders: bool = False) -> list[Naming]:
    """Ways to split names into a trial and the rest, such as `{trial}/biceps.csv` or `{trial}_emg.csv`, the best first.

    A trial's name is that of a folder, or some words in a row of the file's. Best is what leaves out the fewest files,
    goes by folders, and needs the fewest files per trial; among equals the longest name. Names of repetitions
    `in_folders` are those of folders and the first words of the file's: `2kg/rep1`.
    """
    deepest = max(len(path.parts) for path in files)
    most = max(len(_words(path)) for path in files)
    ends = (None, *range(1, most), *range(1 - most, 0))
    splits = [(True, {path: _by_folder(path, depth) for path in files}) for depth in range(1, deepest)]
    splits += [(False, {path: _by_words(path, a, b) for path in files}) for a in range(most) for b in ends]
    if in_folders:
        splits = [(True, {p: _by_words(p, 0, b, depth) for p in files}) for depth in range(1, deepest) for b in ends]
    namings = [(by_folder, naming) for by_folder, split in splits if (naming := _naming(split))]

    def badness(one: tuple[bool, Naming]) -> tuple[int, bool, int, int]:
        by_folder, naming = one
        return len(naming.left_out), not by_folder, len(naming.patterns), -sum(map(len, naming.trials))

    return list(dict.fromkeys(naming for _, naming in sorted(namings, key=badness)))


def _by_folder(path: PurePosixPath, depth: int) -> tuple[str, str]:
    """Trial and pattern where trials are folders, 1 for that of the file, whose name the file's may repeat."""
    above, trial = path.parts[: -depth - 1], "".join(path.parts[-depth - 1 : -depth])
    alone = rf"(?<![A-Za-z0-9]){re.escape(trial)}(?![A-Za-z0-9])"
    return trial, "/".join([*above, TRIAL, *(re.sub(alone, TRIAL, part) for part in path.parts[-depth:])])


def _by_words(path: PurePosixPath, start: int, end: int | None, depth: int = 0) -> tuple[str, str]:
    """Trial and pattern where trials are words `start` to `end` of a file's name, behind the names of the `depth`
    folders that it is in."""
    words = _words(path)
    before, part = "".join(words[:start]), "".join(words[start:end])
    trial = part.lstrip(_SEPARATORS)
    head = before + part.removesuffix(trial)
    above = path.parts[: -depth - 1]
    pattern = "/".join([*above, head + TRIAL + path.name[len(head) + len(trial) :]])
    return trial and "/".join([*path.parts[len(above) : -1], trial]), pattern


def _words(path: PurePosixPath) -> list[str]:
    """Words of a file's name without its ending, each with the separator before it: `t1_emg` is `t1`, `_emg`."""
    name = path.name[:-3] if path.name.lower().endswith(".gz") else path.name
    return re.findall(rf"[{_SEPARATORS}]*[^{_SEPARATORS}]+", name.rsplit(".", 1)[0])


def _naming(split: Mapping[PurePosixPath, tuple[str, str]]) -> Naming | None:
    """The trials of a split: those which have all the files that more than half of them have."""
    of_trial: dict[str, set[str]] = {}
    for trial, pattern in split.values():
        if trial:
            of_trial.setdefault(trial, set()).add(pattern)
    mvc = {name for name in of_trial if any(word in name.lower() for word in _MVC)}
    counts = Counter(pattern for name, patterns in of_trial.items() if name not in mvc for pattern in patterns)
    core = {pattern for pattern, count in counts.items() if 2 * count > len(of_trial) - len(mvc)}
    trials = sorted((n for n, patterns in of_trial.items() if n not in mvc and core <= patterns), key=natural)
    if len(trials) < 2 or not core:
        return None
    kept_mvc = sorted((name for name in mvc if core & of_trial[name]), key=natural)
    kept = {(name, pattern) for name in (*trials, *kept_mvc) for pattern in core}
    left_out = [str(path) for path, where in split.items() if where not in kept]
    return Naming(tuple(trials), tuple(sorted(core, key=natural)), tuple(kept_mvc), tuple(left_out))
