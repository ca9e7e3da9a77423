"""Prepared trials are those of the settings now, or the command that makes them is told."""

from pathlib import Path

import pytest
from sessions import session_section, write_session

from myowave.data.importing import import_trials
from myowave.data.prepared import prepared_file, read_prepared
from myowave.data.store import write_trials
from myowave.settings import RecordedDataset

CONFIG = [Path("config.yaml"), Path("my own.yaml")]
COMMAND = "snakemake --cores 1 results/data/me/trials.parquet --configfile config.yaml 'my own.yaml'"
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


@pytest.mark.parametrize(
    ("changes", "other"),
    [
        ({"conditions": {"a": {"load": 2.0}}}, "conditions.a"),
        ({"conditions": {"b": {"load": 1.0}}}, "conditions.a, conditions.b"),
        ({"constants": {}}, "constants"),
        ({"test": ["a"]}, "test"),
    ],
    ids=str,
)
def test_trials_of_other_settings_are_refused_with_the_command_that_makes_them(stored, changes, other):
    with pytest.raises(ValueError) as caught:
        read_prepared("me", settings(**changes), CONFIG)
    assert f"other {other} than data.datasets.me has now. Make it anew with: {COMMAND}" in str(caught.value)


def test_trials_of_these_settings_are_read_also_where_a_trial_was_named_since(stored):
    conditions = {**KNOWN["conditions"], "d": {"load": 3.0}}
    later = settings(trials=("a", "b", "c", "d"), test=["d", "c"], conditions=conditions)
    for now in (settings(), settings(about="curls"), later):
        assert read_prepared("me", now, CONFIG).conditions == stored.conditions


def test_where_none_were_made_the_command_has_the_files_of_settings(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError) as caught:
        read_prepared("me", settings(), CONFIG)
    assert str(caught.value) == f"results/data/me/trials.parquet: no such file. Make it with: {COMMAND}"
