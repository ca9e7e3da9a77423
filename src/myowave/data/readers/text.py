"""Tables of text, plain or compressed, in any encoding and dialect: what all formats of text are read with."""

import codecs
import csv
import gzip
import re
from collections.abc import Sequence
from dataclasses import replace
from io import StringIO
from itertools import accumulate
from pathlib import Path

import numpy as np
import pandas as pd

from myowave.data.processing.units import UNITS, plain_unit
from myowave.data.readers.signals import Signal, adrift, uneven
from myowave.data.trials import Array

_HEAD_BYTES = 65_536  # names and units stand there; below them are digits
_CONTROL = set(range(32)) - set(b"\t\n\r\f")
_SEPARATORS = "\t;|,"
_THOUSANDS, _BELOW_THOUSAND = r"[-+]?[1-9]\d{0,2}([.,]\d{3})+", r"[-+]?\d{1,3}"
MANY = 20  # such cells are no chance
LEAST_KEPT = 0.5  # of a signal's own rate, to which straight lines may bring it [-]
LONGEST_LINE_S = 0.1  # over which a straight line says where an elbow was
_UNIT = re.compile(r"^(.*?)\s*(?:[\[(]([^\[\]()]*)[\])]|,([^,]+))$")  # Biceps [uV], Biceps (uV) or Biceps,uV
_TIME = re.compile(r"(time|t)(_m?s)?|zeit", re.IGNORECASE)
_TIME_OF = re.compile(r"(time|t|zeit)[\W_].*|.*[\W_](time|zeit)", re.IGNORECASE)  # time_angle, EMG time


def read_lines(path: Path, head_only: bool = False) -> list[str]:
    """Rows of a text, or the first ones, in the encoding that its first bytes show; what ends in .gz is unpacked."""
    unpacked = gzip.open if path.suffix.lower() == ".gz" else open
    try:
        with unpacked(path, "rb") as file:
            content = file.read(_HEAD_BYTES if head_only else -1)
        text = content.decode(_encoding(content[:_HEAD_BYTES]), "ignore" if head_only else "strict")
    except (UnicodeError, gzip.BadGzipFile) as error:
        raise ValueError(f"{path}: this is not UTF-8 text ({error}). Save it as text, UTF-8.") from None
    lines = re.split("\r\n|\r|\n", text)
    return lines if lines[-1] else lines[:-1]


def _encoding(head: bytes) -> str:
    """What text is written in: UTF-8, with or without a byte-order mark, unless it cannot be."""
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    try:
        codecs.getincrementaldecoder("utf-8-sig")().decode(head)
    except UnicodeDecodeError:
        # Western European recorders and spreadsheets write µ and ° as one byte each. No text has control characters;
        # what has them is damaged, or no text at all, and is refused as UTF-8.
        return "utf-8-sig" if set(head) & _CONTROL else "cp1252"
    return "utf-8-sig"


def separator_of(line: str) -> str:
    """What stands between the columns of a row: a tab, a semicolon, a comma, or else blanks."""
    return next((separator for separator in _SEPARATORS if separator in line), " ")


def split_row(line: str, separator: str) -> list[str]:
    """Cells of a row, without blanks and quotes around them; what stands in quotes may hold the separator."""
    if separator == " ":
        cells = line.split()
    elif '"' in line:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    else:
        cells = line.split(separator)
    return [cell.strip().strip('"').strip() for cell in cells]


def spread(cells: Sequence[str], columns: int) -> list[str]:
    """Cells that stand once over several columns, for each of these."""
    padded = [*cells, *[""] * columns][:columns]
    return list(accumulate(padded, lambda last, cell: cell or last, initial=""))[1:]


def split_unit(name: str) -> tuple[str, str]:
    """Name and unit of a column: `Biceps [uV]`, or `Biceps,uV` as Noraxon's tables have it, is `Biceps` in `uV`; what
    is no unit stays, as in `Biceps (right)`.

    Behind times anything is one, so that hours are refused, and not taken for seconds.
    """
    found = _UNIT.match(name.strip())
    unit = (found[2] or found[3] or "").strip() if found else ""
    if found and (plain_unit(unit) in {"", *UNITS} or _TIME.fullmatch(found[1])):
        return found[1], unit
    return name.strip(), ""


def read_cells(path: Path, lines: Sequence[str], separator: str, skip: int, comma: bool | None = None) -> pd.DataFrame:
    """Cells below the first `skip` rows, as text without blanks around it; blank rows at the end are left out.

    Args:
        separator: between columns; a single space stands for any number of blanks and tabs.
        skip: rows above the cells.
        comma: whether decimals have commas; None takes them for such where columns are separated otherwise, and none
            of the first rows has a point.
    """
    last = next((n for n in range(len(lines), skip, -1) if lines[n - 1].strip(separator + " \t")), skip)
    if last == skip:
        raise ValueError(f"{path}: nothing below row {skip}; expected one row per sample.")
    try:
        cells = pd.read_csv(
            StringIO("\n".join(lines[skip:last])),
            sep=r"\s+" if separator == " " else separator,
            header=None,
            dtype=str,
            keep_default_na=False,
            skip_blank_lines=False,
        )
    except pd.errors.ParserError as error:
        raise ValueError(
            f"{path}: rows differ in their number of columns, counted from row {skip + 1} "
            f"({str(error).strip().split('C error: ')[-1]}). Say under layout where the names stand (header_row) or "
            "what separates columns (separator), or export it again, with decimals as 0.5 where commas separate."
        ) from None
    cells = cells.fillna("").apply(lambda column: column.str.strip())
    if comma is None:
        _refuse_thousands(path, cells)
        quoted = '"' in lines[skip] and any("," in cell for cell in cells.iloc[0])  # "0,5","1,2"
        comma = (quoted or separator != ",") and not any("." in line for line in lines[skip : skip + 200])
    return cells.apply(lambda column: column.str.replace(",", ".", regex=False)) if comma else cells


def _refuse_thousands(path: Path, cells: pd.DataFrame) -> None:
    """1.234 beside 999: what stands between thousands would be read as a decimal sign. Decimals that are rounded have
    fewer digits, or a 0 before them, somewhere."""
    either = f"{_THOUSANDS}|{_BELOW_THOUSAND}"
    for _, column in cells.items():
        if column[:MANY].str.fullmatch(either).all() and column.str.fullmatch(either).all():
            grouped = column.str.fullmatch(_THOUSANDS)
            if MANY <= grouped.sum() < len(column):
                raise ValueError(
                    f"{path}: {column[grouped].iloc[0]} stands beside {column[~grouped].iloc[0]}, as if thousands were "
                    "set apart. Write numbers without that, or say the decimal sign: decimal under layout."
                )


def to_signals(path: Path, cells: pd.DataFrame, names: Sequence[str], units: Sequence[str] = ()) -> tuple[Signal, ...]:
    """A signal for each column of a table with a row per sample; names may repeat, and the last units be left out."""
    if len(cells.columns) != len(names):
        raise ValueError(
            f"{path}: {len(names)} names of columns ({', '.join(names)}), but {len(cells.columns)} columns below. Set "
            "separator or header_row under layout, or export it again; with commas between columns decimals need a "
            "point."
        )
    units = [*units, *[""] * len(names)][: len(names)]
    return tuple(Signal.of(name, cells.iloc[:, n], unit=units[n]) for n, name in enumerate(names))


def evenly_sampled(path: Path, signal: Signal, rate: float) -> Signal:
    """A signal on straight lines between its samples, at times of one rate [Hz]; as it is where its times are even, and
    where they do not rise or a cell is no number, which is for a check to refuse.

    A ValueError over too long a gap, or where what is faster than half the rate would be folded into what is slower.
    """
    time, own = signal.time, signal.rate_by_time
    if time is None or own is None or signal.odd or not (np.diff(time) > 0).all():
        return signal
    if not len(uneven(time)) and not len(adrift(time)):
        return signal
    if rate < LEAST_KEPT * own:
        raise ValueError(
            f"{path}: {signal.name} is sampled unevenly, {own:.4g} times a second, and resample_hz is {rate:g}, which "
            "would fold its fast parts into the slow ones. Set resample_hz to its rate; processing.rate_hz is that of "
            "the trials."
        )
    step, at = float(np.diff(time).max()), float(time[np.diff(time).argmax()])
    if step > max(LONGEST_LINE_S, 3 * float(np.median(np.diff(time)))):
        raise ValueError(
            f"{path}: nothing was sampled for {step:.3g} s after {at:.3f} s; resample_hz draws straight lines over at "
            f"most {LONGEST_LINE_S:g} s. Cut the file there."
        )
    even = time[0] + np.arange(int((time[-1] - time[0]) * rate) + 1) / rate
    return replace(signal, values=np.interp(even, time, signal.values), time=even)


def with_time(path: Path, signals: tuple[Signal, ...], names: Sequence[str] = ()) -> tuple[Signal, ...]:
    """The signals without the columns of times [s or ms], which they are given.

    Without names, of which files have one, one called time, time_s, time_ms, t or Zeit is taken, or the first in s or
    ms, or that rises and speaks of time. Where columns end in other rows, as two recorders' do, each has the times that
    end with it.
    """
    in_seconds = [one for one in signals if plain_unit(one.unit) in ("s", "ms")]
    of = [one for one in signals if not one.unit and _TIME_OF.fullmatch(one.name) and _rises(one)]
    called = [one for one in signals if (one.name in names if names else _TIME.fullmatch(one.name))]
    if names and not called:
        raise ValueError(
            f"{path}: no column {' or '.join(map(repr, names))} of times; the columns are "
            f"{', '.join(signal.name for signal in signals)}. Name that of each file: layout.time_column: [..., ...]."
        )
    if not (likely := called or in_seconds or of):
        return signals
    clocks = {likely[0].samples: likely[0]}
    for other in filter(_rises, (*likely, *in_seconds, *of)):
        time = clocks.setdefault(other.samples, other)
        if other in likely and not np.allclose(_seconds(path, other), _seconds(path, time), equal_nan=True):
            raise ValueError(
                f"{path}: {time.name} and {other.name} differ, and each may hold the times; name the right one as "
                "layout.time_column. What has a clock of its own belongs into a file of its own."
            )
    timed = []
    for one in (one for one in signals if one not in clocks.values()):
        end = min((end for end in clocks if end >= one.samples), default=max(clocks))
        timed.append(one.part(0, max(end, one.samples), _seconds(path, clocks[end])))
    return tuple(timed)


def _rises(signal: Signal) -> bool:
    return signal.samples > 1 and bool((np.diff(signal.values[: signal.samples]) > 0).all())


def _seconds(path: Path, time: Signal) -> Array:
    """Times of a column [s]."""
    unit = plain_unit(time.unit) or ("ms" if "ms" in re.split(r"[\W_]", time.name.lower()) else "s")
    if unit not in ("s", "ms"):
        raise ValueError(f"{path}: times are in {time.unit!r}; expected s or ms. Export it in seconds.")
    return time.values / 1000 if unit == "ms" else time.values
