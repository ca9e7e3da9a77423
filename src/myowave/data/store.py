"""Tables on disk: Parquet with the metadata in the schema. The only module that imports pyarrow.

A table of trials is long: one row per sample, columns `trial, time_s, emg_<muscle>..., angle_rad`, and further signals
such as `tilt_rad` where they were recorded. A table of scales has a `scale` column before them (0, -1, ..., -J). What
is no column travels as JSON in the schema metadata, so a file is complete by itself.
"""

import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from myowave.data.json_files import replacing
from myowave.data.trials import Trials

METADATA_KEY = b"myowave"
_LABELS = [field.name for field in fields(Trials) if field.name not in ("emg", "angle", "signals", "lengths")]


def write_table(frame: pd.DataFrame, path: str | Path, metadata: Mapping[str, Any] | None = None) -> None:
    """Write a table to Parquet, atomically; `metadata` (JSON-able) goes into the schema."""
    table = pa.Table.from_pandas(frame, preserve_index=False)
    table = table.replace_schema_metadata({METADATA_KEY: json.dumps(metadata or {}).encode()})
    with replacing(path) as temporary:
        pq.write_table(table, temporary, write_page_checksum=True)


def read_table(path: str | Path) -> tuple[pd.DataFrame, dict[str, Any]]:
    """Read a Parquet table and the metadata that `write_table` put in it (empty for a foreign file). A ValueError for a
    file that is none, or damaged: pages of what `write_table` wrote carry checksums. An OSError for one that is not
    there, or may not be read."""
    with open(path, "rb") as file:
        try:
            table = pq.ParquetFile(file, page_checksum_verification=True).read()
            metadata = json.loads((table.schema.metadata or {}).get(METADATA_KEY, b"{}"))
            return table.replace_schema_metadata(None).to_pandas(), metadata
        except Exception as error:  # whatever damaged bytes make the reader raise
            reason = " ".join(str(error).split()) or type(error).__name__
            raise ValueError(
                f"{path}: this is not a Parquet file, or it is damaged ({reason[:200]}). Write it again, or remove it."
            ) from error


def write_trials(trials: Trials, path: str | Path) -> None:
    write_table(_to_frame(trials), path, _to_metadata(trials))


def read_trials(path: str | Path) -> Trials:
    """Read trials written by `write_trials`; a ValueError for a file that holds none."""
    frame, metadata = _read_kind("trials", path)
    return _from_frame(frame, metadata, path)


def write_scales(scales: Mapping[int, Trials], path: str | Path) -> None:
    """Write the projections of one dataset, {coarsenings: trials at that scale}; level 2 is written as scale -2."""
    frames = {-level: _to_frame(trials) for level, trials in scales.items()}
    table = pd.concat(frames, names=["scale", None]).reset_index("scale")
    write_table(table, path, _to_metadata(scales[min(scales)]) | {"kind": "scales"})


def read_scales(path: str | Path) -> dict[int, Trials]:
    """Read what `write_scales` wrote, {coarsenings: trials at that scale}; a ValueError where there is none."""
    frame, metadata = _read_kind("scales", path)
    return {-int(scale): _from_frame(rows, metadata, path) for scale, rows in frame.groupby("scale", sort=False)}


def _to_frame(trials: Trials) -> pd.DataFrame:
    """Long table of the recorded samples, padding left out."""
    valid = trials.valid
    columns = {"trial": np.repeat(np.array(trials.names, dtype=object), trials.lengths)}
    columns["time_s"] = np.broadcast_to(trials.time, valid.shape)[valid]
    columns |= {name: trials.emg[..., c][valid] for c, name in enumerate(trials.channels)}
    columns["angle_rad"] = trials.angle[valid]
    columns |= {name: values[valid] for name, values in trials.signals.items()}
    return pd.DataFrame(columns)


def _to_metadata(trials: Trials) -> dict[str, Any]:
    """Everything but the samples; mappings and tuples are plain data."""
    return {"kind": "trials", "signals": list(trials.signals), **{name: getattr(trials, name) for name in _LABELS}}


def _from_frame(frame: pd.DataFrame, metadata: Mapping[str, Any], path: str | Path) -> Trials:
    try:
        labels = {name: metadata[name] for name in _LABELS}
        rows = [frame[frame["trial"] == name] for name in labels["names"]]
        return Trials.from_sequences(
            emg=[one[labels["channels"]].to_numpy() for one in rows],
            angle=[one["angle_rad"].to_numpy() for one in rows],
            signals={name: [one[name].to_numpy() for one in rows] for name in metadata["signals"]},
            **labels,
        )
    except KeyError as error:
        raise ValueError(
            f"{path}: written by another version of myowave (no {error}). Remove it, and run again."
        ) from None


def _read_kind(kind: str, path: str | Path) -> tuple[pd.DataFrame, dict[str, Any]]:
    frame, metadata = read_table(path)
    if (found := metadata.get("kind")) != kind:
        raise ValueError(
            f"{path}: this Parquet file holds {found or 'no myowave table'}, expected {kind}. Recordings of your own "
            "are named under data.datasets in config.yaml and imported, not read directly."
        )
    return frame, metadata
