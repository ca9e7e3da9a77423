"""Tables of text as spreadsheets write them: a row of names, then one row per sample."""

from pathlib import Path

from myowave.data.readers.signals import RawRecording
from myowave.data.readers.text import (
    read_cells,
    read_head,
    separator_of,
    split_row,
    split_unit,
    to_signals,
    with_time,
)
from myowave.settings import TextLayout

_SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}


def read_delimited(path: Path, layout: TextLayout | None = None) -> RawRecording:
    """Read one file, plain or .gz; rows count as an editor counts them.

    Args:
        path: the file.
        layout: how it is written; what is null there is told from the file. A unit may stand in a row of its own, or
            in brackets behind a column's name, which is then the name without it.

    Raises:
        ValueError: if it cannot be read that way.
    """
    layout = layout or TextLayout()
    head = max(layout.header_row, layout.units_row or 0)
    lines = read_head(path, head + 1)
    if len(lines) <= head or not lines[layout.header_row - 1].strip():
        raise ValueError(
            f"{path}: {len(lines)} rows; expected names of columns in row {layout.header_row} and samples below."
        )
    header = lines[layout.header_row - 1]
    separator = _SEPARATORS[layout.separator] if layout.separator else separator_of(header)
    names, units = zip(*map(split_unit, split_row(header, separator)), strict=True)
    if layout.units_row:
        units = [unit.strip("[]()") for unit in split_row(lines[layout.units_row - 1], separator)]
    comma = None if layout.decimal is None else layout.decimal == "comma"
    signals = to_signals(path, read_cells(path, separator, head, comma=comma), names, units)
    return RawRecording(path, with_time(path, signals, layout.time_column), first_row=head + 1)
