"""OpenSim's motion and storage files, .mot and .sto: a header that ends with `endheader`, then a table with `time`."""

import re
from dataclasses import replace
from pathlib import Path

from myowave.data.readers.signals import RawRecording
from myowave.data.readers.text import read_cells, read_head, separator_of, split_row, to_signals, with_time

_LONGEST_HEAD = 200


def read_opensim(path: Path) -> RawRecording:
    """Read one file; `inDegrees` in its header tells the unit of its angles.

    Raises:
        ValueError: if there is no `endheader` or no column `time`.
    """
    lines = read_head(path, _LONGEST_HEAD)
    end = next((n for n, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    if end is None or end + 1 >= len(lines):
        raise ValueError(
            f"{path}: no row with endheader and a row of names below it, as OpenSim's .mot and .sto have. Export it "
            "from OpenSim again, or name its format."
        )
    separator = separator_of(lines[end + 1])
    names = split_row(lines[end + 1], separator)
    if not names[-1]:
        names.pop()  # a separator at the end of the row
    if "time" not in names:
        raise ValueError(f"{path}, row {end + 2}: no column time among {', '.join(names)}. Export it with times.")
    cells = read_cells(path, separator, end + 2).iloc[:, : len(names)]
    signals = with_time(path, to_signals(path, cells, names), "time")
    unit = _angle_unit(lines[:end])
    return RawRecording(path, tuple(replace(signal, angle_unit=unit) for signal in signals), first_row=end + 3)


def _angle_unit(head: list[str]) -> str:
    """`deg` or `rad` as the header says, or nothing where it does not."""
    found = re.search(r"^\s*inDegrees\s*=?\s*(yes|no)", "\n".join(head), re.IGNORECASE | re.MULTILINE)
    return "" if found is None else "deg" if found[1].lower() == "yes" else "rad"
