"""EDF and BDF, the European data format with 16 or 24 bits a sample, also as EDF+ and BDF+ without interruptions.

Names, dates and annotations in the header are not read: they may identify a person. Source: Kemp et al. 1992, A simple
format for exchange of digitized polygraphic recordings, and the specification of EDF+ (edfplus.info).
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from myowave.data.readers.signals import RawRecording, Signal, cut_short

_FIXED = 256  # bytes before the signals' part, and for each signal
_WIDTHS = (16, 80, 8, 8, 8, 8, 8, 80, 8, 32)  # label, transducer, unit, physical and digital ends, filter, samples


def read_edf(path: Path) -> RawRecording:
    content = path.read_bytes()
    bytes_each = 3 if content[:1] == b"\xff" else 2
    magic = b"\xffBIOSEMI" if bytes_each == 3 else b"0       "
    if len(content) < _FIXED or content[:8] != magic:
        raise ValueError(f"{path}: this is not an EDF or BDF file. Export it again, or name its format.")
    if content[192:197] in (b"EDF+D", b"BDF+D"):
        raise ValueError(f"{path}: the recording was interrupted (EDF+D). Export it as one without interruptions.")
    try:
        stated, count, seconds = int(content[236:244]), int(content[252:256]), float(content[244:252])
        fields = _fields(content, count)
        samples = [int(cell) for cell in fields[8]]
        scales = [[float(cell) for cell in fields[n]] for n in (3, 4, 5, 6)]
        if not 0 < seconds < math.inf or not np.isfinite(scales).all():
            raise ValueError("records of no length, or ends of a range that are no finite numbers")
        if any(low == high for ends in (scales[:2], scales[2:]) for low, high in zip(*ends, strict=True)):
            raise ValueError("ends of a range that are equal")
    except ValueError as error:
        raise ValueError(f"{path}: the header of this EDF cannot be read ({error}). Export it again.") from None
    records = _records(path, content[_FIXED * (count + 1) :], sum(samples), bytes_each)
    if stated not in (-1, len(records)):  # -1: not known when the recording began
        raise cut_short(path, f"{len(records)} records of {seconds:g} s", stated)
    first = np.cumsum([0, *samples])
    signals = []
    for n, label in enumerate(fields[0]):
        if label.endswith("Annotations") or samples[n] == 0:
            continue
        low, high, digital_low, digital_high = (ends[n] for ends in scales)
        digital = records[:, first[n] : first[n + 1]].reshape(-1).astype(np.float64)
        values = low + (digital - digital_low) * (high - low) / (digital_high - digital_low)
        signals.append(Signal(label, values, unit=fields[2][n], rate=samples[n] / seconds))
    return RawRecording(path, tuple(signals))


def _fields(content: bytes, count: int) -> list[list[str]]:
    """The columns of the signals' part of the header, as text."""
    start, fields = _FIXED, []
    for width in _WIDTHS:
        cells = [content[start + n * width : start + (n + 1) * width] for n in range(count)]
        fields.append([cell.decode("latin-1").strip() for cell in cells])
        start += width * count
    return fields


def _records(path: Path, data: bytes, samples: int, bytes_each: int) -> NDArray[np.signedinteger[Any]]:
    """Digital values, (records, samples of all signals in one)."""
    size = samples * bytes_each
    if size == 0 or len(data) < size or len(data) % size:
        raise ValueError(
            f"{path}: {len(data)} bytes of samples are no whole number of records of {size}; the file was cut short. "
            "Copy or export it again."
        )
    if bytes_each == 2:
        return np.frombuffer(data, dtype="<i2").reshape(-1, samples)
    wide = np.zeros((len(data) // 3, 4), dtype=np.uint8)
    wide[:, 1:] = np.frombuffer(data, dtype=np.uint8).reshape(-1, 3)
    return (wide.view("<i4")[:, 0] >> 8).reshape(-1, samples)  # the sign of 24 bits is kept by the shift
