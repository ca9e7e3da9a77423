"""Readers: one file for each format, each a pure function from a path to raw signals.

A reader knows its format and nothing else: what columns there must be, and whether their values make sense, is for
`data.checks`; units are converted in `data.processing`. A new format is a new file here and a line in `READERS`.
"""

from collections.abc import Callable
from pathlib import Path

from myowave.data.readers.csv import read_csv
from myowave.data.readers.parquet import read_parquet
from myowave.data.readers.signals import RawRecording, Signal

__all__ = ["READERS", "RawRecording", "Reader", "Signal"]

Reader = Callable[[Path], RawRecording]

READERS: dict[str, Reader] = {".csv": read_csv, ".parquet": read_parquet}
"""Readers of tables with one row per sample and one column per signal, by the file's ending."""
