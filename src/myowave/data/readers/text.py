"""Text files, plain or compressed: how all readers of text open them."""

import gzip
from pathlib import Path
from typing import TextIO

import pandas as pd

ENCODING = "utf-8-sig"  # UTF-8, with or without a byte-order mark


def open_text(path: Path) -> TextIO:
    """A text file to read from; one that ends in .gz is unpacked on the way."""
    if path.suffix.lower() == ".gz":
        return gzip.open(path, "rt", encoding=ENCODING, newline="")
    return path.open(encoding=ENCODING, newline="")


def read_head(path: Path, rows: int) -> list[str]:
    """The first rows of a file, without line ends.

    Raises:
        ValueError: if it is no text.
    """
    try:
        with open_text(path) as lines:
            return [line.rstrip("\r\n") for _, line in zip(range(rows), lines, strict=False)]
    except (UnicodeDecodeError, gzip.BadGzipFile) as error:
        raise ValueError(f"{path}: this is not UTF-8 text ({error}). Save it as text, UTF-8.") from None


def read_cells(path: Path, separator: str, skip: int = 0) -> pd.DataFrame:
    """All cells below the first `skip` rows, as text without blanks around it; blank rows at the end are left out.

    Args:
        separator: between columns; a single space stands for any number of blanks and tabs.

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
                dtype=str,
                keep_default_na=False,
                skip_blank_lines=False,
            )
    except pd.errors.EmptyDataError:
        raise ValueError(f"{path}: nothing below row {skip}; expected one row per sample.") from None
    except pd.errors.ParserError as error:
        raise ValueError(
            f"{path}: rows differ in their number of columns ({str(error).strip().split('C error: ')[-1]}). Say how it "
            "is written under layout, or export it again."
        ) from None
    cells = cells.fillna("").apply(lambda column: column.str.strip())
    written = (cells != "").any(axis=1).to_numpy().nonzero()[0]
    if not len(written):
        raise ValueError(f"{path}: nothing below row {skip}; expected one row per sample.")
    return cells.iloc[: written[-1] + 1]
