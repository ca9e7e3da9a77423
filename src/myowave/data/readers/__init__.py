"""Readers: one file for each format, each a pure function from a path to raw signals.

A reader knows its format and nothing else, and raises a ValueError that names the file where it is of another one: what
columns there must be, and whether their values make sense, is for `data.checks`; units are converted in `data.reading`.
Labels in files may hold people's names: what is kept of a recording goes by the names that the settings give. A new
format is a new file here and a line in `READERS`.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from myowave.data.readers.bids import with_sidecars
from myowave.data.readers.c3d import read_c3d
from myowave.data.readers.delimited import read_delimited
from myowave.data.readers.delsys import read_delsys
from myowave.data.readers.edf import read_edf
from myowave.data.readers.matlab import read_matlab
from myowave.data.readers.noraxon import read_noraxon
from myowave.data.readers.opensim import read_opensim
from myowave.data.readers.parquet import read_parquet
from myowave.data.readers.signals import RawRecording, Signal
from myowave.data.readers.vicon import read_vicon
from myowave.settings import TextLayout
from myowave.settings.files import require_regular

READERS: dict[str, Callable[[Path], RawRecording]] = {  # by the name of the format in the settings
    "csv": read_delimited,
    "parquet": read_parquet,
    "noraxon": read_noraxon,
    "delsys": read_delsys,
    "vicon": read_vicon,
    "opensim": read_opensim,
    "matlab": read_matlab,
    "c3d": read_c3d,
    "edf": read_edf,
}

ENDINGS = {  # what they stand for where the settings name no format; .gz may follow that of a text
    ".csv": "csv",
    ".tsv": "csv",
    ".txt": "csv",
    ".parquet": "parquet",
    ".mot": "opensim",
    ".sto": "opensim",
    ".mat": "matlab",
    ".c3d": "c3d",
    ".edf": "edf",
    ".bdf": "edf",
}


def ending_of(path: Path) -> str:
    """The ending in small letters, that before .gz where the file is packed."""
    return ("".join(path.suffixes[-2:-1]) if path.suffix.lower() == ".gz" else path.suffix).lower()


def read_raw(path: Path, form: str | None = None, layout: TextLayout | None = None) -> RawRecording:
    """Read a file in a format of `READERS`, None goes by the ending; `layout` says how tables of text are written. A
    ValueError if the ending says nothing, or the file cannot be read as that format."""
    form = form or ENDINGS.get(ending_of(path))
    if form is None:
        raise ValueError(
            f"{path}: the ending {path.suffix!r} says nothing of the format; expected {', '.join(ENDINGS)}. Name the "
            f"format: {', '.join(READERS)}."
        )
    require_regular(path)
    reader = partial(read_delimited, layout=layout) if form == "csv" else READERS[form]
    try:
        recording = with_sidecars(reader(path))
    except PermissionError as error:
        raise ValueError(f"{path}: the file cannot be opened ({error.strerror}). Allow it to be read.") from None
    except Exception as error:  # whatever its bytes make the reader raise
        if isinstance(error, ValueError) and str(path.parent) in str(error):  # it names the file, or one beside it
            raise
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise ValueError(
            f"{path}: this file is damaged, or of another format ({reason[:200]}). Copy or export it again, or "
            "name its format."
        ) from error
    if not recording.signals:
        raise ValueError(
            f"{path}: no signal in it; expected numbers of at least one beside its time. Read as {form}; export it "
            "again with its signals, or name its format."
        )
    return recording
