"""Import of recordings: good files come in unchanged, and each fault is named with its file, row and remedy."""

import re
from contextlib import chdir
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from myowave.data.importing import import_trials
from myowave.settings import MeasuredDataset

ROOT = Path(__file__).parents[2]
CHANNELS = {"emg_biceps": 1, "emg_triceps": -1}


def recording(seed=0, samples=100, dt=0.01):
    random = np.random.default_rng(seed)
    return pd.DataFrame(
        {
            "time_s": np.round(np.arange(samples) * dt, 6),
            "emg_biceps": random.random(samples),
            "emg_triceps": random.random(samples),
            "angle_rad": 0.5 + 0.5 * np.sin(np.arange(samples) * dt + seed),
        }
    )


@pytest.fixture
def folder(tmp_path):
    """Three good recordings, which a test then spoils."""
    for seed in (1, 2, 3):
        recording(seed).to_csv(tmp_path / f"trial{seed}.csv", index=False)
    return tmp_path


def load(folder, files=("trial*.csv",), test=("trial3",), channels=CHANNELS, **settings):
    block = MeasuredDataset(kind="measured", files=files, test=test, **settings)
    with chdir(folder):
        return import_trials("elbow", block, channels=channels)[0].trials


def refuse(folder, *patterns, **settings):
    """The import fails, and each pattern matches one line of the message."""
    with pytest.raises(ValueError) as caught:
        load(folder, **settings)
    lines = str(caught.value).splitlines()
    for pattern in patterns:
        assert any(re.search(pattern, line) for line in lines), f"{pattern!r} not in:\n{caught.value}"
    return lines


def spoil(folder, change, name="trial2"):
    frame = pd.read_csv(folder / f"{name}.csv")
    frame = change(frame)
    frame.to_csv(folder / f"{name}.csv", index=False)


# ------------------------------------------------------------------------------------------------ what comes in


def test_good_files_come_in_as_they_are(folder):
    trials = load(folder, conditions={"trial1": {"load": 1.0}}, constants={"mass": 1.3})
    assert trials.names == ("trial1", "trial2", "trial3") and trials.train == ("trial1", "trial2")
    assert trials.dt == pytest.approx(0.01)
    for i, seed in enumerate((1, 2, 3)):
        expected = recording(seed)
        assert np.abs(trials.angle[i] - expected["angle_rad"]).max() < 1e-12
        assert np.abs(trials.emg[i] - expected[list(CHANNELS)]).to_numpy().max() < 1e-12
    assert trials.conditions == {"trial1": {"load": 1.0}} and trials.constants == {"mass": 1.3}


@pytest.mark.parametrize("corner", [None, 6.0])
def test_the_low_pass_of_another_program_is_known_where_it_is_told(folder, corner):
    assert load(folder, envelope_low_pass_hz=corner).emg_low_pass_hz == corner


def test_the_example_that_ships_comes_in():
    trials = load(ROOT, files=("data/bench_elbow/*.csv",))
    assert trials.emg.shape == (5, 500, 2) and trials.dt == pytest.approx(0.01, rel=1e-9)


def test_parquet_degrees_column_order_and_lengths_make_no_difference(folder):
    frame = recording(2, samples=80)
    frame["angle_deg"] = np.degrees(frame.pop("angle_rad"))
    frame[["angle_deg", "emg_triceps", "time_s", "emg_biceps"]].to_parquet(folder / "trial2.parquet")
    (folder / "trial2.csv").unlink()
    trials = load(folder, files=("trial*",))
    assert trials.lengths == (100, 80, 100)
    assert np.abs(trials.angle[1, :80] - recording(2)["angle_rad"][:80]).max() < 1e-12
    assert np.abs(trials.emg[1, :80, 1] - frame["emg_triceps"]).max() < 1e-12


@pytest.mark.parametrize(("name", "factor"), [("time", 1), ("t", 1), ("time_ms", 1000), ("Time [ms]", 1000)])
def test_times_may_be_called_and_counted_as_in_other_tables(folder, name, factor):
    expected = load(folder)
    for n in (1, 2, 3):
        spoil(folder, lambda f: f.assign(time_s=factor * f.time_s).rename(columns={"time_s": name}), f"trial{n}")
    trials = load(folder)
    assert trials.dt == pytest.approx(0.01) and np.allclose(trials.angle, expected.angle)


@pytest.mark.parametrize("unit", ["rad", "deg"])
def test_angles_that_are_180_minus_the_angle_are_turned_by_the_settings(folder, unit):
    expected, half_turn = load(folder), {"rad": np.pi, "deg": 180.0}[unit]
    for n in (1, 2, 3):
        angle = half_turn - recording(n)["angle_rad"] * half_turn / np.pi
        spoil(folder, lambda f, q=angle: f.drop(columns="angle_rad").assign(**{f"angle_{unit}": q}), f"trial{n}")
    assert np.allclose(load(folder, angle={"sign": -1, "offset_deg": 180}).angle, expected.angle)
    assert load(folder).angle.min() > np.pi / 2


def test_columns_that_are_named_as_not_needed_do_no_harm(folder):
    spoil(folder, lambda f: f.assign(emg_brachialis="n/a", acc_x=[""] + [1.0] * 99))
    trials = load(folder, ignore_columns=("acc_*", "emg_brachialis"))
    assert trials.channels == tuple(CHANNELS) and trials.provenance["ignored columns"] == ["acc_*", "emg_brachialis"]
    assert np.abs(trials.emg[1] - recording(2)[list(CHANNELS)]).to_numpy().max() < 1e-12
    refuse(folder, "trial2.csv: column emg_brachialis is not used", ignore_columns=("acc_*",))


def test_torque_of_a_dynamometer_comes_in_where_it_was_measured(folder):
    assert not load(folder).signals
    spoil(folder, lambda f: f.assign(torque_Nm=np.linspace(-3, 9, len(f))))
    torque = load(folder).signals["torque_Nm"]
    assert np.isnan(torque[[0, 2]]).all() and np.abs(torque[1] - np.linspace(-3, 9, 100)).max() < 1e-12


def test_an_empty_column_is_no_file_to_cut(folder):
    spoil(folder, lambda f: f.assign(emg_triceps=np.nan))
    refuse(folder, "emg_triceps is '' .*such rows.; expected a finite number. Was the sensor off")


def test_a_torque_in_another_unit_or_of_no_sensor_is_refused(folder):
    spoil(folder, lambda f: f.assign(torque_Nm=np.linspace(-300, 9000, len(f))))
    spoil(folder, lambda f: f.assign(torque_Nm=0.0), name="trial1")
    refuse(
        folder, r"trial2.csv, row 101: the torque is 9000 .* expected -300 to 300", "trial1.csv: the torque stays at 0"
    )


def test_trials_come_in_natural_order(folder):
    recording(10).to_csv(folder / "trial10.csv", index=False)
    recording(11).to_csv(folder / "trial1²3.csv", index=False)  # whose sign is a digit, and no number
    assert load(folder).names == ("trial1", "trial1²3", "trial2", "trial3", "trial10")


def test_what_an_archive_of_a_mac_leaves_beside_the_files_is_none_of_them(folder):
    (folder / "._trial2.csv").write_bytes(b"\0\5\x16\7\0\2")
    assert load(folder, files=("*.csv",)).names == ("trial1", "trial2", "trial3")


def test_absolute_paths_and_named_files_work(folder):
    trials = load(Path("/"), files=(str(folder / "trial3.csv"), str(folder / "trial[12].csv")))
    assert trials.names == ("trial3", "trial1", "trial2")


@pytest.mark.parametrize(("dt", "digits"), [(1 / 60, 3), (np.sqrt(1e-3), 3), (1 / 30, 4), (0.01, 2)])
def test_times_rounded_by_a_spreadsheet_are_uniform(folder, dt, digits):
    for seed in (1, 2, 3):
        frame = recording(seed, dt=dt)
        frame["time_s"] = np.round(np.arange(100) * dt + 12.5, digits)
        frame.to_csv(folder / f"trial{seed}.csv", index=False)
    assert load(folder).dt == pytest.approx(dt, rel=1e-3)


def test_text_between_number_and_number_is_found_in_the_times_too(folder):
    spoil(folder, set_cell("time_s", 60, "n/a"))
    refuse(folder, r"trial2.csv, row 60: the time is no finite number \(1 such rows\)")


@pytest.mark.parametrize("separator", [";", "\t"])
def test_a_table_of_another_country_comes_in_as_it_is(folder, separator):
    recording(2).to_csv(folder / "trial2.csv", index=False, sep=separator, decimal=",")
    assert np.abs(load(folder).emg[1] - recording(2)[list(CHANNELS)]).to_numpy().max() < 1e-12


def test_what_editors_leave_behind_does_no_harm(folder):
    """A byte-order mark, spaces after commas, Windows line ends, and blank lines at the end."""
    text = (folder / "trial2.csv").read_text().replace(",", ", ").replace("\n", "\r\n")
    (folder / "trial2.csv").write_bytes(b"\xef\xbb\xbf" + text.encode() + b"\r\n\r\n")
    assert np.abs(load(folder).angle[1] - recording(2)["angle_rad"]).max() < 1e-12


# ----------------------------------------------------------------------------------------------- what is refused


def set_cell(column, row, value):
    def change(frame):
        frame[column] = frame[column].astype(object)
        frame.loc[row - 2, column] = value  # rows as an editor counts them: the header is row 1
        return frame

    return change


def test_a_blank_line_inside_does_not_shift_the_rows(folder):
    lines = (folder / "trial2.csv").read_text().splitlines()
    (folder / "trial2.csv").write_text("\n".join([*lines[:20], "", *lines[20:]]))
    refuse(folder, "trial2.csv, row 21: emg_biceps is ''")


def test_a_file_that_is_no_text_or_no_parquet_is_refused(folder):
    (folder / "trial2.csv").write_bytes(b"\xff\xfe\x00time")
    (folder / "broken.parquet").write_bytes(b"PAR0")
    refuse(folder, "trial2.csv: this is not UTF-8 text", "broken.parquet: this is not a Parquet", files=("*.*",))


def test_a_missing_file_says_where_it_was_looked_for_and_what_is_there(folder):
    looked = (
        f"trial9.csv: no such file; looked for {re.escape(str(folder))}/trial9.csv. .* holds trial1.csv, trial2.csv"
    )
    refuse(folder, looked, files=("trial*.csv", "trial9.csv"))
    refuse(folder, f"none/\\*.csv: no such file.*The folder {re.escape(str(folder))} holds", files=("none/*.csv",))


@pytest.mark.parametrize("pattern", ["*.csv", "trial?.csv", "trial9.csv"])
def test_a_link_to_nothing_is_named_and_not_left_out(folder, pattern):
    (folder / "trial9.csv").symlink_to("/nowhere/trial9.csv")
    refuse(folder, "trial9.csv: a link to /nowhere/trial9.csv, which is not there", files=("trial1.csv", pattern))


@pytest.mark.parametrize("name", ["tri$al$", "{trial}", "tri[al]", "tri\\al", "trial\n2"])
def test_a_name_that_figures_or_the_workflow_would_read_otherwise_is_refused(folder, name):
    (folder / "trial2.csv").rename(folder / f"{name}.csv")
    refuse(folder, "rename the (trial, which is named after its )?file", files=("*.csv",))


def damaged(where: float) -> bytes:
    """A Parquet table with one byte changed, at a fraction of its length."""
    content = BytesIO()
    recording(2).to_parquet(content, compression="snappy", write_page_checksum=True)
    content = bytearray(content.getvalue())
    content[int(where * len(content))] ^= 0xFF
    return bytes(content)


@pytest.mark.parametrize("where", [0.02, 0.2, 0.5, 0.6, 0.9, 0.9999])
def test_a_damaged_table_is_refused(folder, where):
    (folder / "trial2.csv").unlink()
    (folder / "trial2.parquet").write_bytes(damaged(where))
    refuse(folder, "trial2.parquet: this is not a Parquet file, or it is damaged", files=("trial*",))


def test_a_table_cut_short_is_refused(folder):
    recording(2).to_parquet(folder / "trial4.parquet")
    (folder / "trial4.parquet").write_bytes((folder / "trial4.parquet").read_bytes()[:500])
    refuse(folder, "trial4.parquet: this is not a Parquet file, or it is damaged", files=("trial*",))


def test_files_of_another_kind_or_name_taken_twice_are_refused(folder):
    (folder / "notes.txt").write_text("hello")
    (folder / "again").mkdir()
    recording(4).to_csv(folder / "again" / "trial1.csv", index=False)
    refuse(folder, "notes.txt: the ending is '.txt'; expected .csv or .parquet", files=("*.*",))
    refuse(folder, "another trial is called 'trial1'", files=("trial*.csv", "again/*.csv"))


def test_trials_named_in_the_settings_must_exist_and_some_must_train(folder):
    refuse(folder, "elbow.test: no trial named trial8; the trials are trial1, trial2, trial3", test=("trial8",))
    refuse(folder, "elbow.conditions: no trial named x", conditions={"x": {"load": 1.0}})
    refuse(folder, "every trial .* is a test trial", test=("trial1", "trial2", "trial3"))


def test_without_a_model_all_trials_must_still_have_the_same_channels(folder):
    spoil(folder, lambda frame: frame.drop(columns="emg_triceps"))
    refuse(folder, "trial2.csv: column 'emg_triceps' is not there", channels=None)


def test_a_file_that_office_has_open_is_no_second_trial(folder):
    (folder / "~$trial1.csv").write_bytes(b"\x07Someone" + bytes(100))
    assert load(folder, files=("*.csv",)).names == ("trial1", "trial2", "trial3")


def test_all_problems_of_all_files_are_told_at_once(folder):
    spoil(folder, set_cell("emg_biceps", 17, "n/a"), "trial1")
    spoil(folder, lambda frame: frame.assign(angle_rad=90.0, emg_biceps=-1.0), "trial2")
    expected = ("trial1.csv, row 17", "trial2.csv, row 2: the angle", "trial2.csv, row 2: emg", "no trial named")
    lines = refuse(folder, *expected, test=("trial7",))
    assert lines[0] == "dataset 'elbow' cannot be imported, 4 problems:" and len(lines) == 5


def test_what_a_filter_leaves_below_0_is_0(folder):
    spoil(folder, lambda f: f.assign(emg_triceps=f.emg_triceps.where(f.index != 40, -0.02)))
    emg = load(folder).emg[1, :, 1]
    assert emg[40] == 0.0 and np.count_nonzero(emg == 0) == 1
    spoil(folder, lambda f: f.assign(emg_triceps=f.emg_triceps.where(f.index != 40, -0.2)))
    refuse(folder, "row 42: emg_triceps is -0.2 .*expected 0 to 1.5")
