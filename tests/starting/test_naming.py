"""How names of files make trials, and what a folder without recordings is told."""

from pathlib import PurePosixPath

import pytest

from myowave.starting.block import kind_of
from myowave.starting.files import recordings_in, ways_to_name
from myowave.starting.signals import read_folder


@pytest.mark.parametrize(
    ("files", "trials", "patterns"),
    [
        (["curl1.mat", "curl2.mat", "curl10.mat"], ["curl1", "curl2", "curl10"], ["{trial}.mat"]),
        (["a/bic.csv", "a/ang.csv", "b/bic.csv", "b/ang.csv"], ["a", "b"], ["{trial}/ang.csv", "{trial}/bic.csv"]),
        (["emg/t1.csv", "motion/t1.mot", "emg/t2.csv", "motion/t2.mot"], ["t1", "t2"], None),
        (["t1/t1_emg.csv", "t1/t1.mot", "t2/t2_emg.csv", "t2/t2.mot"], ["t1", "t2"], None),
        (["t1.csv.gz", "t2.csv.gz"], ["t1", "t2"], ["{trial}.csv.gz"]),
    ],
)
def test_trials_are_what_differs_between_files_of_one_kind(files, trials, patterns):
    naming = ways_to_name([PurePosixPath(file) for file in files])[0]
    assert list(naming.trials) == trials and not naming.left_out
    assert patterns is None or list(naming.patterns) == patterns
    made = {pattern.replace("{trial}", trial) for pattern in naming.patterns for trial in trials}
    assert made == set(files)


def test_a_trial_without_all_files_is_left_out_and_said():
    files = ["a/emg.csv", "a/angle.csv", "b/emg.csv", "b/angle.csv", "c/emg.csv"]
    naming = ways_to_name([PurePosixPath(file) for file in files])[0]
    assert naming.trials == ("a", "b") and naming.left_out == ("c/emg.csv",)


def test_maximum_contractions_are_no_trials():
    files = ["t1_emg.csv", "t1_angle.csv", "t2_emg.csv", "t2_angle.csv", "mvc_emg.csv"]
    namings = ways_to_name([PurePosixPath(file) for file in files])
    assert next(naming for naming in namings if naming.trials == ("t1", "t2")).mvc == ("mvc",)


@pytest.mark.parametrize("names", [["curl.csv"], ["curl_emg.csv", "curl_angle.csv"]])
def test_one_trial_is_too_few(tmp_path, names):
    for name in names:
        (tmp_path / name).write_text(f"time,{name}\n" + "".join(f"{n},{n}\n" for n in range(60)))
    with pytest.raises(ValueError, match=f"{len(names)} recordings .*, but not two trials: .*Rename.* cut_s"):
        read_folder(tmp_path, recordings_in(tmp_path))


def test_files_of_one_trial_hold_other_signals_than_each_other(tmp_path):
    """`a_x.csv` and `a_y.csv` could be trials x and y of a as well; the second file of a trial tells them apart."""
    for trial in "ab":
        for kind, column in (("x", "biceps [uV]"), ("y", "elbow [deg]")):
            (tmp_path / f"{trial}_{kind}.csv").write_text(f"time,{column}\n" + "".join(f"{n},{n}\n" for n in range(60)))
    found = read_folder(tmp_path, recordings_in(tmp_path))
    assert found.naming.trials == ("a", "b") and found.naming.patterns == ("{trial}_x.csv", "{trial}_y.csv")


@pytest.mark.parametrize("columns", [("value",) * 4, ("emg", "emg", "angle", "angle")])
def test_signals_of_one_trial_may_all_be_called_alike(tmp_path, columns):
    """In `a/biceps.csv` and `a/elbow.csv` only the files say what is in them: they are no repetitions."""
    for trial in "ab":
        (tmp_path / trial).mkdir()
        for kind, column in zip(("biceps", "triceps", "elbow", "tilt"), columns, strict=True):
            (tmp_path / trial / f"{kind}.csv").write_text(f"time,{column}\n" + "".join(f"{n},{n}\n" for n in range(60)))
    found = read_folder(tmp_path, recordings_in(tmp_path))
    assert found.naming.trials == ("a", "b") and len(found.signals) == 4


def test_a_folder_without_recordings_is_told_what_was_expected(tmp_path):
    (tmp_path / "notes.docx").touch()
    with pytest.raises(ValueError, match=r"no recording in it; found 1 files .docx, expected files that end in .csv"):
        recordings_in(tmp_path)
    with pytest.raises(ValueError, match="no such folder"):
        recordings_in(tmp_path / "gone")


def test_hidden_files_are_no_recordings(tmp_path):
    for name in (".hidden.csv", ".git/a.csv", "~$b.csv", "b.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    assert recordings_in(tmp_path) == [PurePosixPath("b.csv")]


def test_a_size_in_a_name_is_no_count():
    """Loads of 2.5 and 2.75 kg are two conditions, and repetitions of each are of one."""
    kinds = [kind_of(name) for name in ("load2.75", "load2.5", "load2.75_3", "light_1", "light2", "S1.01")]
    assert kinds == ["load2.75", "load2.5", "load2.75", "light", "light", "S1"]
