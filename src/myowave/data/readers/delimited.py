"""Tables of text as spreadsheets write them: a row of names, then one row per sample."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from myowave.data.processing.units import UNITS, plain_unit
from myowave.data.readers.signals import RawRecording, Signal
from myowave.data.readers.text import (
    evenly_sampled,
    read_cells,
    read_lines,
    separator_of,
    split_row,
    split_unit,
    to_signals,
    with_time,
)
from myowave.settings import TextLayout

_HEAD = 60  # rows in which names and the first numbers are looked for
_SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}


def read_delimited(path: Path, layout: TextLayout | None = None) -> RawRecording:
    """Read one file, plain or .gz; rows count as an editor counts them.

    What is null in its layout is found in the file. A unit that is known may stand in brackets behind a column's name,
    which is then the name without it; any may stand in a row of its own.
    """
    layout = layout or TextLayout()
    lines = read_lines(path)
    top = lines[: max(_HEAD, (layout.header_row or 0) + 2) + 1]
    separator = _SEPARATORS[layout.separator] if layout.separator else _find_separator(top)
    rows = [split_row(line, separator) for line in top]
    header_row, units_row = _find_header(path, rows, layout.header_row)
    head = units_row or header_row
    head = next((n for n in range(head, len(rows)) if any(map(_is_number, rows[n]))), head)  # the first sample
    if len(lines) <= head or not lines[header_row - 1].strip():
        raise ValueError(f"{path}: {len(lines)} rows; expected names of columns in row {header_row} and samples below.")
    names, units = zip(*map(split_unit, split_row(lines[header_row - 1].lstrip("#"), separator)), strict=True)
    if units_row:
        units = [unit.strip("[]()") for unit in rows[units_row - 1]]
    comma = None if layout.decimal is None else layout.decimal == "comma"
    signals = to_signals(path, read_cells(path, lines, separator, head, comma), names, units)
    signals = with_time(path, signals, layout.time_column or ())
    if layout.time_unit is not None:
        signals = tuple(timed_in(one, layout.time_unit) for one in signals)
    if layout.resample_hz is not None:
        signals = tuple(evenly_sampled(path, signal, layout.resample_hz) for signal in signals)
    return RawRecording(path, signals, first_row=head + 1)


def timed_in(signal: Signal, unit: Literal["ms", "sample"]) -> Signal:
    """A signal whose times were in ms, or no times but numbers of samples."""
    return signal if signal.time is None else replace(signal, time=signal.time / 1000 if unit == "ms" else None)


def _find_separator(lines: Sequence[str]) -> str:
    """That of a row of samples."""
    line = next((line for line in reversed(lines) if line.strip()), "")
    found = separator_of(line)
    cells = line.split()  # 0,5 1,2 has commas in decimals; 1, 2 has not
    decimal = len(cells) > 1 and all(re.fullmatch(r"[-+]?\d+(,\d+)?(e[-+]?\d+)?", cell) for cell in cells)
    return " " if found == "," and decimal else found


def _find_header(path: Path, rows: Sequence[Sequence[str]], stated: int | None) -> tuple[int, int | None]:
    """The row of names, and that of units below it if there is one, counted from 1.

    It is what is stated, else the last one without a number above the first row of numbers; without such a row, the
    first.
    """
    if stated is not None:
        if stated >= len(rows):
            raise ValueError(
                f"{path}: {len(rows)} rows; expected names in row {stated} (layout.header_row), samples below."
            )
        below = next((n for n in range(stated, len(rows)) if any(rows[n])), stated)
        return stated, below + 1 if len(rows[below]) == len(rows[stated - 1]) and _are_units(rows[below]) else None
    wide = len(next((cells for cells in reversed(rows) if any(cells)), []))  # a number above the names is alone
    numbers = [any(cells) and all(map(_is_number, filter(None, cells))) and len(cells) >= wide for cells in rows]
    first = numbers.index(True) if True in numbers else 1
    if first == 0:
        raise ValueError(
            f"{path}: numbers already in row 1; expected a row with names of columns. Export it with names, or say "
            "under layout in which row they stand (header_row)."
        )
    filled = [n for n in range(min(first, len(rows))) if any(rows[n])]
    words = [n for n in filled if not any(map(_is_number, rows[n]))]
    last = words[-1] if words else 0
    above = max((n for n in filled if n < last), default=last)  # but for blank rows
    is_units = above < last and above in words and _are_units(rows[last]) and len(rows[last]) == len(rows[above])
    return (above + 1, last + 1) if is_units else (last + 1, None)


def _are_units(cells: Sequence[str]) -> bool:
    return all(plain_unit(cell) in {"", *UNITS} for cell in cells)


def _is_number(cell: str) -> bool:
    return re.fullmatch(r"[-+]?(\d+[.,]?\d*|[.,]\d+)(e[-+]?\d+)?|nan", cell.lower()) is not None
