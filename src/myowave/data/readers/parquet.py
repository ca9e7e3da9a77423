"""A Parquet table, one column per signal."""

from pathlib import Path

from myowave.data.readers.signals import RawRecording
from myowave.data.readers.text import to_signals, with_time
from myowave.data.store import read_table


def read_parquet(path: Path) -> RawRecording:
    """Read one file, with the times of the column time, time_s or t; rows count from 1."""
    frame, _ = read_table(path)
    return RawRecording(path, with_time(path, to_signals(path, frame, list(frame.columns))))
