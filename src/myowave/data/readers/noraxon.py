"""Noraxon MR3's CSV export, one file per signal.

type,name,time_units,begin_time,frequency,count,units
signal,"...","s",0.00000,2000,53200,"uV"

time,value
0.00000,-1.005723101
"""

import csv
from dataclasses import replace
from pathlib import Path

from myowave.data.readers.signals import RawRecording, cut_short
from myowave.data.readers.text import read_cells, read_lines, to_signals

_FIELDS = ["type", "name", "time_units", "begin_time", "frequency", "count", "units"]
_HEAD = 4  # rows before the first sample


def is_header(line: str) -> bool:
    """Whether the first row is that of such a file."""
    return line.startswith(",".join(_FIELDS[:3]))


def read_noraxon(path: Path) -> RawRecording:
    lines = read_lines(path)
    head = list(csv.reader(lines[:_HEAD]))
    if len(head) < _HEAD or head[0] != _FIELDS or len(head[1]) != len(_FIELDS) or head[3] != ["time", "value"]:
        raise ValueError(
            f"{path}: this is not a signal as Noraxon MR3 exports it (CSV, one file per channel: a row "
            f"{','.join(_FIELDS)}, a row of their values, an empty row, then time,value). Export it again, or name its "
            "format, such as csv."
        )
    about = dict(zip(_FIELDS, head[1], strict=True))
    if about["time_units"] != "s":
        raise ValueError(f"{path}, row 2: times are in {about['time_units']!r}; expected s. Export it in seconds.")
    cells = read_cells(path, lines, ",", _HEAD)
    time, signal = to_signals(path, cells, ["time", about["name"]], ["s", about["units"]])
    if len(signal.values) != int(about["count"]):
        raise cut_short(path, f"{len(signal.values)} samples", int(about["count"]))
    signal = replace(signal, time=time.values, rate=float(about["frequency"]))
    return RawRecording(path, (signal,), first_row=_HEAD + 1)
