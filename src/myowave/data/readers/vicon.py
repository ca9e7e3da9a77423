"""Vicon Nexus' ASCII export: blocks of one kind each, at a rate of their own, with an empty row between them.

    Devices                                     Model Outputs
    2000                                        100
    ,,Imported EMG - Voltage,                   ,,Name:RElbowAngles,,
    Frame,Sub Frame,Voltage.BIC,Voltage.TRI     Frame,Sub Frame,X,Y,Z
    ,,V,V                                       ,,deg,deg,deg
    1,0,1.2e-05,3e-06                           1,0,12.5,0.1,-3

A device's channel goes by its own name where that is the only one, as `Voltage.BIC`; all else by that of its group as
well, as `RElbowAngles X`, without the subject's name before the colon.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from myowave.data.readers.signals import RawRecording, Signal
from myowave.data.readers.text import read_cells, read_lines, separator_of, split_row, spread, to_signals

_HEADER = re.compile(r"^\W*Frame\W+Sub Frame\b", re.IGNORECASE)
_SEPARATORS = ",;\t "


def is_header(line: str) -> bool:
    """Whether a row names the columns of a block."""
    return _HEADER.match(line) is not None


def read_vicon(path: Path) -> RawRecording:
    lines = read_lines(path)
    headers = [n for n, line in enumerate(lines) if is_header(line)]
    if not headers:
        raise ValueError(
            f"{path}: no row begins with Frame, Sub Frame, as Vicon Nexus writes it above the samples. Export it as "
            "ASCII (CSV), or name its format, such as csv."
        )
    signals = tuple(signal for header in headers for signal in _signals(path, lines, header))
    return RawRecording(path, signals, first_row=headers[0] + 3)


def _signals(path: Path, lines: Sequence[str], head: int) -> Iterator[Signal]:
    """Signals of the block whose names are in row `head`, counted from 0; its samples end before an empty row."""
    end = next((n for n in range(head, len(lines)) if not lines[n].strip(_SEPARATORS)), len(lines))
    rate = lines[head - 2].strip(_SEPARATORS) if head > 2 else ""
    if not re.fullmatch(r"\d+(\.\d+)?", rate) or end < head + 4:
        raise ValueError(
            f"{path}, row {head + 1}: expected above it a row with the kind of data, one with its rate, one with "
            "groups, and below it one with units and two of samples at least. Export it from Nexus again."
        )
    separator = separator_of(lines[head])
    groups, own, units = (split_row(lines[row], separator) for row in (head - 1, head, head + 1))
    names = _names(groups, own, lines[head - 3].strip(_SEPARATORS).lower() == "devices")
    cells = read_cells(path, lines[:end], separator, head + 2)
    cells = cells.reindex(columns=range(len(names)), fill_value="")  # rows may end in fewer or more separators
    frame, sub, *columns = to_signals(path, cells, names, units)
    # Frames are those of the cameras, sub-frames the samples of a device within one of them.
    each = sub.values.max() + 1
    time = ((frame.values - 1) * each + sub.values) / float(rate)
    for column in columns:
        if column.name:
            yield replace(column, time=time, rate=float(rate), first_row=head + 3)


def _names(groups: Sequence[str], own: Sequence[str], device: bool) -> list[str]:
    """Names of the columns; empty where nothing stands above them."""
    return [
        name if not name or (device and own.count(name) == 1) else f"{group.rpartition(':')[2]} {name}".strip()
        for name, group in zip(own, spread(groups, len(own)), strict=True)
    ]
