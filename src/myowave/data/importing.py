"""Import of measured trials: from the files a dataset names to `Trials`, or one error that lists all that is wrong."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from myowave.data.recording import SUFFIXES, Recording, read_recording
from myowave.data.trials import Trials
from myowave.settings import MeasuredDataset

RATE_TOLERANCE = 0.005
"""Largest relative difference of the sampling rates of two trials that counts as rounding."""


def import_trials(
    dataset: str, settings: MeasuredDataset, root: str | Path = ".", channels: Sequence[str] | None = None
) -> Trials:
    """Read, check and stack the recordings of a dataset.

    Args:
        dataset: its name.
        settings: its block of config.yaml.
        root: folder that relative paths of files start from.
        channels: EMG columns that the physical model needs; None takes what the first file has.

    Returns:
        The trials, named after their files without the ending. Angles in degrees are converted to rad.

    Raises:
        ValueError: one line for each problem found in any of the files.
    """
    files = find_files(dataset, settings.files, root)
    recordings: dict[str, Recording] = {}
    problems: list[str] = []
    for name, path in files.items():
        recording, found = read_recording(path, channels)
        problems += found
        if recording is not None:
            recordings[name] = recording
            channels = channels or recording.channels
    problems += _rate_problems(files, recordings)
    problems += _duplicate_problems(files, recordings)
    problems += _role_problems(dataset, settings, list(files))
    if problems:
        count = "1 problem" if len(problems) == 1 else f"{len(problems)} problems"
        raise ValueError(f"dataset {dataset!r} cannot be imported, {count}:\n" + "\n".join(problems))
    assert channels is not None
    return Trials.from_sequences(
        dataset=dataset,
        dt=float(np.median([recording.dt for recording in recordings.values()])),
        names=list(recordings),
        channels=channels,
        emg=[recording.emg for recording in recordings.values()],
        angle=[recording.angle for recording in recordings.values()],
        test=settings.test,
        conditions=settings.conditions,
        constants=settings.constants,
        provenance={
            "source": "measured",
            "sha256": {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files.values()},
        },
    )


def find_files(dataset: str, patterns: Sequence[str], root: str | Path = ".") -> dict[str, Path]:
    """Files that the paths and patterns of a dataset name.

    Args:
        dataset: its name, for messages.
        patterns: paths, or patterns with * ? [ ], absolute or relative to `root`.
        root: where relative ones start from.

    Returns:
        {trial name: path}, those of a pattern in natural order (trial2 before trial10).

    Raises:
        ValueError: one line for each pattern without a file, file of another kind, or name taken twice.
    """
    found: dict[str, Path] = {}
    problems = []
    for pattern in patterns:
        matches = _match(Path(root), pattern)
        if not matches:
            problems.append(_nothing_found(Path(root), pattern))
        for path in matches:
            if path.suffix.lower() not in SUFFIXES:
                problems.append(f"{path}: the ending is {path.suffix!r}; expected {' or '.join(SUFFIXES)}.")
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


def _match(root: Path, pattern: str) -> list[Path]:
    if re.search(r"[*?\[]", pattern) is None:
        path = root / pattern
        return [path] if path.is_file() else []
    whole = root / pattern
    anchor = Path(whole.anchor) if whole.is_absolute() else Path()
    matches = anchor.glob(str(whole.relative_to(anchor)))
    return sorted((path for path in matches if path.is_file()), key=lambda path: _natural(str(path)))


def _natural(text: str) -> list[tuple[int, int | str]]:
    return [(0, int(part)) if part.isdigit() else (1, part) for part in re.split(r"(\d+)", text)]


def _nothing_found(root: Path, pattern: str) -> str:
    tried = root.resolve() / pattern
    folder = tried.parent
    while re.search(r"[*?\[]", str(folder)) or not folder.is_dir():
        folder = folder.parent
    inside = sorted(path.name + "/" * path.is_dir() for path in folder.iterdir() if not path.name.startswith("."))
    listed = ", ".join(inside[:12]) + (f" and {len(inside) - 12} more" if len(inside) > 12 else "")
    return f"{pattern}: no such file; looked for {tried}. The folder {folder} holds {listed or 'nothing'}."


def _rate_problems(files: Mapping[str, Path], recordings: Mapping[str, Recording]) -> Iterator[str]:
    if not recordings:
        return
    common = float(np.median([recording.dt for recording in recordings.values()]))
    for name, recording in recordings.items():
        if abs(recording.dt / common - 1) > RATE_TOLERANCE:
            yield (
                f"{files[name]}: sampled every {recording.dt:.4g} s; expected {common:.4g} s like the other trials. "
                "Resample all trials to one rate."
            )


def _duplicate_problems(files: Mapping[str, Path], recordings: Mapping[str, Recording]) -> Iterator[str]:
    seen: dict[bytes, str] = {}
    for name, recording in recordings.items():
        content = recording.emg.tobytes() + recording.angle.tobytes()
        first = seen.setdefault(hashlib.sha256(content).digest(), name)
        if first != name:
            yield (
                f"{files[name]}: the same samples as {files[first]}. A trial that is there twice counts twice, and may "
                "both train and test; remove one."
            )


def _role_problems(dataset: str, settings: MeasuredDataset, names: Sequence[str]) -> Iterator[str]:
    for key, named in (("test", settings.test), ("conditions", tuple(settings.conditions))):
        for name in named:
            if name not in names:
                yield f"data.datasets.{dataset}.{key}: no trial named {name!r}; the trials are {', '.join(names)}."
    if not set(names) - set(settings.test):
        yield (
            f"data.datasets.{dataset}.test: every trial ({', '.join(names)}) is a test trial; leave some to train on, "
            "or add recordings."
        )
