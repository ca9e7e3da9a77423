"""EMG-BIDS: the files beside `sub-01_task-curl_emg.edf` that say units and rates where the recording itself does not.

Only `*_channels.tsv` (columns name, units, sampling_frequency) and SamplingFrequency of `*_emg.json` are read.
Source: brain imaging data structure, electromyography (bids-specification).
"""

import csv
from dataclasses import replace
from pathlib import Path

from myowave.data.json_files import read_json
from myowave.data.readers.signals import RawRecording, Signal
from myowave.data.readers.text import read_lines

_SUFFIX = "_emg"
_UNKNOWN = ("", "n/a")


def with_sidecars(recording: RawRecording) -> RawRecording:
    """The recording with units and rates of the files beside it; what it says itself stays."""
    name = recording.path.name.split(".")[0]
    if not name.endswith(_SUFFIX):
        return recording
    table = recording.path.with_name(name.removesuffix(_SUFFIX) + "_channels.tsv")
    channels = _channels(table)
    rate = _rate(recording.path.with_name(name + ".json"))
    try:
        signals = tuple(_filled(signal, channels.get(signal.name, {}), rate) for signal in recording.signals)
    except ValueError as error:
        raise ValueError(
            f"{table}: a sampling_frequency is no number ({error}). Correct it; n/a leaves it out."
        ) from None
    return replace(recording, signals=signals)


def _filled(signal: Signal, row: dict[str, str], rate: float | None) -> Signal:
    unit, own = (row.get(key) or "" for key in ("units", "sampling_frequency"))
    timed = signal.rate is not None or signal.time is not None
    return replace(
        signal,
        unit=signal.unit or ("" if unit in _UNKNOWN else unit),
        rate=signal.rate if timed else rate if own in _UNKNOWN else float(own),
    )


def _channels(path: Path) -> dict[str, dict[str, str]]:
    rows = csv.DictReader(read_lines(path) if path.is_file() else [], delimiter="\t")
    return {row["name"]: row for row in rows if row.get("name")}


def _rate(path: Path) -> float | None:
    if not path.is_file():
        return None
    content = read_json(path)
    rate = content.get("SamplingFrequency") if isinstance(content, dict) else None
    return float(rate) if isinstance(rate, int | float) else None
