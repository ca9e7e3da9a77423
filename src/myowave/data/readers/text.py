"""Text files, plain or compressed: how all readers of text open them."""

import codecs
import gzip
from pathlib import Path
from typing import BinaryIO, TextIO, cast

import pandas as pd

UTF_8, UTF_16 = "utf-8-sig", "utf-16"  # UTF-8 with or without a byte-order mark; UTF-16 has one
WINDOWS = "cp1252"  # what Western European recorders and spreadsheets write: µ and ° are one byte each
_HEAD_BYTES = 65_536  # names and units stand there; below them are digits


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
