"""A Parquet table, one column per signal."""

from pathlib import Path

from myowave.data.readers.frames import to_signals
from myowave.data.readers.signals import RawRecording
from myowave.data.store import read_table


def read_parquet(path: Path) -> RawRecording:
    """Read one file; rows count from 1.

    Raises:
        ValueError: if the file is no Parquet.
    """
    frame, _ = read_table(path)
    return RawRecording(path, to_signals(frame, list(frame.columns)))
