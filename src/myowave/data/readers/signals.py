"""What every reader gives back: the signals of a file as they were recorded, nothing checked and nothing converted."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

STEP_TOLERANCE = 0.01  # jitter of the sampling allowed beyond the rounding of times, as a fraction of a step
_EMPTY = ("", "nan")


def cut_short(path: Path, found: str, stated: int) -> ValueError:
    """The error for a file that holds less than its header says."""
    return ValueError(
        f"{path}: {found}, but its header says {stated}; the file was cut short. Copy or export it again."
    )


@dataclass(frozen=True, eq=False)
class Signal:
    """One column or channel of a file."""

    name: str  # as the file has it
    values: NDArray[np.float64]  # (N,), in `unit`; not finite where a cell holds no finite number
    unit: str = ""  # as the file has it, such as `uV` or `deg`; empty where the file names none
    angle_unit: str = ""  # of the file's angles, where it says so for all; it counts if this is one of them
    time: NDArray[np.float64] | None = None  # of each value [s], (N,); None where the file has no time
    rate: float | None = None  # samples a second as the file states it [Hz]; None where it does not
    odd: Mapping[int, Any] = field(default_factory=dict)  # cells that hold no finite number, {sample: cell}
    first_row: int | None = None  # the row of its first sample, where not all signals of the file begin in one

    @classmethod
    def of(cls, name: str, cells: pd.Series | NDArray[np.float64], **facts: Any) -> Signal:
        """A signal whose cells (N,) are numbers, or text that may hold one; `facts` are its other fields."""
        cells = pd.Series(cells)
        values = pd.to_numeric(cells, errors="coerce").to_numpy(dtype=np.float64)
        odd = {int(sample): cells.iloc[sample] for sample in (~np.isfinite(values)).nonzero()[0]}
        return cls(name, values, odd=odd, **facts)

    @property
    def samples(self) -> int:
        """How many there are above the empty cells at the column's end."""
        return next(n for n in range(len(self.values), -1, -1) if str(self.odd.get(n - 1, 0)).lower() not in _EMPTY)

    def part(self, first: int, stop: int, time: NDArray[np.float64]) -> Signal:
        """Samples from `first` to before `stop`, at those of these times [s]."""
        odd = {n - first: cell for n, cell in self.odd.items() if first <= n < stop}
        return replace(self, values=self.values[first:stop], time=time[first:stop], odd=odd)

    @property
    def rate_by_time(self) -> float | None:
        """Samples a second by its times [Hz]; None where it has none, or they do not rise."""
        time = self.time
        if time is None or len(time) < 2 or not time[-1] > time[0]:
            return None
        return (len(time) - 1) / float(time[-1] - time[0])


@dataclass(frozen=True, eq=False)
class RawRecording:
    """A file as its reader found it."""

    path: Path  # the file, for messages
    signals: tuple[Signal, ...]  # in the order of the file; names may repeat, which is for a check to refuse
    first_row: int = 1  # the row of the first sample as an editor or a data frame counts it, for messages

    @cached_property
    def sha256(self) -> str:
        """Digest of the file."""
        return hashlib.sha256(self.path.read_bytes()).hexdigest()

    @property
    def header(self) -> list[str]:
        return [signal.name for signal in self.signals]

    def __getitem__(self, name: str) -> Signal:
        """The first signal of that name."""
        return next(signal for signal in self.signals if signal.name == name)

    def between(self, signal: Signal, start: float, end: float, rate: float | None = None) -> Signal:
        """What a signal of the file holds from a time to another [s]; all of it where neither times nor the rate [Hz],
        stated by the file or else given, say when that was."""
        time, rate = signal.time, signal.rate or rate
        if time is None:
            if rate is None:
                return signal
            time = np.arange(len(signal.values)) / rate
        inside = np.flatnonzero((time >= start) & (time <= end))
        first, stop = (inside[0], inside[-1] + 1) if len(inside) else (0, 0)
        return replace(signal.part(first, stop, time), first_row=(signal.first_row or self.first_row) + first)

    def at(self, sample: int, signal: Signal) -> str:
        """Where a sample of a signal stands, as messages begin: `trial2.csv, row 118`."""
        return f"{self.path}, row {sample + (signal.first_row or self.first_row)}"


def uneven(time: NDArray[np.float64]) -> NDArray[np.int_]:
    """Samples of two or more, at times [s] (N,), whose distance to the next is unusual, beyond rounding."""
    steps = np.diff(time)
    step = float(np.median(steps))
    allowed = STEP_TOLERANCE * step + min(_rounding(time), 0.1 * step)  # rounded steps differ by one unit at most
    return np.flatnonzero(np.abs(steps - step) > allowed)


def adrift(time: NDArray[np.float64]) -> NDArray[np.int_]:
    """Samples of two or more, at times [s] (N,), that are more than half a step off even sampling."""
    even = np.linspace(time[0], time[-1], len(time))
    return np.flatnonzero(np.abs(time - even) > float(np.median(np.diff(time))) / 2)


def _rounding(time: NDArray[np.float64]) -> float:
    """The unit [s] to which times were rounded when written, 0 where there is none coarser than 1e-6; that of the
    largest, as times of so many digits each have fewer decimals from 10 s on."""
    size = np.abs(time)
    largest = time[size >= 10.0 ** np.floor(np.log10(size.max()))]
    units = (10.0**-digits for digits in range(7))
    return next((unit for unit in units if np.abs(largest / unit - np.round(largest / unit)).max() < 1e-6), 0.0)
