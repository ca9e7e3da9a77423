"""One recording on disk: a CSV or Parquet file with `time_s, emg_<muscle>..., angle_rad` (or `angle_deg`).

Everything that can be wrong with one file is found here. `read_recording` gives back what it read, or a list of
problems: each a sentence with the file, the row, what was found, what was expected and what to do, so that a user sees
all of them at once.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from myowave.data.store import read_table
from myowave.data.trials import EMG_PREFIX
from myowave.settings.keys import did_you_mean

TIME, ANGLES = "time_s", ("angle_rad", "angle_deg")
SUFFIXES = (".csv", ".parquet")
EMG_LIMIT = 1.5
"""Largest EMG taken as a fraction of a maximum voluntary contraction [-]; more means it was not normalised."""
SHORTEST = 50
"""Fewest samples of a trial [-]; training needs windows, diagnosis degrees of freedom."""
STEP_TOLERANCE = 0.01
"""Jitter of the sampling allowed beyond the rounding of `time_s`, as a fraction of a step."""


@dataclass(frozen=True)
class Recording:
    """One trial as recorded: `dt` [s], `channels`, `emg` (N, C) [-], `angle` (N,) [rad]."""

    dt: float
    channels: tuple[str, ...]
    emg: NDArray[np.float64]
    angle: NDArray[np.float64]


def read_recording(path: Path, channels: Sequence[str] | None = None) -> tuple[Recording | None, list[str]]:
    """Read and check one file.

    Args:
        path: a .csv or .parquet file.
        channels: the EMG columns there must be; None takes whichever there are.

    Returns:
        The recording, or None where it cannot be used, and the problems found: exactly one of the two is empty.
    """
    try:
        header, frame, first_row = _read_csv(path) if path.suffix.lower() == ".csv" else _read_parquet(path)
    except ValueError as error:
        return None, [str(error)]
    problems = list(_column_problems(path, header, channels))
    if problems:
        return None, problems
    numbers = frame.apply(pd.to_numeric, errors="coerce")
    problems = list(_value_problems(path, frame, numbers, first_row))
    if problems:
        return None, problems
    if len(numbers) < SHORTEST:
        return None, [
            f"{path}: {len(numbers)} samples; expected at least {SHORTEST}. Record longer, or leave the trial out."
        ]
    time = numbers[TIME].to_numpy(dtype=np.float64)
    names = tuple(channels or (name for name in header if name.startswith(EMG_PREFIX)))
    emg = numbers[list(names)].to_numpy(dtype=np.float64)
    column = next(name for name in ANGLES if name in header)
    angle = numbers[column].to_numpy(dtype=np.float64)
    problems = [
        *_time_problems(path, time, first_row),
        *_emg_problems(path, names, emg, first_row),
        *_angle_problems(path, column, angle, first_row),
    ]
    if problems:
        return None, problems
    angle = np.radians(angle) if column == "angle_deg" else angle
    return Recording((time[-1] - time[0]) / (len(time) - 1), names, emg, angle), []


def _read_csv(path: Path) -> tuple[list[str], pd.DataFrame, int]:
    """Column names, all cells as text, and the row (as an editor counts them) of the first sample."""
    encoding = "utf-8-sig"
    try:
        with path.open(encoding=encoding) as lines:
            first_line = lines.readline()
        for separator, name in ((";", "semicolons"), ("\t", "tabs")):
            if separator in first_line and "," not in first_line:
                raise ValueError(
                    f"{path}, row 1: columns are separated by {name}; expected commas, and points in decimals (0.5, "
                    "not 0,5). Export it again, or rewrite it with "
                    f"pandas.read_csv(file, sep={separator!r}, decimal=',').to_csv(file, index=False)."
                )
        cells = pd.read_csv(
            path, header=None, dtype=str, keep_default_na=False, skip_blank_lines=False, encoding=encoding
        )
    except pd.errors.EmptyDataError:
        raise ValueError(f"{path}: the file is empty; expected a header and a row a sample.") from None
    except pd.errors.ParserError as error:
        raise ValueError(
            f"{path}: rows differ in their number of columns ({str(error).strip().split('C error: ')[-1]}). Save it "
            "with a comma between columns and a point in decimals (0.5, not 0,5)."
        ) from None
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: this is not UTF-8 text ({error.reason}). Save it as CSV, UTF-8.") from None
    cells = cells.fillna("").apply(lambda column: column.str.strip())
    written = (cells != "").any(axis=1).to_numpy().nonzero()[0]
    if not len(written):
        raise ValueError(f"{path}: the file is empty; expected a header and a row a sample.")
    header = cells.iloc[0].tolist()
    frame = cells.iloc[1 : written[-1] + 1].reset_index(drop=True)  # blank rows at the end are no samples
    return header, frame.set_axis(header, axis=1), 2


def _read_parquet(path: Path) -> tuple[list[str], pd.DataFrame, int]:
    frame, _ = read_table(path)
    return list(frame.columns), frame, 1


def _column_problems(path: Path, header: Sequence[str], channels: Sequence[str] | None) -> Iterator[str]:
    where = f"{path}, header"
    repeated = sorted({name for name in header if header.count(name) > 1})
    if repeated:
        yield f"{where}: columns {', '.join(repeated)} appear more than once; keep one of each."
    emg = tuple(channels or dict.fromkeys(name for name in header if name.startswith(EMG_PREFIX)))
    known = (TIME, *emg, *ANGLES)
    extra = [name for name in dict.fromkeys(header) if name not in known]
    missing = [name for name in (TIME, *emg) if name not in header]
    if not emg:
        yield f"{where}: no EMG column among {', '.join(header)}; expected emg_<muscle>, such as emg_biceps."
    for name in missing:
        yield f"{where}: column {name} is missing; found {', '.join(header)}."
    angles = [name for name in ANGLES if name in header]
    if len(angles) != 1:
        yield f"{where}: found {' and '.join(angles) or 'no angle'}; expected either angle_rad or angle_deg."
    for name in extra:
        hint = did_you_mean(name, known) or "."
        remedy = "Remove the column" + (
            ", or add a muscle that it drives to physics.muscles." if name.startswith(EMG_PREFIX) else ", or rename it."
        )
        yield f"{where}: unknown column {name!r}{hint} Expected {', '.join((TIME, *emg, 'angle_rad'))}. {remedy}"


def _value_problems(path: Path, frame: pd.DataFrame, numbers: pd.DataFrame, first_row: int) -> Iterator[str]:
    for name in frame:
        bad = (~np.isfinite(numbers[name].to_numpy(dtype=np.float64))).nonzero()[0]
        if len(bad):
            found = frame[name].iloc[bad[0]]
            comma = isinstance(found, str) and "," in found
            yield (
                f"{path}, row {bad[0] + first_row}: {name} is {found if isinstance(found, float) else repr(found)} "
                f"({len(bad)} such rows); expected a finite number. "
                + ("Write decimals with a point." if comma else "Fill the gap, or cut the file there.")
            )


def _time_problems(path: Path, time: NDArray, first_row: int) -> Iterator[str]:
    steps = np.diff(time)
    back = (steps <= 0).nonzero()[0]
    if len(back):
        n = back[0]
        how = "stays at" if steps[n] == 0 else "goes back from"
        change = f"{time[n]:g}" if steps[n] == 0 else f"{time[n]:g} to {time[n + 1]:g}"
        yield (
            f"{path}, row {n + 1 + first_row}: time_s {how} {change}. Trials must be sampled at one rate; resample "
            f"the file, or cut it at row {n + 1 + first_row}."
        )
        return
    step = float(np.median(steps))
    allowed = STEP_TOLERANCE * step + min(_rounding(time), 0.1 * step)  # rounded steps differ by one unit at most
    uneven = (np.abs(steps - step) > allowed).nonzero()[0]
    even = time[0] + np.arange(len(time)) * (time[-1] - time[0]) / (len(time) - 1)
    adrift = (np.abs(time - even) > step / 2).nonzero()[0]
    if len(uneven):
        n = uneven[0]
        yield (
            f"{path}, row {n + 1 + first_row}: time_s goes from {time[n]:g} to {time[n + 1]:g}, a step of "
            f"{steps[n]:.4g} s ({len(uneven)} such rows); expected {step:.4g} s like the others. Resample the file to "
            "one rate, or cut it there."
        )
    elif len(adrift):
        yield (
            f"{path}, row {adrift[0] + first_row}: time_s is {time[adrift[0]]:g}, more than half a step off even "
            f"sampling ({even[adrift[0]]:.6g}): the rate drifts. Resample the file to one rate."
        )


def _rounding(time: NDArray) -> float:
    """The unit [s] to which times were rounded when written, 0 where there is none coarser than 1e-6."""
    units = (10.0**-digits for digits in range(7))
    return next((unit for unit in units if np.abs(time / unit - np.round(time / unit)).max() < 1e-6), 0.0)


def _emg_problems(path: Path, names: Sequence[str], emg: NDArray, first_row: int) -> Iterator[str]:
    for c, name in enumerate(names):
        outside = ((emg[:, c] < 0) | (emg[:, c] > EMG_LIMIT)).nonzero()[0]
        if len(outside):
            n = outside[0]
            yield (
                f"{path}, row {n + first_row}: {name} is {emg[n, c]:g} ({len(outside)} rows outside; the column spans "
                f"{emg[:, c].min():g} to {emg[:, c].max():g}); expected 0 to {EMG_LIMIT:g}. Rectify and smooth the "
                "EMG, and divide it by its value at maximum voluntary contraction."
            )


def _angle_problems(path: Path, column: str, angle: NDArray, first_row: int) -> Iterator[str]:
    n = int(np.abs(angle).argmax())
    span = f"the column spans {angle.min():g} to {angle.max():g}"
    if column == "angle_rad" and abs(angle[n]) > math.pi:
        yield (
            f"{path}, row {n + first_row}: angle_rad is {angle[n]:g} ({span}); expected -pi to pi. If these are "
            "degrees, call the column angle_deg."
        )
    if column == "angle_deg" and abs(angle[n]) > 180:
        yield f"{path}, row {n + first_row}: angle_deg is {angle[n]:g} ({span}); expected -180 to 180."
    if column == "angle_deg" and abs(angle[n]) < math.pi:
        yield (
            f"{path}: angle_deg never leaves {-math.pi:.2f} to {math.pi:.2f} ({span}), which no elbow motion does. If "
            "these are radians, call the column angle_rad."
        )
