"""Tables of text, plain or compressed, in any encoding and dialect: what all formats of text are read with."""

import codecs
import gzip
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO, TextIO, cast

import numpy as np
import pandas as pd

from myowave.data.readers.signals import Signal

UTF_8, UTF_16 = "utf-8-sig", "utf-16"  # UTF-8 with or without a byte-order mark; UTF-16 has one
WINDOWS = "cp1252"  # what Western European recorders and spreadsheets write: µ and ° are one byte each
_HEAD_BYTES = 65_536  # names and units stand there; below them are digits
_SEPARATORS = "\t;,"
_UNIT = re.compile(r"^(.*?)\s*[\[(]([^\[\]()]*)[\])]$")  # Biceps [uV] or Biceps (uV)
_TIMES, _MILLISECONDS = ("time", "time_s", "t", "t_s"), ("time_ms", "t_ms")


def open_text(path: Path) -> TextIO:
    """A text file to read from, in the encoding that its first bytes show; one that ends in .gz is unpacked on the
    way."""
    unpacked = gzip.open if path.suffix.lower() == ".gz" else open
    with cast(BinaryIO, unpacked(path, "rb")) as content:
        encoding = _encoding(content.read(_HEAD_BYTES))
    return cast(TextIO, unpacked(path, "rt", encoding=encoding, newline=""))


def _encoding(head: bytes) -> str:
    """What text is written in: UTF-8 unless it cannot be."""
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return UTF_16
    try:
        codecs.getincrementaldecoder(UTF_8)().decode(head)
    except UnicodeDecodeError:
        # No text has control characters; what has them is damaged, or no text at all, and is refused as UTF-8.
        return UTF_8 if set(head) & _CONTROL else WINDOWS
    return UTF_8


_CONTROL = set(range(32)) - set(b"\t\n\r\f")


def read_head(path: Path, rows: int) -> list[str]:
    """The first rows of a file, without line ends.

    Raises:
        ValueError: if it is no text.
    """
    try:
        with open_text(path) as lines:
            return [line.rstrip("\r\n") for _, line in zip(range(rows), lines, strict=False)]
    except (UnicodeError, gzip.BadGzipFile) as error:
        raise ValueError(f"{path}: this is not UTF-8 text ({error}). Save it as text, UTF-8.") from None


def separator_of(line: str) -> str:
    """What stands between the columns of a row: a tab, a semicolon, a comma, or else blanks."""
    return next((separator for separator in _SEPARATORS if separator in line), " ")


def split_row(line: str, separator: str) -> list[str]:
    """Cells of a row, without blanks and quotes around them."""
    cells = line.split() if separator == " " else line.split(separator)
    return [cell.strip().strip('"').strip() for cell in cells]


def split_unit(name: str) -> tuple[str, str]:
    """Name and unit of a column: `Biceps [uV]` is `Biceps` in `uV`."""
    found = _UNIT.match(name.strip())
    return (found[1], found[2]) if found else (name.strip(), "")


def read_cells(
    path: Path, separator: str, skip: int = 0, rows: int | None = None, comma: bool | None = None
) -> pd.DataFrame:
    """Cells below the first `skip` rows, as text without blanks around it; blank rows at the end are left out.

    Args:
        separator: between columns; a single space stands for any number of blanks and tabs.
        rows: how many; None reads all.
        comma: whether decimals have commas; None tells it from the cells: where columns are separated otherwise, and
            none of the first rows has a point.

    Raises:
        ValueError: if the file is empty there, or rows differ in their number of columns.
    """
    try:
        with open_text(path) as lines:
            cells = pd.read_csv(
                lines,
                sep=r"\s+" if separator == " " else separator,
                header=None,
                skiprows=skip,
                nrows=rows,
                dtype=str,
                keep_default_na=False,
                skip_blank_lines=False,
            )
    except pd.errors.EmptyDataError:
        raise ValueError(f"{path}: nothing below row {skip}; expected one row per sample.") from None
    except pd.errors.ParserError as error:
        raise ValueError(
            f"{path}: rows differ in their number of columns ({str(error).strip().split('C error: ')[-1]}). Say how it "
            "is written under layout, or export it again, with decimals as 0.5 where commas stand between columns."
        ) from None
    cells = cells.fillna("").apply(lambda column: column.str.strip())
    written = (cells != "").any(axis=1).to_numpy().nonzero()[0]
    if not len(written):
        raise ValueError(f"{path}: nothing below row {skip}; expected one row per sample.")
    cells = cells.iloc[: written[-1] + 1]
    if comma or (comma is None and separator != "," and not _has_points(cells)):
        cells = cells.apply(lambda column: column.str.replace(",", ".", regex=False))
    return cells


def _has_points(cells: pd.DataFrame) -> bool:
    return bool(cells.head(200).apply(lambda column: column.str.contains(".", regex=False)).to_numpy().any())


def to_signals(path: Path, cells: pd.DataFrame, names: Sequence[str], units: Sequence[str] = ()) -> tuple[Signal, ...]:
    """A signal for each column of a table.

    Args:
        path: the file, for messages.
        cells: one row per sample; numbers, or text that may hold one.
        names: of the columns, which may repeat.
        units: of the columns; the last ones may have none.

    Raises:
        ValueError: if there are more or fewer columns than names.
    """
    if len(cells.columns) != len(names):
        raise ValueError(
            f"{path}: {len(names)} names of columns ({', '.join(names)}), but {len(cells.columns)} columns below. Set "
            "header_row or separator under layout, or export it again; with commas between columns decimals need a "
            "point."
        )
    units = [*units, *[""] * len(names)][: len(names)]
    return tuple(Signal.of(name, cells.iloc[:, n], unit=units[n]) for n, name in enumerate(names))


def evenly_sampled(signal: Signal, rate: float) -> Signal:
    """A signal on straight lines between its samples, at times of one rate [Hz]; as it is where its times do not rise
    or a cell is no number, which is for a check to refuse."""
    time = signal.time
    if time is None or signal.odd or len(time) < 2 or not (np.diff(time) > 0).all():
        return signal
    even = time[0] + np.arange(int((time[-1] - time[0]) * rate) + 1) / rate
    return replace(signal, values=np.interp(even, time, signal.values), time=even)


def with_time(path: Path, signals: tuple[Signal, ...], column: str | None = None) -> tuple[Signal, ...]:
    """The signals without the column of times, which they are given.

    Args:
        path: the file, for messages.
        signals: its columns.
        column: the one that holds times [s or ms]; None takes one called time, time_s, time_ms or t, if there is
            one.

    Raises:
        ValueError: if there is no such column, or its unit is none of time.
    """
    names = [signal.name for signal in signals]
    if column is not None and column not in names:
        raise ValueError(f"{path}: no column {column!r} of times; the columns are {', '.join(names)}.")
    column = column or next((name for name in names if name.lower() in (*_TIMES, *_MILLISECONDS)), None)
    if column is None:
        return signals
    time = signals[names.index(column)]
    if time.unit not in ("", "s", "ms"):
        raise ValueError(f"{path}: times are in {time.unit!r}; expected s or ms. Export it in seconds.")
    in_milliseconds = time.unit == "ms" or (not time.unit and column.lower() in _MILLISECONDS)
    seconds = time.values / 1000 if in_milliseconds else time.values
    return tuple(replace(signal, time=seconds) for signal in signals if signal is not time)
