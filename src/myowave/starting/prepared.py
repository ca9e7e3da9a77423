"""A study of files that are prepared already: one CSV or Parquet per trial with time_s, emg_<muscle> and an angle."""

import csv
import glob
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from myowave.data.files import natural
from myowave.data.readers import read_raw
from myowave.data.readers.text import read_head
from myowave.data.session import TIDY_ENDINGS
from myowave.data.trials import ANGLES, EMG_PREFIX, TIME
from myowave.starting.arm import Choice, arm_of
from myowave.starting.draft import Draft, arm_lines, conditions_lines, held_out_lines, shown
from myowave.starting.writing import inline_list


def prepared_in(folder: Path, files: Sequence[PurePosixPath]) -> list[PurePosixPath]:
    """Those of the files that hold a prepared trial each."""
    return [path for path in files if path.suffix.lower() in TIDY_ENDINGS and _is_prepared(_header(folder / path))]


def prepared_draft(study: str, folder: Path, files: Sequence[PurePosixPath], choice: Choice) -> Draft:
    """The block of a measured dataset.

    Args:
        study: its name.
        folder: that the files are in.
        files: prepared trials, relative to it.
        choice: which arm.

    Raises:
        ValueError: if there is one trial only, or two of one name.
    """
    trials = sorted((path.stem for path in files), key=natural)
    if len(trials) < 2:
        raise ValueError(f"{folder}: holds the trial {trials[0]} only; expected at least two, one of them for testing.")
    if len(set(trials)) < len(trials):
        twice = next(name for name in trials if trials.count(name) > 1)
        raise ValueError(f"{folder}: two files are called {twice}; trials are named after their files, so rename one.")
    header = _header(folder / files[0])
    emg = [name for name in header if name.startswith(EMG_PREFIX)]
    study_arm = arm_of(study, emg, choice)
    others = [name for name in header if name not in (TIME, *ANGLES) and not name.startswith("emg_")]
    driving = set(study_arm.channels)
    spare = [name for name in emg if driving and name not in driving]
    angle = next(name for name in ANGLES if name in header)
    lines = [
        "      kind: measured # one file per trial, already prepared",
        f"      files: {inline_list(_patterns(folder, files))}",
        *held_out_lines(trials),
        *arm_lines(study_arm),
        *conditions_lines(trials),
    ]
    guessed = [f"prepared files, one per trial: {', '.join(trials)}", f"EMG: {', '.join(emg)}; angle: {angle}"]
    if others or spare:
        ignored = [*spare, *(["*"] if others else [])]
        lines.append(f"      ignore_columns: {inline_list(ignored)} # nothing is driven by them; * stands for anything")
        guessed.append(f"not used: {', '.join([*spare, *([f'{len(others)} other columns'] if others else [])])}")
    to_do = [
        "the mass in the hand in each trial, under conditions",
        "EMG has to be a fraction of a maximum contraction, and the angle 0 with the forearm hanging straight",
        *study_arm.to_do,
    ]
    return Draft("measured", tuple(trials), tuple(lines), tuple(guessed), tuple(to_do), study_arm)


def _header(path: Path) -> list[str]:
    """Names of columns; none where the file cannot be read as a table of trials."""
    try:
        if path.suffix.lower() != ".csv":
            return read_raw(path).header
        return [name.strip() for name in next(csv.reader(read_head(path, 1)), [])]
    except ValueError:
        return []


def _is_prepared(header: Sequence[str]) -> bool:
    return (
        TIME in header
        and any(name.startswith(EMG_PREFIX) for name in header)
        and any(name in header for name in ANGLES)
    )


def _patterns(folder: Path, files: Sequence[PurePosixPath]) -> list[str]:
    """Patterns that match these files; the files themselves where a pattern would match others too."""
    patterns = dict.fromkeys(f"{glob.escape(shown(folder / path.parent))}/*{path.suffix}" for path in files)
    matched = {Path(match) for pattern in patterns for match in glob.glob(pattern)}
    if matched == {Path(shown(folder / path)) for path in files}:
        return list(patterns)
    return [glob.escape(shown(folder / path)) for path in files]
