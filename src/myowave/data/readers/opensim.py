"""OpenSim's motion and storage files, .mot and .sto: a header that ends with `endheader`, then a table with `time`."""

import re
from dataclasses import replace
from pathlib import Path

from myowave.data.readers.signals import RawRecording, cut_short
from myowave.data.readers.text import read_cells, read_lines, separator_of, split_row, to_signals, with_time

_UNIT = re.compile(r"\s*inDegrees\s*=?\s*(yes|no)", re.IGNORECASE)
_ROWS = re.compile(r"\s*(?:nRows|datarows)\s*=?\s*(\d+)", re.IGNORECASE)


def read_opensim(path: Path) -> RawRecording:
    """Read one file; `inDegrees` in its header tells the unit of its angles."""
    lines = read_lines(path)
    names_row = next((n + 1 for n, line in enumerate(lines) if line.strip().lower() == "endheader"), len(lines))
    if names_row == len(lines):
        raise ValueError(
            f"{path}: no row with endheader and a row of names below it, as OpenSim's .mot and .sto have. Export it "
            "from OpenSim again, or name its format."
        )
    separator = separator_of(lines[names_row])
    names = split_row(lines[names_row].rstrip(separator), separator)
    if "time" not in names:
        raise ValueError(f"{path}, row {names_row + 1}: no column time among {', '.join(names)}. Export it with times.")
    said = next((found[1].lower() for line in lines[:names_row] if (found := _UNIT.match(line))), "")
    unit = {"yes": "deg", "no": "rad"}.get(said, "")
    cells = read_cells(path, lines, separator, names_row + 1).iloc[:, : len(names)]
    stated = next((int(found[1]) for line in lines[:names_row] if (found := _ROWS.match(line))), len(cells))
    if len(cells) < stated:
        raise cut_short(path, f"{len(cells)} rows", stated)
    signals = with_time(path, to_signals(path, cells, names), ["time"])
    return RawRecording(path, tuple(replace(one, angle_unit=unit) for one in signals), first_row=names_row + 2)
