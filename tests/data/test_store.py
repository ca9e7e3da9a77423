"""Tables on disk: what is written comes back exactly, and never half."""

import errno
from dataclasses import fields

import numpy as np
import pandas as pd
import pytest

from myowave.data.json_files import read_json, replacing, write_json
from myowave.data.store import (
    read_scales,
    read_table,
    read_trials,
    write_scales,
    write_table,
    write_trials,
)
from myowave.data.wavelets import decompose


def assert_same(left, right):
    for field in fields(left):
        a, b = getattr(left, field.name), getattr(right, field.name)
        if field.name == "signals":
            assert list(a) == list(b) and all(np.array_equal(a[name], b[name]) for name in a)
        else:
            assert np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b, field.name


def test_trials_come_back_exactly(trials, tmp_path):
    write_trials(trials, tmp_path / "deep" / "trials.parquet")
    assert_same(read_trials(tmp_path / "deep" / "trials.parquet"), trials)


def test_scales_come_back_exactly(trials, tmp_path):
    scales = decompose(trials, 2)
    write_scales(scales, tmp_path / "scales.parquet")
    back = read_scales(tmp_path / "scales.parquet")
    assert list(back) == [0, 1, 2]
    for level, expected in scales.items():
        assert_same(back[level], expected)


def test_the_table_is_long_with_units_in_its_columns_and_without_padding(trials, tmp_path):
    write_scales(decompose(trials, 1), tmp_path / "scales.parquet")
    frame = pd.read_parquet(tmp_path / "scales.parquet")
    assert list(frame.columns) == ["scale", "trial", "time_s", "emg_biceps", "emg_triceps", "angle_rad", "tilt_rad"]
    assert sorted(frame["scale"].unique()) == [-1, 0]
    assert frame.groupby(["scale", "trial"]).size()[(-1, "short")] == 80


def test_writing_twice_gives_the_same_bytes(trials, tmp_path):
    write_trials(trials, tmp_path / "a.parquet")
    write_trials(trials, tmp_path / "b.parquet")
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()


def test_a_failed_write_leaves_the_old_file_and_no_other(tmp_path):
    path = tmp_path / "result.json"
    write_json({"good": 1}, path)
    before = path.read_bytes()
    with pytest.raises(RuntimeError), replacing(path) as temporary:
        temporary.write_text("half a fi")
        raise RuntimeError
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(OSError) as full, replacing(path) as temporary:
        raise OSError(errno.ENOSPC, "No space left on device", temporary)
    assert full.value.filename == str(path) and list(tmp_path.iterdir()) == [path], "the file that was to be written"


def test_a_file_of_another_kind_is_refused_by_name(trials, tmp_path):
    path = tmp_path / "table.parquet"
    write_scales(decompose(trials, 1), path)
    with pytest.raises(ValueError, match="table.parquet: this Parquet file holds scales, expected trials"):
        read_trials(path)
    pd.DataFrame({"a": [1.0]}).to_parquet(path)
    with pytest.raises(ValueError, match="holds no myowave table, expected scales"):
        read_scales(path)
    path.write_text("time_s,emg_biceps\n")
    with pytest.raises(ValueError, match="table.parquet: this is not a Parquet file"):
        read_table(path)


def test_facts_come_back_and_what_is_no_json_is_refused_by_name(tmp_path):
    path = tmp_path / "facts.json"
    write_json({"µ": [1.5, None], "text": "°"}, path)
    assert read_json(path) == {"µ": [1.5, None], "text": "°"}
    for damaged in (path.read_bytes()[:9], b'{"a": "\xff"}'):
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match="facts.json: this is not JSON"):
            read_json(path)


def test_what_is_no_number_is_refused_and_the_file_from_before_stays(tmp_path):
    path = tmp_path / "facts.json"
    write_json({"error": None}, path)
    for value in (float("inf"), float("nan")):
        with pytest.raises(ValueError, match="not JSON compliant"):
            write_json({"error": value}, path)
    assert read_json(path) == {"error": None} and list(tmp_path.iterdir()) == [path]


def test_metadata_travels_with_any_table(tmp_path):
    frame = pd.DataFrame({"epoch": [1, 2], "loss": [0.5, 0.25]})
    write_table(frame, tmp_path / "history.parquet", {"seeds": [1, 2]})
    back, metadata = read_table(tmp_path / "history.parquet")
    pd.testing.assert_frame_equal(back, frame)
    assert metadata == {"seeds": [1, 2]}
