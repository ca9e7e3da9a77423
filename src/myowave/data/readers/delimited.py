"""Tables of text in any dialect: commas, semicolons, tabs or blanks between columns, point or comma in decimals."""

import re
from dataclasses import replace
from pathlib import Path

import pandas as pd

from myowave.data.readers.frames import to_signals, with_time
from myowave.data.readers.signals import RawRecording
from myowave.data.readers.text import read_cells, read_head
from myowave.settings import TextLayout

_SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}
_UNIT = re.compile(r"^(.*?)\s*[\[(]([^\[\]()]*)[\])]$")  # Biceps [uV] or Biceps (uV)


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
    lines = read_head(path, head + 20)
    if len(lines) <= head:
        raise ValueError(f"{path}: {len(lines)} rows; expected a header in row {layout.header_row} and samples below.")
    separator = _SEPARATORS[layout.separator] if layout.separator else _told_separator(lines[layout.header_row - 1])
    names, units = _header(lines, layout, separator)
    cells = read_cells(path, separator, skip=head)
    if len(cells.columns) != len(names):
        raise ValueError(
            f"{path}: {len(names)} names in row {layout.header_row}, but {len(cells.columns)} columns below. Set "
            "header_row or separator under layout."
        )
    if layout.decimal == "comma" or (layout.decimal is None and separator != "," and not _has_points(cells)):
        cells = cells.apply(lambda column: column.str.replace(",", ".", regex=False))
    signals = to_signals(cells, names)
    signals = tuple(replace(signal, unit=unit) for signal, unit in zip(signals, units, strict=True))
    return RawRecording(path, with_time(path, signals, layout.time_column), first_row=head + 1)


def split_unit(name: str) -> tuple[str, str]:
    """Name and unit of a column: `Biceps [uV]` is `Biceps` in `uV`."""
    found = _UNIT.match(name.strip())
    return (found[1], found[2]) if found else (name.strip(), "")


def _told_separator(line: str) -> str:
    return next((separator for separator in ("\t", ";", ",") if separator in line), " ")


def _header(lines: list[str], layout: TextLayout, separator: str) -> tuple[list[str], list[str]]:
    split = [split_unit(name) for name in _split(lines[layout.header_row - 1], separator)]
    names, units = [name for name, _ in split], [unit for _, unit in split]
    if layout.units_row:
        row = [unit.strip("[]()") for unit in _split(lines[layout.units_row - 1], separator)]
        units = (row + [""] * len(names))[: len(names)]
    return names, units


def _split(line: str, separator: str) -> list[str]:
    cells = line.split() if separator == " " else line.split(separator)
    return [cell.strip().strip('"').strip() for cell in cells]


def _has_points(cells: pd.DataFrame) -> bool:
    """Whether the first rows write decimals with a point."""
    return bool(cells.head(200).apply(lambda column: column.str.contains(".", regex=False)).to_numpy().any())
