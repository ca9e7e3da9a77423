"""How names of files make trials, and what a folder without recordings is told."""

from pathlib import PurePosixPath

import pytest

from myowave.starting.files import name_trials, recordings_in
from myowave.starting.words import is_technical, muscle_in


@pytest.mark.parametrize(
    ("files", "trials", "patterns"),
    [
        (["curl1.mat", "curl2.mat", "curl10.mat"], ["curl1", "curl2", "curl10"], ["{trial}.mat"]),
        (["a/bic.csv", "a/ang.csv", "b/bic.csv", "b/ang.csv"], ["a", "b"], ["{trial}/ang.csv", "{trial}/bic.csv"]),
        (["emg/t1.csv", "motion/t1.mot", "emg/t2.csv", "motion/t2.mot"], ["t1", "t2"], None),
        (["t1/t1_emg.csv", "t1/t1.mot", "t2/t2_emg.csv", "t2/t2.mot"], ["t1", "t2"], None),
        (["t1_emg.csv", "t1_angle.csv", "t2_emg.csv", "t2_angle.csv"], ["t1", "t2"], None),
        (["elbow_flexion_1.csv", "elbow_flexion_2.csv"], ["1", "2"], ["elbow_flexion_{trial}.csv"]),
        (["t1.csv.gz", "t2.csv.gz"], ["t1", "t2"], ["{trial}.csv.gz"]),
    ],
)
def test_trials_are_what_differs_between_files_of_one_kind(files, trials, patterns):
    naming = name_trials([PurePosixPath(file) for file in files])[0]
    assert list(naming.trials) == trials and not naming.left_out
    assert patterns is None or list(naming.patterns) == patterns
    made = {pattern.replace("{trial}", trial) for pattern in naming.patterns for trial in trials}
    assert made == set(files)


def test_a_trial_without_all_files_is_left_out_and_said():
    files = ["a/emg.csv", "a/angle.csv", "b/emg.csv", "b/angle.csv", "c/emg.csv"]
    naming = name_trials([PurePosixPath(file) for file in files])[0]
    assert naming.trials == ("a", "b") and naming.left_out == ("c/emg.csv",)


def test_maximum_contractions_are_no_trials():
    files = ["t1_emg.csv", "t1_angle.csv", "t2_emg.csv", "t2_angle.csv", "mvc_emg.csv"]
    naming = name_trials([PurePosixPath(file) for file in files])[0]
    assert naming.trials == ("t1", "t2") and naming.mvc == ("mvc",)


def test_one_trial_is_too_few():
    with pytest.raises(ValueError, match="1 recordings .curl.csv., but not two trials: .*Rename them"):
        name_trials([PurePosixPath("curl.csv")])
    with pytest.raises(ValueError, match="2 recordings .*, but not two trials: .*One long recording is cut .*cut_s"):
        name_trials([PurePosixPath("curl_emg.csv"), PurePosixPath("curl_angle.csv")])


def test_a_folder_without_recordings_is_told_what_was_expected(tmp_path):
    (tmp_path / "notes.docx").touch()
    with pytest.raises(ValueError, match=r"no recording in it; found 1 files .docx, expected files that end in .csv"):
        recordings_in(tmp_path)
    with pytest.raises(ValueError, match="no such folder"):
        recordings_in(tmp_path / "gone")


def test_hidden_files_are_no_recordings(tmp_path):
    for name in (".hidden.csv", ".git/a.csv", "b.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    assert recordings_in(tmp_path) == [PurePosixPath("b.csv")]


@pytest.mark.parametrize(
    ("label", "muscle"),
    [
        ("Noraxon Ultium-RT BICEPS BR.", "biceps"),
        ("RTriceps_lat", "triceps"),
        ("BRACHIORAD.", "brachioradialis"),
        ("BIClong", "biceps"),
        ("TRIlat", "triceps"),
        ("Bizeps", "biceps"),
        ("Bíceps", "biceps"),
        ("isometric trial 1", None),
        ("electric", None),
    ],
)
def test_a_muscle_is_told_from_a_label(label, muscle):
    assert muscle_in(label) == muscle


@pytest.mark.parametrize("label", ["Jane Doe biceps", "Anton EMG 1", "Norman", "Bo triceps", "Long biceps"])
def test_a_label_with_a_persons_name_is_not_technical(label):
    assert not is_technical(label)


@pytest.mark.parametrize(
    "label",
    ["Avanti sensor 1: EMG 1", "LElbowAngles.x", "emg(2)", "r_elbow_flex", "Biceps_R", "BIClong", "Winkel"],
)
def test_a_recorders_own_label_is_technical(label):
    assert is_technical(label)
