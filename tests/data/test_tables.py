"""Angles beyond an arm's tables of path lengths: said up to a margin, refused farther out."""

from contextlib import chdir

import numpy as np
import pytest
from sessions import curl, session_section, write_session

from myowave.data.checks.values import beyond_tables
from myowave.data.importing import import_trials
from myowave.data.trials import Trials
from myowave.settings import PathTable, RecordedDataset

ANGLES = {"a": [10.0, 50.0, 90.0, 50.0], "b": [-2.0, 40.0, 103.0, 106.0], "c": [20.0, 30.0]}


@pytest.fixture
def tables(tmp_path):
    """Tables of two muscles, from 0 to 100 and to 120 deg; angles may be 10 and 2 deg beyond."""
    rows = [f"{m},{angle},{0.3 - 1e-4 * angle}" for m, end in (("X", 101), ("Y", 121)) for angle in range(0, end, 20)]
    file = tmp_path / "paths.csv"
    file.write_text("\n".join(["muscle,angle_deg,length_m", *rows]) + "\n")
    margins = {"X": 10.0, "Y": 2.0}
    return {m: PathTable(file=str(file), muscle=m, margin_deg=margin) for m, margin in margins.items()}


@pytest.fixture
def trials():
    angles = [np.radians(values) for values in ANGLES.values()]
    emg = [np.full((len(angle), 1), 0.5) for angle in angles]
    return Trials.from_sequences(
        dataset="me", dt=0.01, names=list(ANGLES), channels=["emg_biceps"], emg=emg, angle=angles, test=["c"]
    )


def test_the_share_of_samples_beyond_any_table_is_told(trials, tables):
    (found,), problems = beyond_tables(trials, tables)
    assert found.trial == "b" and not problems, "padding of shorter trials does not count"
    assert found.found.startswith("75 % of the samples are beyond the tables of path lengths, up to ")


def test_the_table_that_is_left_farthest_beyond_its_margin_is_named(trials, tables):
    narrow = tables | {"X": tables["X"].model_copy(update={"margin_deg": 5.0})}
    _, (said,) = beyond_tables(trials, narrow)
    assert "trial b: the angle is 106 deg, 6 deg beyond the table of muscle X (" in said
    assert "0 to 100 deg); expected at most 5 deg beyond." in said and "trial a" not in said
    assert "Is it in rad (unit), or is 180 the straight arm (sign: -1, offset_deg: 180)?" in said


def test_an_angle_below_a_table_counts_too(trials, tables):
    narrow = tables | {"Y": tables["Y"].model_copy(update={"margin_deg": 1.0})}
    _, (said,) = beyond_tables(trials, narrow)
    assert "trial b: the angle is -2 deg, 2 deg beyond the table of muscle Y" in said


def test_an_arm_without_tables_bounds_no_angle(trials):
    assert beyond_tables(trials, {}) == ([], [])


def test_a_session_reports_what_is_beyond_the_tables_and_refuses_what_is_too_far(tmp_path, tables):
    write_session(tmp_path)
    settings = RecordedDataset(**session_section())
    with chdir(tmp_path):
        prepared, quality = import_trials("me", settings, tables)
    share = np.degrees(prepared.trials.angle[0]) > 100
    notes = [f for f in quality["findings"] if f["check"] == "angle beyond the tables"]
    assert [f["trial"] for f in notes] == ["a", "b", "c"] and {f["severity"] for f in notes} == {"note"}
    assert notes[0]["found"].startswith(f"{100 * share.mean():.2g} % of the samples")
    far = {"X": tables["X"].model_copy(update={"margin_deg": 0.5 * (curl().max() - 100)})}
    with (
        chdir(tmp_path),
        pytest.raises(ValueError, match="trial a: the angle is 110 deg, 10 deg beyond the table.*trial b; trial c"),
    ):
        import_trials("me", settings, far)
