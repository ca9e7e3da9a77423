"""Delsys' CSV exports (EMGworks, Trigno Discover), in which each sensor has a column of times and a rate of its own.

    Label: Avanti sensor 1: EMG 1 Sampling frequency: 2148.148148 Number of points: ... (a row per channel, or none)

    X [s],Avanti sensor 1: EMG 1 [V],X [s],Avanti sensor 1: ACC X [g], ...
    0,1.2e-05,0,0.98, ...

Trigno Discover names the sensors in a row above, and rates in one below; some versions add a row of sampling intervals
with the names of a table of markers at the right:

    BICEPS (82345),,TRICEPS (82346),
    sensor mode: 40,,sensor mode: 40,
    EMG 1 Time Series (s),EMG 1 (mV),EMG 1 Time Series (s),EMG 1 (mV)
    ,2148.1481 Hz,,2148.1481 Hz
    ,0.000466 s,,0.000466 s,,Type,Name,Label,Time (s)
    0,0.012,0,-0.003,,General,start,,1.5

Markers are not read. Slower channels end in empty cells. European exports have semicolons between columns and commas in
decimals.
"""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from myowave.data.readers.signals import RawRecording, Signal
from myowave.data.readers.text import read_cells, read_lines, separator_of, split_row, split_unit, spread, to_signals

_TIME = re.compile(r"^(X|.*Time Series)\s*[\[(]s[\])]$", re.IGNORECASE)
_RATE = re.compile(r"^([\d.,]+)\s*Hz$", re.IGNORECASE)
_INTERVAL = re.compile(r"^[\d.,e-]+\s*s$", re.IGNORECASE)
_SERIAL = re.compile(r"\s*\(\d+\)$")
_LABEL = re.compile(r"^\W*Label:\s*(.*?)\s*Sampling frequency:\s*(\d+(?:[.,]\d+)?)", re.IGNORECASE)


def read_delsys(path: Path) -> RawRecording:
    lines = read_lines(path)
    header = next((n for n, line in enumerate(lines) if is_header(line)), None)
    if header is None:
        raise ValueError(
            f"{path}: no row begins with X [s] or ... Time Series (s), as Delsys' programs write it before the "
            "samples. Export it as CSV with times, or name its format, such as csv."
        )
    rows = [*map(_split, lines[header : header + 3]), [""], [""]]
    names, below, intervals = rows[:3]
    rates = {found[1]: _number(found[2]) for line in lines[:header] if (found := _LABEL.match(line))}
    markers = False
    if any(of_rates := [_RATE.match(cell) for cell in below]):
        names = _with_sensors(names, [_split(line) for line in lines[:header]])
        found = zip(names, of_rates, strict=False)
        rates |= {name: _number(rate[1]) for name, rate in found if rate}
        header += 1
        if any(map(_INTERVAL.match, intervals)):
            markers = any(intervals[len(names) :])
            header += 1
    # Rows have cells at the right only where a marker is; that with their names is the widest.
    separator = _separator(lines[header])
    cells = read_cells(path, lines, separator, header if markers else header + 1, separator != ",")
    if markers or (cells.iloc[:, len(names) :] == "").all(axis=None):
        cells = cells.iloc[int(markers) :, : len(names)]
    return RawRecording(path, tuple(_channels(to_signals(path, cells, names), rates)), first_row=header + 2)


def is_header(line: str) -> bool:
    """Whether a row names columns, the first of which is one of times."""
    return _TIME.match(_split(line)[0]) is not None


def _separator(line: str) -> str:
    return separator_of(line).replace(" ", ",")


def _split(line: str) -> list[str]:
    return split_row(line.rstrip(_separator(line) + " "), _separator(line))


def _number(text: str) -> float:
    return float(text.replace(",", "."))


def _with_sensors(names: list[str], above: list[list[str]]) -> list[str]:
    """Names of channels with those of their sensors before them, which stand once over all of a sensor's channels."""
    sensors = next((row for row in reversed(above) if not row[0].lower().startswith("sensor mode")), [])
    sensors = spread([_SERIAL.sub("", cell) for cell in sensors], len(names))
    return [f"{sensor} {name}".strip() for sensor, name in zip(sensors, names, strict=True)]


def _channels(columns: tuple[Signal, ...], rates: dict[str, float]) -> Iterator[Signal]:
    """Each channel with the column of times before it, both without what is empty at the end."""
    time = columns[0]
    for column in columns:
        if _TIME.match(column.name):
            time = column
            continue
        name, unit = split_unit(column.name)
        whole = column.part(0, column.samples, time.values)
        yield replace(whole, name=name, unit=unit, rate=rates.get(column.name, rates.get(name)))
