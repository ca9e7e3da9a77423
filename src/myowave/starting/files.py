"""The recordings in a folder: which files there are, what format each has, and how the names make trials of them."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from myowave.data.files import natural
from myowave.data.readers import ENDINGS, delsys, vicon
from myowave.data.readers.text import read_head
from myowave.settings.recording import TRIAL
from myowave.starting.words import plain, says_angle, says_emg

_TEXT = (".csv", ".tsv", ".txt")
_HEAD = 60
_NORAXON = "type,name,time_units"
_DELSYS = re.compile(r"^\W*Label:.*Sampling frequency", re.IGNORECASE)
_MVC = re.compile(r"\b(mvc|mvic|maximum)")
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
        if ending_of(relative) in ENDINGS:
            found.append(relative)
        else:
            other[path.suffix or "no ending"] += 1
        if len(found) > _MOST:
            raise ValueError(f"{folder}: more than {_MOST} recordings; name the folder of one study with --from.")
    if not found:
        held = ", ".join(f"{count} files {ending}" for ending, count in other.most_common(5)) or "nothing"
        raise ValueError(
            f"{folder}: no recording in it; found {held}, expected files that end in {', '.join(ENDINGS)} (text also "
            "as .gz). Export the recordings in one of these formats, or name another folder with --from."
        )
    return sorted(found, key=lambda path: natural(str(path)))


def ending_of(path: PurePosixPath | Path) -> str:
    """The ending in small letters, that before .gz where the file is packed."""
    suffixes = path.suffixes
    return (suffixes[-2] if len(suffixes) > 1 and suffixes[-1].lower() == ".gz" else path.suffix).lower()


def format_of(path: Path) -> str:
    """The reader's name for a file: by its ending, and tables of text by their first rows.

    Raises:
        ValueError: if a table of text is no text.
    """
    ending = ending_of(path)
    if ending in _TEXT:
        lines = read_head(path, _HEAD)
        if lines and lines[0].startswith(_NORAXON):
            return "noraxon"
        if any(_DELSYS.match(line) or delsys.is_header(line) for line in lines):
            return "delsys"
        if any(map(vicon.is_header, lines)):
            return "vicon"
    return ENDINGS[ending]


def name_trials(files: Sequence[PurePosixPath]) -> list[Naming]:
    """Ways to split names into a trial and the rest, such as `{trial}/biceps.csv` or `{trial}_emg.csv`, the best first.

    Best is what takes no word of a muscle or an angle for a trial, leaves out the fewest files, goes by folders, and
    needs the fewest files per trial; among equals the longest name.

    Raises:
        ValueError: if no way makes two trials.
    """
    namings = [(_badness(naming, kind), naming) for kind, naming in _namings(files)]
    namings = [(score, naming) for score, naming in namings if score[0] < 1]  # curl_emg and curl_angle are one trial
    if not namings:
        listed = ", ".join(map(str, files[:3])) + (", ..." if len(files) > 3 else "")
        raise ValueError(
            f"{len(files)} recordings ({listed}), but not two trials: expected the same files for each trial, such as "
            "trial1.csv and trial2.csv, or trial1/emg.csv and trial2/emg.csv. Rename them, or put each trial into a "
            "folder of its own. One long recording is cut into trials by cut_s, see docs/real_arm.md."
        )
    return [naming for _, naming in sorted(namings, key=lambda scored: scored[0])]


def _badness(naming: Naming, kind: int) -> tuple[float, int, int, int, int]:
    words = sum(says_emg(name) or says_angle(name) for name in naming.trials) / len(naming.trials)
    length = sum(len(name) for name in naming.trials)
    return words, len(naming.left_out), kind, len(naming.patterns), -length


def _namings(files: Sequence[PurePosixPath]) -> Iterator[tuple[int, Naming]]:
    """All ways that make at least two trials: 0 and those by folders, 1 and those by the files' own names."""
    deepest = max(len(path.parts) - 1 for path in files)
    most = max(len(_tokens(path)) for path in files)
    ways = [(0, _by_folder(files, depth)) for depth in range(1, deepest + 1)]
    ways += [(1, _by_name(files, start, end)) for start in range(most) for end in _ends(start, most)]
    for kind, split in ways:
        if naming := _naming(files, split):
            yield kind, naming


Split = dict[PurePosixPath, tuple[str, str]]
"""Trial and pattern of each file."""


def _by_folder(files: Sequence[PurePosixPath], depth: int) -> Split:
    """Trials are folders, 1 for that in which a file lies; their name may be in that of the file as well."""
    split = {}
    for path in files:
        if len(path.parts) > depth:
            before, trial = path.parts[: -depth - 1], path.parts[-depth - 1]
            below = [_with_placeholder(part, trial) for part in path.parts[-depth:]]
            split[path] = (trial, "/".join([*before, TRIAL, *below]))
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
    mvc = {name for name in of_trial if _MVC.search(plain(name))}
    counts = Counter(pattern for name, patterns in of_trial.items() if name not in mvc for pattern in patterns)
    core = {pattern for pattern, count in counts.items() if 2 * count > len(of_trial) - len(mvc)}
    trials = sorted((n for n, patterns in of_trial.items() if n not in mvc and core <= patterns), key=natural)
    if len(trials) < 2 or not core:
        return None
    kept_mvc = sorted((name for name in mvc if core & of_trial[name]), key=natural)
    kept = {(name, pattern) for name in (*trials, *kept_mvc) for pattern in core}
    left_out = [str(path) for path in files if split.get(path) not in kept]
    return Naming(tuple(trials), tuple(sorted(core, key=natural)), tuple(kept_mvc), tuple(left_out))


def _with_placeholder(part: str, trial: str) -> str:
    """A name with the placeholder wherever the trial's stands by itself."""
    return re.sub(rf"(?<![A-Za-z0-9]){re.escape(trial)}(?![A-Za-z0-9])", TRIAL, part)
