"""Prepared trials are those of the settings now, or the command that makes them is told."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from sessions import ANGLE_HZ, burst, curl, session_section, write_session

from myowave.data.importing import import_trials
from myowave.data.prepared import prepared_file, read_prepared
from myowave.data.store import write_trials
from myowave.settings import MeasuredDataset, RecordedDataset

CONFIG = [Path("config.yaml"), Path("my own.yaml")]
COMMAND = "snakemake --cores 1 results/data/me/trials.parquet --configfile config.yaml 'my own.yaml'"
SECTION = session_section()
KNOWN = {"conditions": {"a": {"load": 1.0}}, "constants": {"mass": 1.4}}


def settings(**changes):
    return RecordedDataset(**session_section(**{**KNOWN, **changes}))


@pytest.fixture
def stored(tmp_path, monkeypatch):
    """Prepared trials, whose lean was recorded."""
    monkeypatch.chdir(tmp_path)
    write_session(tmp_path)
    trials = import_trials("me", settings())[0].trials
    write_trials(trials, prepared_file("me"))
    return trials


@pytest.fixture
def tidy(tmp_path, monkeypatch):
    """Prepared trials of tidy files, their dataset, and what makes another one of it."""
    monkeypatch.chdir(tmp_path)
    for seed, trial in enumerate("abc"):
        angle = curl() + 1e-6 * seed
        columns = {"time_s": np.arange(1200) / ANGLE_HZ, "emg_biceps": np.abs(burst(seed, rate=ANGLE_HZ)) / 200}
        pd.DataFrame({**columns, "angle_deg": angle}).to_csv(f"{trial}.csv", index=False)

    def now(**changes):
        return MeasuredDataset(**{"kind": "measured", "files": ["a.csv", "b.csv", "c.csv"], "test": ["c"], **changes})

    write_trials(import_trials("me", now())[0].trials, prepared_file("me"))
    return now(), now


@pytest.mark.parametrize(
    ("changes", "other"),
    [
        ({"conditions": {"a": {"load": 2.0}}}, "conditions.a"),
        ({"conditions": {"b": {"load": 1.0}}}, "conditions.a, conditions.b"),
        ({"constants": {}}, "constants"),
        ({"test": ["a"]}, "test"),
        ({"processing": {"low_pass_hz": 8.0}, "envelope_low_pass_hz": 6.0}, "envelope_low_pass_hz, processing"),
        ({"cut_s": {"a": [2.0, 9.0]}}, "cut_s"),
        ({"angle": {**SECTION["angle"], "sign": -1, "offset_deg": 180}}, "angle"),
        ({"emg": {channel: {**one, "unit": "mV"} for channel, one in SECTION["emg"].items()}}, "emg"),
    ],
    ids=str,
)
def test_trials_of_other_settings_are_refused_with_the_command_that_makes_them(stored, changes, other):
    with pytest.raises(ValueError) as caught:
        read_prepared("me", settings(**changes), CONFIG)
    assert f"other {other} than data.datasets.me has now. Make it anew with: {COMMAND}" in str(caught.value)


def test_trials_of_these_settings_are_read_also_where_a_trial_was_named_since(stored):
    conditions = {**KNOWN["conditions"], "d": {"load": 3.0}}
    cut = {"cut_s": {"d": [2.0, 9.0]}, "recordings": {"d": "c"}}
    later = settings(trials=("a", "b", "c", "d"), test=["d", "c"], conditions=conditions, **cut)
    for now in (settings(), settings(about="curls"), later):
        assert read_prepared("me", now, CONFIG).conditions == stored.conditions


def test_the_angle_of_tidy_files_and_the_low_pass_of_their_emg_count_and_a_file_that_was_added_does_not(tidy):
    dataset, now = tidy
    read_prepared("me", now(about="curls", files=[*dataset.files, "d.csv"], ignore_columns=["x"]), CONFIG)
    for other in ({"angle": {"offset_deg": 5.0}}, {"envelope_low_pass_hz": 6.0}):
        with pytest.raises(ValueError, match=f"other {next(iter(other))} than data.datasets.me has now"):
            read_prepared("me", now(**other), CONFIG)


def test_where_none_were_made_the_command_has_the_files_of_settings(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError) as caught:
        read_prepared("me", settings(), CONFIG)
    assert str(caught.value) == f"results/data/me/trials.parquet: no such file. Make it with: {COMMAND}"
