"""Raw recordings of a session become trials like any others, or it is said what is wrong with them."""

import gzip
import json
import re
from contextlib import chdir
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from sessions import ANGLE_HZ, EMG_HZ, curl, noraxon, session_section, write_session

from myowave.data.importing import import_trials
from myowave.data.store import read_trials, write_trials
from myowave.data.trials import TORQUE
from myowave.data.wavelets import decompose
from myowave.settings import RecordedDataset, parse_settings

ROOT = Path(__file__).parents[2]


def prepare(folder, **changes):
    with chdir(folder):
        return import_trials("me", RecordedDataset(**session_section(**changes)))


def refuse(folder, *patterns, **changes):
    with pytest.raises(ValueError) as caught:
        prepare(folder, **changes)
    for pattern in patterns:
        assert re.search(pattern, str(caught.value)), f"{pattern!r} not in:\n{caught.value}"


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    folder = tmp_path_factory.mktemp("session")
    write_session(folder)
    return folder


@pytest.fixture
def folder(tmp_path):
    write_session(tmp_path)
    return tmp_path


def relink(path):
    """Put a link to nothing in place of a file."""
    path.unlink()
    path.symlink_to(f"/nowhere/{path.name}")


def test_a_good_session_becomes_trials(good, tmp_path):
    prepared, quality = prepare(good, conditions={"a": {"load": 1.0}})
    trials = prepared.trials
    assert trials.names == ("a", "b", "c") and trials.train == ("a", "b")
    assert trials.channels == ("emg_biceps", "emg_triceps") and trials.dt == pytest.approx(0.01)
    assert trials.emg_low_pass_hz == 4.0
    for i in range(3):
        assert np.abs(np.degrees(trials.angle[i, : trials.lengths[i]]) - curl()[: trials.lengths[i]]).max() < 1e-6
    assert trials.conditions["a"] == {"load": 1.0, "tilt": pytest.approx(np.radians(5.0))}
    assert trials.conditions["c"] == {"tilt": pytest.approx(np.radians(7.0))}
    assert np.allclose(trials.signals["tilt_rad"][1], np.radians(6.0))
    assert [f for f in quality["findings"] if f["severity"] == "warning"] == []
    write_trials(trials, tmp_path / "trials.parquet")
    assert np.array_equal(read_trials(tmp_path / "trials.parquet").signals["tilt_rad"], trials.signals["tilt_rad"])


def test_nothing_of_the_labels_in_the_files_is_kept(good):
    prepared, quality = prepare(good)
    assert "Doe" not in json.dumps([dict(prepared.trials.provenance), quality])


def test_the_largest_of_the_training_trials_counts_as_1(good):
    prepared, _ = prepare(good)
    largest = prepared.trials.emg.max(axis=1)  # (T, C)
    assert largest[:2].max(axis=0) == pytest.approx([1.0, 1.0], abs=1e-3)


def test_a_test_trial_has_no_part_in_the_scale(good, tmp_path):
    louder = tmp_path / "louder"
    write_session(
        louder, change=lambda trial, key, values: 1.2 * values if trial == "c" and key == "biceps" else values
    )
    (one, _), (other, quality) = prepare(good), prepare(louder)
    assert one.gains == other.gains
    assert np.array_equal(one.trials.emg[:2], other.trials.emg[:2])
    assert np.allclose(other.trials.emg[2, :, 0], 1.2 * one.trials.emg[2, :, 0])
    assert any(f["check"] == "EMG above 1" and f["trial"] == "c" for f in quality["findings"])


def test_a_channel_with_another_gain_gives_the_same_excitation(good, tmp_path):
    write_session(tmp_path, change=lambda trial, key, values: 3 * values if key == "triceps" else values)
    (one, _), (other, _) = prepare(good), prepare(tmp_path)
    assert np.allclose(one.trials.emg, other.trials.emg, rtol=1e-6, atol=1e-8)
    assert other.gains["emg_triceps"] == pytest.approx(3 * one.gains["emg_triceps"])


def test_maximum_contractions_can_count_as_1(folder):
    write_session(folder, trials=("max",), change=lambda trial, key, values: 4 * values)
    once, _ = prepare(folder)
    scaled, _ = prepare(folder, mvc=["max"])
    assert scaled.trials.names == ("a", "b", "c")
    assert scaled.trials.emg[..., 0].max() < 0.5 * once.trials.emg[..., 0].max()


def with_artefact(trial, end=3000):
    """Nothing but 5 mV for 30 ms in the beginning of a trial, which is then to be cut off."""

    def change(name, key, values):
        if name == trial and key == "biceps":
            values[:end] = 0.0
            values[1000:1030] = 5000.0 * (-1.0) ** np.arange(30)
        return values

    return change


@pytest.mark.parametrize(("start", "late"), [(0.0, 0.0), (0.0, 1.5), (8.0, 0.0), (8.0, 1.5)])
def test_what_is_cut_off_a_maximum_contraction_does_not_count(folder, start, late):
    changes = {"mvc": ["max"], "processing": {"emg_start_offset_s": late}}
    gains, begins = [], start + late
    cut = [begins + 4.0, begins + 12.0]
    for change in (None, with_artefact("max")):
        write_session(folder, trials=("max",), change=change, emg_start=start)
        gains.append(prepare(folder, **changes, cut_s={"max": cut})[0].gains)
    assert gains[0] == gains[1] and prepare(folder, **changes)[0].gains["emg_biceps"] > 5 * gains[0]["emg_biceps"]
    for begin, left in ((cut[1] - 0.5005, "0.5"), (50.0, "0")):
        recorded = f"{begins:.2f} to {begins + 11.999:.2f} s"
        says = f"me.cut_s: keeps {left} s of emg_biceps in max, which was recorded from {recorded}; expected at least 2"
        refuse(folder, says, **changes, cut_s={"max": [begin, 60.0]})


@pytest.mark.parametrize("start", [-3.0, 0.0, 8.0])
@pytest.mark.parametrize(("trial", "late"), [("a", 0.0), ("max", 0.0), ("max", 1.5)])
def test_a_cut_is_in_the_times_that_messages_and_pictures_have(folder, start, trial, late):
    def spiked(name, key, values):
        if name == trial and key == "biceps":
            values[1000] = 5e4
        return values

    for names in ("abc", ("max",)):
        write_session(folder, trials=names, change=spiked, emg_start=start, angle_start=start)
    changes = {"mvc": ["max"] if trial == "max" else [], "processing": {"emg_start_offset_s": late}}
    prepared, quality = prepare(folder, **changes)
    (spike,) = (f["found"] for f in quality["findings"] if f["check"] == "spike" and f["trial"] == trial)
    at = float(re.search(r"at (\S+) s", spike)[1])
    assert at == pytest.approx(start + late + 1.0)
    prepared, quality = prepare(folder, **changes, cut_s={trial: [at + 1, at + 9]})
    assert not [f for f in quality["findings"] if f["check"] == "spike"]
    if trial in prepared.recordings:
        assert prepared.recordings[trial].time[[0, -1]] == pytest.approx([at + 1, at + 9], abs=0.01)


@pytest.mark.parametrize("key", ["angle", "biceps", "tilt"])
@pytest.mark.parametrize("late", [0.0, 1.5])
def test_what_is_cut_away_need_not_be_whole(folder, key, late):
    def prepared(faulty=()):
        def change(trial, one, values):
            if (trial, one) == ("a", key):
                rate = EMG_HZ if one == "biceps" else ANGLE_HZ
                values[[round((at - (late if one == "biceps" else 0)) * rate) for at in faulty]] = np.nan
            return values

        write_session(folder, change=change)
        settings = {"processing": {"emg_start_offset_s": late}, "cut_s": {"a": [3.0, 10.0]}}
        return prepare(folder, **settings)[0].trials

    whole, cut = prepared(), prepared([2.0, 11.0])
    assert cut.lengths == whole.lengths and cut.angle == pytest.approx(whole.angle, abs=1e-12)
    inner = slice(30, 670)  # filters end elsewhere
    assert cut.emg[0, inner] == pytest.approx(whole.emg[0, inner], abs=0.01)
    with pytest.raises(ValueError, match="row .*is 'nan' .1 such rows"):
        prepared([2.0, 4.0])


@pytest.mark.parametrize(("column", "level"), [("on", 1), ("on [V]", 5), ("on [mV]", 5000)])
def test_a_part_that_a_column_keeps_and_one_that_is_cut_are_on_one_clock(folder, column, level):
    write_session(folder, emg_start=8.0, angle_start=8.0)
    for trial in "abc":
        on = pd.DataFrame({"t": 8 + np.arange(1200) / ANGLE_HZ, column: np.repeat([0.0, level], [400, 800])})
        on.to_csv(folder / trial / "on.csv", index=False)
    keep = {"file": "{trial}/on.csv", "equals": level}
    recordings = prepare(folder, keep=keep, cut_s={"a": [9.0, 15.0]})[0].recordings
    for trial, end in (("a", 15.0), ("b", 19.99)):
        assert recordings[trial].time[[0, -1]] == pytest.approx([12.0, end])
    refuse(folder, f"trial a: the column is never 3, but from 0 to {level}", keep={**keep, "equals": 3})


@pytest.mark.parametrize(("cut", "left"), [([0.0, 5.0], 0), ([30.0, 40.0], 0), ([8.1, 8.4], 31)])
def test_a_cut_that_keeps_nothing_is_refused_with_the_times_of_the_files(folder, cut, left):
    write_session(folder, emg_start=8.0, angle_start=8.0)
    says = (
        rf"trial a: {left} samples .* between {cut[0]:.2f} and {cut[1]:.2f} s \(cut_s, keep\); expected at least 50. "
        "EMG was recorded from 8.00 to 20.00 s, the angle from 8.00 to 19.99 s: .*cut_s, which is in times of"
    )
    refuse(folder, says, cut_s={"a": cut})
    assert prepare(folder, cut_s={"a": [9.0, 40.0]})[0].trials.lengths[0] == 1100


@pytest.mark.parametrize(("trials", "test", "told"), [("ab", "b", True), ("abc", "bc", True), ("abc", "c", False)])
def test_one_trial_to_train_on_is_told(folder, trials, test, told):
    findings = prepare(folder, trials=tuple(trials), test=list(test))[1]["findings"]
    few = [f for f in findings if f["check"] == "few trials"]
    assert [f["found"] for f in few] == [f"only a to train on, and to test {', '.join(test)}"] * told
    assert all("record four trials or more" in f["do"] for f in few)


def test_a_dead_trial_does_not_make_rest_of_the_others_a_contraction(folder):
    def change(trial, key, values):
        noise = np.random.default_rng(ord(trial)).standard_normal(len(values))
        return values if key != "biceps" else 0 * values if trial == "c" else noise

    write_session(folder, change=change)
    findings = {(f["check"], f["trial"]) for f in prepare(folder)[1]["findings"] if f["signal"] == "emg_biceps"}
    assert {("no contraction", "a"), ("no contraction", "b"), ("dead channel", "c")} <= findings


def test_files_of_a_trial_that_begin_apart_are_told_until_it_is_said_why(folder):
    def starts(**changes):
        return {f["trial"]: f for f in prepare(folder, **changes)[1]["findings"] if f["check"] == "starts"}

    assert not starts() and not starts(processing={"emg_start_offset_s": 1.5})  # files alike, clocks apart
    write_session(folder, angle_start=2.0)
    told = starts()
    assert [*told] == ["a", "b", "c"]
    assert told["a"]["found"] == "EMG begins at 0.00 s, the angle at 2.00 s; only the common 10.00 s are used"
    assert "processing.emg_start_offset_s" in told["a"]["do"] and "emg_start_offset_s by trial" in told["a"]["do"]
    assert not starts(processing={"emg_start_offset_s": 2.0})
    assert [*starts(cut_s={"a": [2.0, 12.0], "b": [3.0, 11.0]})] == ["c"]
    assert [*starts(cut_s={"a": [1.98, 20.0], "b": [0.0, 100.0], "c": [1.0, 9.0]})] == ["b", "c"]
    write_session(folder, angle_start=2.0, emg_start=1.97)
    assert not starts()


@pytest.mark.parametrize("role", ["trial", "maximum"])
def test_clocks_of_one_recording_may_be_apart_by_another_time(folder, role):
    """As where two recorders are started by hand, one of which tells the time of day."""
    name, mvc = {"trial": ("b", []), "maximum": ("max", ["max"])}[role]
    both = [*"abc", *mvc]
    write_session(folder, trials=both, emg_start=7198.0)
    (folder / name).rename(folder / "apart")
    write_session(folder, trials=both)
    as_it_was, _ = prepare(folder, mvc=mvc, cut_s={name: [1.0, 9.0]})
    for file in ("biceps", "triceps"):
        (folder / "apart" / f"{file}.csv").replace(folder / name / f"{file}.csv")
    offsets = {"processing": {"emg_start_offset_s": 0.0}, "emg_start_offset_s": {name: -7198.0}}
    prepared, quality = prepare(folder, mvc=mvc, cut_s={name: [1.0, 9.0]}, **offsets)
    assert prepared.gains == pytest.approx(as_it_was.gains)
    assert prepared.trials.emg == pytest.approx(as_it_was.trials.emg, abs=1e-6)
    assert not [f for f in quality["findings"] if f["check"] in ("starts", "durations")]


def test_a_cut_hides_that_files_last_longer_only_where_it_takes_that_off(folder):
    for trial in "ab":
        noraxon(folder / trial / "elbow.csv", "Elbow RT", curl(seconds=10), ANGLE_HZ, "deg")
    findings = prepare(folder, cut_s={"a": [1.0, 50.0], "b": [1.0, 10.0]})[1]["findings"]
    assert {f["trial"] for f in findings if f["check"] == "durations"} == {"a"}


def test_files_that_ended_together_are_no_wrong_rate(folder):
    def told(**settings):
        return {f["trial"] for f in prepare(folder, **settings)[1]["findings"] if f["check"] == "durations"}

    for trial in "abc":
        noraxon(folder / trial / "elbow.csv", "Elbow RT", curl(seconds=11.6), ANGLE_HZ, "deg")
    assert told() == told(processing={"emg_start_offset_s": 0.4}) == {"a", "b", "c"}
    assert not told(processing={"emg_start_offset_s": -0.4})


@pytest.mark.parametrize("kept", [{"cut_s": {"a": [4.0, 12.0]}}, {"keep": {"file": "{trial}/on.csv", "equals": 1}}])
def test_a_trial_that_counts_as_a_maximum_contraction_counts_as_far_as_it_is_kept(folder, kept):
    write_session(folder, trials=("a",), change=with_artefact("a"))
    for trial in "abc":
        on = pd.DataFrame({"t": np.arange(1200) / ANGLE_HZ, "on": np.repeat([0.0, 1.0], [400, 800])})
        on.to_csv(folder / trial / "on.csv", index=False)
    as_trial, as_maximum = (prepare(folder, test=["b", "c"], mvc=mvc, **kept)[0] for mvc in ([], ["a"]))
    assert as_trial.gains == as_maximum.gains and as_maximum.gains["emg_biceps"] < 500


def test_parts_of_one_recording_that_are_cut_apart_may_count_as_1_and_test(folder):
    cut_s = {"max": [0.0, 4.0], "b": [4.0, 8.0], "c": [8.0, 12.0]}
    signal = {key: {"file": f"a/{key}.csv", "format": "noraxon"} for key in ("biceps", "triceps", "elbow")}
    emg = {f"emg_{muscle}": signal[muscle] for muscle in ("biceps", "triceps")}
    changes = {"trials": ["b", "c"], "mvc": ["max"], "emg": emg, "angle": signal["elbow"], "signals": {}}
    assert prepare(folder, **changes, cut_s=cut_s)[0].trials.lengths == (401, 400)
    refuse(folder, "mvc names max with c in it", **changes, cut_s={**cut_s, "max": [0.0, 8.5]})


def test_emg_that_started_later_is_put_where_it_belongs(folder):
    for trial in "abc":
        for muscle in ("biceps", "triceps"):
            path = folder / trial / f"{muscle}.csv"
            values = [float(line.split(",")[1]) for line in path.read_text("utf-8-sig").splitlines()[4:]]
            noraxon(folder / "late" / trial / f"{muscle}.csv", "x", values[1500:], 1000.0, "uV")
    emg = {f"emg_{m}": {"file": f"late/{{trial}}/{m}.csv", "format": "noraxon"} for m in ("biceps", "triceps")}
    whole, _ = prepare(folder)
    late, _ = prepare(folder, emg=emg, processing={"emg_start_offset_s": 1.5})
    a, b = whole.trials, late.trials
    assert b.lengths[0] == a.lengths[0] - 150
    assert np.allclose(b.angle[0, : b.lengths[0]], a.angle[0, 150 : a.lengths[0]])
    scale = whole.gains["emg_biceps"] / late.gains["emg_biceps"]
    inside = slice(100, b.lengths[0] - 100)  # the filters see other ends
    difference = b.emg[0, inside, 0] - scale * a.emg[0, 150 : a.lengths[0]][inside, 0]
    assert np.abs(difference).max() < 1e-3


def test_rate_cut_sign_and_offset_are_as_the_settings_say(good):
    angle = {"file": "{trial}/elbow.csv", "format": "noraxon", "sign": -1, "offset_deg": 120.0}
    prepared, _ = prepare(good, angle=angle, cut_s={"a": [2.0, 9.0]}, processing={"rate_hz": 50.0})
    trials = prepared.trials
    assert trials.dt == pytest.approx(0.02) and trials.lengths == (351, *trials.lengths[1:])
    assert np.degrees(trials.angle[0, :351]) == pytest.approx(120 - curl()[200:901:2], abs=0.05)


@pytest.fixture
def with_torque(folder):
    """The session with a dynamometer in its first two trials, at a rate of its own, which counts extension positive."""
    time = np.arange(0, 12, 0.005)
    for trial in "ab":
        noraxon(folder / trial / "torque.csv", "Torque", -500 * (2 + np.sin(time)), 200.0, "Ncm")
    return folder, {"file": "{trial}/torque.csv", "format": "noraxon", "sign": -1, "trials": ["a", "b"]}


def test_torque_of_a_dynamometer_is_a_signal_in_newton_metres_where_it_was_measured(with_torque, tmp_path):
    folder, torque = with_torque
    prepared, _ = prepare(folder, torque=torque)
    found, trials = prepared.trials.signals[TORQUE], prepared.trials
    expected = 5 * (2 + np.sin(trials.time[: trials.lengths[0]]))
    np.testing.assert_allclose(found[:2, : trials.lengths[0]], np.stack([expected] * 2), atol=0.02)
    assert np.isnan(found[2]).all() and trials.over_time == {"tilt": "tilt_rad"}
    write_trials(trials, tmp_path / "trials.parquet")
    np.testing.assert_array_equal(read_trials(tmp_path / "trials.parquet").signals[TORQUE], found)
    np.testing.assert_array_equal(decompose(trials.thinned(25.0), 1)[1].signals[TORQUE][2], np.nan)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"trials": None}, r"c/torque.csv: no such file.* See data\S*\.torque\.file"),
        ({"unit": "Nm"}, r"Torque is in Ncm, but data.datasets.me.torque says Nm"),
    ],
)
def test_a_torque_that_is_not_there_or_in_two_units_is_said(with_torque, change, says):
    folder, torque = with_torque
    refuse(folder, says, torque={**torque, **change})


@pytest.mark.parametrize(
    ("values", "says"),
    [(np.linspace(0, 9000, 2400), "trial b, .* the torque is 8997 N m"), (np.ones(2400), "trial b: .* stays at")],
)
def test_a_torque_that_no_elbow_gives_is_refused(with_torque, values, says):
    folder, torque = with_torque
    noraxon(folder / "b" / "torque.csv", "Torque", values, 200.0, "Nm")
    refuse(folder, says, torque={**torque, "sign": 1})


def test_packed_files_are_read_as_they_are(good, folder):
    for path in folder.rglob("*.csv"):
        path.with_name(path.name + ".gz").write_bytes(gzip.compress(path.read_bytes()))
        path.unlink()
    section = session_section()
    for signal in (*section["emg"].values(), section["angle"], *section["signals"].values()):
        signal["file"] += ".gz"
    with chdir(folder):
        packed, _ = import_trials("me", RecordedDataset(**section))
    assert np.array_equal(packed.trials.emg, prepare(good)[0].trials.emg)


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda f: (f / "b" / "biceps.csv").unlink(), "b/biceps.csv: no such.*holds elbow.* See .*emg.emg_biceps.file"),
        (lambda f: noraxon(f / "b" / "elbow.csv", "x", curl(), 100.0, "mm"), "x is in 'mm'; expected rad, deg"),
        (lambda f: noraxon(f / "b" / "elbow.csv", "x", curl(), 100.0, ""), "x is without a unit; .*unit in .*me.angle"),
        (lambda f: noraxon(f / "b" / "biceps.csv", "x", np.zeros(12000), 1000.0, "uV"), None),
        (lambda f: noraxon(f / "b" / "biceps.csv", "x", np.ones(30), 1000.0, "uV"), "30 samples in 0.03 s; expected"),
        (lambda f: noraxon(f / "b" / "biceps.csv", "x", np.ones(9000), 1000.0, "uV", start=50.0), "trial b: 0 samples"),
        (lambda f: noraxon(f / "b" / "elbow.csv", "x", 5 * curl(), 100.0, "deg"), "b, .* angle is 550 .*offset_deg"),
        (lambda f: noraxon(f / "b" / "elbow.csv", "x", curl() / 57.3, 100.0, "deg"), "b: .*If it was written in rad"),
        (lambda f: (f / "b" / "elbow.csv").write_text("time,value\n0,1\n"), "elbow.csv: this is not a signal"),
        (lambda f: noraxon(f / "b" / "elbow.csv", "x", 30 + 0 * curl(), 100.0, "deg"), "b: the angle stays at 30 deg"),
        (lambda f: noraxon(f / "b" / "elbow.csv", "x", curl(), 0.1, "deg"), "0.1 Hz by the file; .* 10 to 50000"),
        (lambda f: relink(f / "b" / "tilt.csv"), "tilt.csv: a link to /nowhere/tilt.csv.* See .*signals.tilt_rad.file"),
    ],
)  # fmt: skip
def test_what_makes_a_recording_unusable_is_said(folder, spoil, says):
    spoil(folder)
    if says is None:  # one silent trial does not stop a session
        _, quality = prepare(folder)
        assert [f["check"] for f in quality["findings"] if f["trial"] == "b"] == ["dead channel"]
    else:
        refuse(folder, says)


@pytest.mark.parametrize(
    ("name", "unit", "stated"), [("elbow_deg", "", None), ("elbow_rad", "deg", None), ("elbow_rad", "", "deg")]
)
def test_a_name_ends_in_the_unit_where_nothing_else_says_it(good, folder, name, unit, stated):
    for path in folder.glob("?/elbow.csv"):
        text = path.read_text("utf-8").replace('"Elbow RT"', f'"{name}"').replace('"deg"', f'"{unit}"')
        path.write_text(text, "utf-8")
        assert f'"{name}"' in text
    angle = {**session_section()["angle"], "unit": stated}
    assert np.array_equal(prepare(folder, angle=angle)[0].trials.angle, prepare(good)[0].trials.angle)


@pytest.mark.parametrize(
    ("written", "stated", "says"),
    [
        ("Grad", None, None),
        ("Grad", "deg", None),
        ("units", "deg", None),
        ("units", None, "x is in 'units'; expected rad, deg. Name it as unit in data.datasets.me.angle"),
        ("rad", "deg", "x is in rad, but data.datasets.me.angle says deg. Correct one"),
        ("mV", "deg", "x is in mV, but data.datasets.me.angle says deg. Correct one"),
        ("mV", None, "x is in 'mV'; expected rad, deg. Correct the file, or what is named in .*me.angle"),
    ],
)
def test_what_the_settings_say_counts_where_the_file_names_no_unit_that_is_known(good, folder, written, stated, says):
    for trial, one in prepare(good)[0].recordings.items():
        noraxon(folder / trial / "elbow.csv", "x", np.degrees(one.raw.angle.values), ANGLE_HZ, written)
    angle = {**session_section()["angle"], "unit": stated}
    if says:
        refuse(folder, says, angle=angle)
    else:
        assert np.allclose(prepare(folder, angle=angle)[0].trials.angle, prepare(good)[0].trials.angle, atol=1e-6)


def test_a_file_that_was_cut_short_or_leaps_in_time_is_refused(folder):
    path = folder / "a" / "biceps.csv"
    lines = path.read_text("utf-8-sig").splitlines()
    path.write_text("\n".join(lines[:-100]))
    refuse(folder, "a/biceps.csv: 11900 samples, but its header says 12000; the file was cut short")
    lines[1] = lines[1].replace("12000", "11999")
    path.write_text("\n".join(lines[:504] + lines[505:]))
    refuse(folder, "a/biceps.csv, row 505: time goes from 0.499 to 0.501, a step of 0.002 s")


def test_all_problems_of_all_files_are_told_at_once(folder):
    (folder / "a" / "biceps.csv").unlink()
    noraxon(folder / "b" / "elbow.csv", "x", curl(), 100.0, "mm")
    refuse(folder, "2 problems", "a/biceps.csv: no such file", "'mm'")


def test_a_test_trial_of_more_effort_than_the_training_is_told_and_not_refused(tmp_path):
    muscles = ("biceps", "triceps")
    write_session(tmp_path, change=lambda trial, key, values: 3 * values if trial == "c" and key in muscles else values)
    prepared, quality = prepare(tmp_path)
    warned = {(f["trial"], f["check"]) for f in quality["findings"] if f["severity"] == "warning"}
    assert warned == {("c", "EMG above 1")} and prepared.trials.emg[2].max() > 3


def test_emg_far_above_a_maximum_contraction_is_refused(tmp_path):
    write_session(tmp_path, trials=("a", "b", "c", "max"), change=lambda t, key, v: v / 3 if t == "max" else v)
    says = r"trial a, .*: emg_biceps is \d\.\d+ of a maximum contraction .* expected 0 to 1.5. Look for an artefact"
    refuse(tmp_path, says, mvc=["max"])


def test_a_scale_of_nothing_is_refused(tmp_path):
    write_session(tmp_path, change=lambda trial, key, values: 0 * values if key == "triceps" else values)
    refuse(tmp_path, "emg_triceps: the EMG never rises above 0")


def test_the_recording_of_a_person_that_ships_comes_in():
    settings = parse_settings(yaml.safe_load((ROOT / "config.yaml").read_text())).data.datasets["human_curls"]
    two = settings.model_copy(update={"trials": ("load2.75_2", "load5.5_2"), "test": ("load2.75_2",), "conditions": {}})
    with chdir(ROOT):
        prepared, quality = import_trials("human_curls", two)
    trials = prepared.trials
    assert trials.dt == pytest.approx(0.01) and trials.lengths == (2674, 2662)
    assert 130 < np.degrees(trials.angle.max()) < 165
    assert "power below 20 Hz" in quality["summary"]
    # The brachioradialis is recorded at about eight times the biceps.
    assert prepared.gains["emg_brachioradialis"] > 4 * prepared.gains["emg_biceps"]


def test_a_maximum_contraction_may_hold_an_angle_that_nobody_needs(tmp_path):
    time = np.arange(0, 12, 0.001)
    for n, name in enumerate(("a", "b", "max")):
        emg = 100 * np.random.default_rng(n).standard_normal(len(time)) * (1.1 + np.sin(time))
        columns = {"Time [s]": time, "Bi [uV]": emg, "Elbow [deg]": 60 - 50 * np.cos(time)}
        pd.DataFrame(columns).to_csv(tmp_path / f"{name}.csv", index=False)
    where = {"file": str(tmp_path / "{trial}.csv")}
    block = {
        "kind": "recorded",
        "trials": ["a", "b"],
        "test": ["b"],
        "mvc": ["max"],
    }
    signals = {"emg": {"emg_biceps": {**where, "column": "Bi"}}, "angle": {**where, "column": "Elbow"}}
    prepared, _ = import_trials("arm", RecordedDataset.model_validate({**block, **signals}))
    assert prepared.trials.names == ("a", "b")
    with pytest.raises(ValueError, match="Elbow is not used"):
        import_trials("arm", RecordedDataset.model_validate({**block, **signals, "angle": {**where, "column": "Bi"}}))
