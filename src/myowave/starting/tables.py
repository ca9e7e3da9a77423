"""How a table of text is written: which row names the columns, which holds units, which column is time."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from myowave.data.processing.units import ARBITRARY, TO_MICROVOLTS, TO_RADIANS, plain_unit
from myowave.data.readers import Signal
from myowave.data.readers.text import read_head
from myowave.settings import TextLayout
from myowave.starting.words import is_technical

_HEAD = 60
_SEPARATORS = ("\t", ";", ",")
_TIMES = r"time|zeit|temps|tiempo"
_UNITS = {*TO_MICROVOLTS, *TO_RADIANS, ARBITRARY, "s", "ms", ""}


@dataclass(frozen=True)
class _Rows:
    lines: Sequence[str]
    separator: str

    def cells(self, row: int) -> list[str]:
        parts = self.lines[row].split() if self.separator == " " else self.lines[row].split(self.separator)
        return [part.strip().strip('"').strip() for part in parts]


def layout_of(path: Path) -> TextLayout:
    """The rows of names and units: those above the first row of numbers.

    Raises:
        ValueError: if the file is no text, or no row of names stands above numbers.
    """
    lines = read_head(path, _HEAD)
    separator = next((s for s in _SEPARATORS if any(s in line for line in lines[-5:])), " ")
    rows = _Rows(lines, separator)
    first = next((n for n in range(len(lines)) if _is_numbers(rows.cells(n), separator)), None)
    if first is None or first == 0:
        found = f"no row of numbers in its first {len(lines)} rows" if first is None else "numbers already in row 1"
        raise ValueError(
            f"{path}: {found}; expected a row with names of columns and numbers below. Export it with names of columns."
        )
    units = first > 1 and _is_units(rows.cells(first - 1)) and len(rows.cells(first - 2)) == len(rows.cells(first))
    return TextLayout(header_row=first - 1, units_row=first) if units else TextLayout(header_row=first)


def time_column_of(signals: Sequence[Signal]) -> str | None:
    """A column of times that the reader does not know by its name: one that says so and rises all along."""
    if any(signal.time is not None for signal in signals):
        return None
    named = (s for s in signals if re.search(_TIMES, s.name.lower()) and is_technical(s.name))
    return next((s.name for s in named if (np.diff(s.values) > 0).all()), None)


def _is_numbers(cells: Sequence[str], separator: str) -> bool:
    written = [cell if separator == "," else cell.replace(",", ".") for cell in cells if cell]
    return bool(written) and all(re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", c.lower()) for c in written)


def _is_units(cells: Sequence[str]) -> bool:
    return any(cells) and all(plain_unit(cell) in _UNITS for cell in cells)
