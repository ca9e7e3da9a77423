"""Comma-separated text with one header row, as a spreadsheet writes it."""

from pathlib import Path

import pandas as pd

from myowave.data.readers.frames import to_signals
from myowave.data.readers.signals import RawRecording

_ENCODING = "utf-8-sig"  # UTF-8, with or without a byte-order mark


def read_csv(path: Path) -> RawRecording:
    """Read one file; rows count as an editor counts them.

    Raises:
        ValueError: if the file is empty, no text, or not a table with commas between columns.
    """
    try:
        _refuse_other_separators(path)
        cells = pd.read_csv(
            path, header=None, dtype=str, keep_default_na=False, skip_blank_lines=False, encoding=_ENCODING
        )
    except pd.errors.EmptyDataError:
        raise ValueError(_empty(path)) from None
    except pd.errors.ParserError as error:
        raise ValueError(
            f"{path}: rows differ in their number of columns ({str(error).strip().split('C error: ')[-1]}). Save it "
            "with a comma between columns and a point in decimals (0.5, not 0,5)."
        ) from None
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: this is not UTF-8 text ({error.reason}). Save it as CSV, UTF-8.") from None
    cells = cells.fillna("").apply(lambda column: column.str.strip())
    written = (cells != "").any(axis=1).to_numpy().nonzero()[0]
    if not len(written):
        raise ValueError(_empty(path))
    frame = cells.iloc[1 : written[-1] + 1]  # blank rows at the end are no samples
    return RawRecording(path, to_signals(frame, cells.iloc[0].tolist()), first_row=2)


def _empty(path: Path) -> str:
    return f"{path}: the file is empty; expected a header and one row per sample."


def _refuse_other_separators(path: Path) -> None:
    with path.open(encoding=_ENCODING) as lines:
        first_line = lines.readline()
    for separator, name in ((";", "semicolons"), ("\t", "tabs")):
        if separator in first_line and "," not in first_line:
            raise ValueError(
                f"{path}, row 1: columns are separated by {name}; expected commas, and points in decimals (0.5, not "
                "0,5). Export it again, or rewrite it with "
                f"pandas.read_csv(file, sep={separator!r}, decimal=',').to_csv(file, index=False)."
            )
