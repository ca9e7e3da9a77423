"""A Parquet table, one column per signal."""

from pathlib import Path

from myowave.data.readers.frames import to_signals, with_time
from myowave.data.readers.signals import RawRecording
from myowave.data.store import read_table


def read_parquet(path: Path) -> RawRecording:
    """Read one file; rows count from 1.

    Raises:
        ValueError: if the file is no Parquet.
    """
    frame, _ = read_table(path)
    return RawRecording(path, to_signals(frame, list(frame.columns)))


def read_raw_parquet(path: Path) -> RawRecording:
    """As `read_parquet`, with the times of the column time, time_s or t.

    Raises:
        ValueError: if the file is no Parquet.
    """
    recording = read_parquet(path)
    return RawRecording(path, with_time(path, recording.signals, None))
