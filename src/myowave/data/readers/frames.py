"""From a table of cells to signals: the part that all readers of tables share."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from myowave.data.readers.signals import Signal

_TIMES, _MILLISECONDS = ("time", "time_s", "t", "t_s"), ("time_ms", "t_ms")


def to_signals(frame: pd.DataFrame, header: list[str]) -> tuple[Signal, ...]:
    """A signal for each column.

    Args:
        frame: one row per sample; cells are numbers, or text that may hold one.
        header: names of the columns, which may repeat.
    """
    return tuple(_to_signal(name, frame.iloc[:, column]) for column, name in enumerate(header))


def _to_signal(name: str, cells: pd.Series) -> Signal:
    values = pd.to_numeric(cells, errors="coerce").to_numpy(dtype=np.float64)
    odd = (~np.isfinite(values)).nonzero()[0]
    return Signal(name, values, odd={int(sample): cells.iloc[sample] for sample in odd})


def with_time(path: Path, signals: tuple[Signal, ...], column: str | None) -> tuple[Signal, ...]:
    """The signals without the column of times, which they are given.

    Args:
        path: the file, for messages.
        signals: its columns.
        column: the one that holds times [s or ms]; None takes one called time, time_s, time_ms or t, if there is
            one.

    Raises:
        ValueError: if there is no such column, or its unit is none of time.
    """
    names = [signal.name for signal in signals]
    if column is not None and column not in names:
        raise ValueError(f"{path}: no column {column!r} of times; the columns are {', '.join(names)}.")
    column = column or next((name for name in names if name.lower() in (*_TIMES, *_MILLISECONDS)), None)
    if column is None:
        return signals
    time = signals[names.index(column)]
    if time.unit not in ("", "s", "ms"):
        raise ValueError(f"{path}: times are in {time.unit!r}; expected s or ms. Export it in seconds.")
    in_milliseconds = time.unit == "ms" or (not time.unit and column.lower() in _MILLISECONDS)
    seconds = time.values / 1000 if in_milliseconds else time.values
    return tuple(replace(signal, time=seconds) for signal in signals if signal is not time)
