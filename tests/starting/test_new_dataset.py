"""`myowave new`: settings from a folder of recordings that import as they are, or say what is missing."""

import re
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from scipy.io import savemat
from sessions import ANGLE_HZ, EMG_HZ, burst, curl, noraxon, write_session
from typer.testing import CliRunner

from myowave.cli import app
from myowave.data.importing import import_trials
from myowave.starting.block import held_out
from myowave.starting.new import begin

ROOT = Path(__file__).parents[2]


def new(folder, name="mine", **choices):
    """What the command says, and the text of the file that it writes."""
    said = begin(name, Path(folder), force=True, **choices)
    return SimpleNamespace(said=said, text=Path(f"{name}.yaml").read_text())


def table(path, columns, head="", separator=","):
    """Write columns {name: values} of a text table."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = [separator.join(columns)]
    rows += [separator.join(f"{v:.8g}" for v in row) for row in zip(*columns.values(), strict=True)]
    path.write_text(head + "\n".join(rows) + "\n", encoding="utf-8")


def times(seconds=12.0, rate=EMG_HZ):
    return np.arange(0, seconds, 1 / rate)


def everything(seed):
    """Columns of a trial in one table at the rate of the EMG."""
    angle = np.interp(times(), times(rate=ANGLE_HZ), curl())
    return {"time": times(), "Biceps [uV]": burst(seed), "Triceps [uV]": burst(seed + 50), "Elbow angle [deg]": angle}


@pytest.mark.parametrize("percent", ["%", "%MVC"])
def test_emg_in_percent_of_a_maximum_needs_no_gain(workplace, laid_over, percent):
    for seed, trial in enumerate(("left1", "left2", "right1", "right2")):
        share = {
            f"EMG {m} [{percent}]": np.abs(burst(seed + k, rate=ANGLE_HZ)) / 2
            for k, m in enumerate(("biceps", "triceps"))
        }
        columns = {"Time [s]": times(rate=ANGLE_HZ), **share, "Ellenbogen [Grad]": curl() + seed}
        table(workplace / "sides" / f"{trial}.csv", columns)
    made = new("sides")
    dataset = laid_over(made.text).dataset("mine")
    assert {channel: one.form for channel, one in dataset.emg.items()} == {
        "emg_biceps": "fraction",
        "emg_triceps": "fraction",
    }
    assert "unknown gain" not in made.text
    prepared, _ = import_trials("mine", dataset)
    raw = np.abs(burst(0, rate=ANGLE_HZ)) / 200
    np.testing.assert_allclose(prepared.trials.emg[0, :, 0], raw, atol=1e-9)


def test_files_of_several_people_are_told_and_columns_by_their_names_where_none_is_emg(workplace):
    for person in ("sub-01", "sub-02"):
        for trial in ("t1", "t2"):
            columns = {"time": times(rate=ANGLE_HZ), "a": curl(), "b": 0 * curl()}
            table(workplace / "people" / person / f"{trial}.csv", columns)
    made = new("people")
    assert "if sub-01, sub-02 are people" in made.said and "none that names or units tell, of a, b" in made.said
    assert "physics:" not in made.text


def test_a_second_electrode_of_a_muscle_says_that_it_drives_none_yet(workplace):
    for seed, trial in enumerate(("t1", "t2")):
        heads = {"Biceps long [uV]": burst(seed), "Biceps short [uV]": burst(seed + 9)}
        table(workplace / "heads" / f"{trial}.csv", {**everything(seed), **heads})
    Path("my own.yaml").write_text(Path("config.yaml").read_text())
    made = new("heads", config=[Path("my own.yaml")])
    assert "emg_biceps_3: # uV, 1000 Hz" in made.said and "as BICshort: {emg: emg_biceps_3}" in made.said
    assert "--configfile 'my own.yaml' mine.yaml" in made.said


@pytest.mark.parametrize(
    "names",
    [("Biceps femoris", "TRICEPS_SURAE"), ("BICEPS FEM.", "Triceps sur."), ("LT_BICEPS_FEM_LH", "triceps sur L")],
)
def test_muscles_of_the_leg_are_not_taken_for_those_of_the_arm_that_share_their_name(workplace, laid_over, names):
    for seed, trial in enumerate(("t1", "t2")):
        leg = {f"{name} [uV]": burst(seed + 9 + 10 * k) for k, name in enumerate(names)}
        table(workplace / "body" / f"{trial}.csv", {**leg, **everything(seed)})
    made = new("body")
    dataset = laid_over(made.text).dataset("mine")
    columns = {name: one.column for name, one in dataset.emg.items()}
    assert columns == {"emg_biceps": "Biceps", "emg_triceps": "Triceps"}
    assert f"# not used: {{file: 'body/{{trial}}.csv', column: {names[0]}}}" in made.text


def test_what_no_unit_and_no_name_says_is_left_to_fill_in_with_what_was_found(workplace, laid_over):
    """Names of columns in another language, decimal commas, times in ms, no units."""
    for seed, trial in enumerate(("t1", "t2")):
        spoken = {"Beuger [mV]": burst(seed) / 1000, "Strecker [mV]": burst(seed + 50) / 1000}
        table(workplace / "german" / f"EMG_{trial}.csv", {"time_ms": 1000 * times(), **spoken}, separator=";")
        angle = {"time_ms": 1000 * times(rate=ANGLE_HZ), "Beugung": curl(), "Neigung": 5 + 0 * curl()}
        table(workplace / "german" / f"Motion_{trial}.csv", angle, separator=";")
        for path in (workplace / "german").iterdir():
            path.write_text(path.read_text().replace(".", ","))
    made = new("german")
    assert "emg_channel1: # mV, 1000 Hz" in made.text and "column: Strecker" in made.text
    assert "angle: # FILL IN file and column, one of\n" in made.text
    assert "        # {file: 'german/EMG_{trial}.csv', column: Beuger} # mV" in made.text
    assert "angle: # FILL IN" in made.said and "data.datasets.mine.angle" in made.said
    chosen = "{file: 'german/Motion_{trial}.csv', column: Beugung}"
    assert f"# {chosen} # unknown unit, 100 Hz, 10 to 110" in made.text
    text = filled(made.text.replace("angle: # FILL IN", f"angle: {chosen[:-1]}, unit: deg}} #", 1))
    text = "\n".join(
        line for line in text.splitlines() if "german" not in line.partition("{file")[2] or "angle:" in line
    )
    dataset = laid_over(text).data.datasets["mine"]
    prepared, _ = import_trials("mine", dataset)
    assert np.degrees(prepared.trials.angle).max() == pytest.approx(curl().max(), abs=1)
    assert set(prepared.gains) == {"emg_biceps", "emg_triceps"}


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        (
            ("emg_bic", "emg_tri", "emg_delt"),
            "BIClong: null # driven by emg_biceps: FILL IN {emg: one of emg_bic, emg_tri",
        ),
        (("emg_biceps",), "TRIlong: null # driven by emg_triceps: nobody recorded it"),
    ],
)
def test_muscles_whose_channel_is_not_there_are_to_fill_in_or_left_out(workplace, columns, says):
    for n in (1, 2):
        time = times(3, 100)
        emg = {name: time / (3 + k) for k, name in enumerate(columns)}
        table(workplace / "tidy" / f"t{n}.csv", {"time_s": time, **emg, "angle_deg": 20 * n * time, "force": time})
    (workplace / "tidy/list.csv").write_text("trial,when\nt1,today\n")
    made = new("tidy")
    dataset = yaml.safe_load(made.text)["data"]["datasets"]["mine"]
    assert dataset["files"] == ["tidy/t1.csv", "tidy/t2.csv"] and dataset["ignore_columns"] == ["force"]
    assert says in made.text and "of no trial, by name or by signals: list.csv" in made.said


def test_raw_recordings_become_a_dataset_that_can_be_prepared(workplace, laid_over):
    write_session(workplace / "curls")
    text = new("curls").text
    settings = laid_over(text)
    dataset = settings.data.datasets["mine"]
    assert (dataset.kind, dataset.trials, dataset.test, dataset.arm) == ("recorded", ("a", "b", "c"), ("c",), "arm26")
    assert settings.targets.without_networks == ("mine",) and not settings.targets.datasets
    assert set(dataset.identify) == {f"{k}_{g}" for k in ("strength", "length") for g in ("flexors", "extensors")}
    prepared, _ = import_trials("mine", dataset, settings.physics_of("mine").tables)
    assert set(prepared.recordings["a"].raw.emg) == {"emg_biceps", "emg_triceps"}
    assert np.degrees(prepared.recordings["a"].raw.angle.values).max() == pytest.approx(curl().max(), abs=1e-3)


def test_prepared_files_become_a_measured_dataset_that_can_be_imported(workplace, laid_over):
    shutil.copytree(ROOT / "data/bench_elbow", "bench")
    made = new("bench", arm="paper")
    dataset = laid_over(made.text).data.datasets["mine"]
    assert (dataset.kind, len(dataset.files), dataset.test) == ("measured", 5, ("trial5",))
    assert dataset.arm == "paper"
    trials = import_trials("mine", dataset, channels={"emg_biceps": 1, "emg_triceps": -1})[0].trials
    assert list(trials.names) == [f"trial{n}" for n in range(1, 6)]


@pytest.mark.parametrize("unit", ["rad", "deg"])
def test_the_range_of_a_prepared_angle_is_told_with_what_turns_it(workplace, laid_over, unit):
    for seed, trial in enumerate(("t1", "t2")):
        emg = {f"emg_{m}": np.abs(burst(seed + k, rate=ANGLE_HZ)) / 200 for k, m in enumerate(("biceps", "triceps"))}
        angle = {f"angle_{unit}": 180 - curl() if unit == "deg" else np.radians(180 - curl())}
        table(workplace / f"tidy/{trial}.csv", {"time_s": times(rate=ANGLE_HZ), **emg, **angle})
    made = new("tidy")
    assert "angle: # GUESSED. FILL IN sign and offset" in made.said
    assert "sign: 1 # 70 to 170 deg in the first trial" in made.text
    text = made.text.replace("sign: 1 ", "sign: -1 ").replace("offset_deg: 0.0", "offset_deg: 180")
    dataset = laid_over(text).data.datasets["mine"]
    assert dataset.kind == "measured"
    angle = import_trials("mine", dataset)[0].trials.angle
    assert np.degrees(angle[0]) == pytest.approx(curl()[: angle.shape[1]], abs=1e-5)


@pytest.mark.parametrize(
    ("names", "people"),
    [
        (("S01/a", "S01/b", "S02/a", "S02/b"), "S01, S02"),
        (("sub-1_a", "sub-2_a"), "sub-1, sub-2"),
        (("biceps1_a", "s1_b"), ""),
    ],
)
def test_files_of_two_people_are_asked_about(workplace, names, people):
    for seed, name in enumerate(names):
        table(workplace / f"who/{name}.csv", everything(seed))
    said = new("who").said
    assert f"if {people} are people" in said if people else "are people" not in said


def prepared(seed):
    """Columns of a trial that is ready, EMG as a fraction of a maximum contraction."""
    emg = {f"emg_{m}": np.abs(burst(seed + k, rate=ANGLE_HZ)) / 200 for k, m in enumerate(("biceps", "triceps"))}
    return {"time_s": times(rate=ANGLE_HZ), **emg, "angle_deg": curl() + 1e-4 * seed}


@pytest.mark.parametrize("kind", ["one file", "two files", "prepared"])
def test_repetitions_in_a_folder_per_load_are_trials(workplace, laid_over, kind):
    names = [f"{load}/rep{n}" for load, count in (("1kg", 3), ("2kg", 2)) for n in range(1, count + 1)]
    for seed, name in enumerate((*names, "mvc/rep1")):
        columns = prepared(10 * seed) if kind == "prepared" else everything(seed)
        if kind == "two files":
            table(workplace / f"loads/{name}_angle.csv", {key: columns[key] for key in ("time", "Elbow angle [deg]")})
            del columns["Elbow angle [deg]"]
        table(workplace / f"loads/{name}{'_emg' if kind == 'two files' else ''}.csv", columns)
    dataset = laid_over(new("loads").text).data.datasets["mine"]
    assert dataset.trials == tuple(name.replace("/", "_") for name in names) and dataset.mvc == ("mvc_rep1",)
    assert set(dataset.emg) == {"emg_biceps", "emg_triceps"} and dataset.test == ("1kg_rep3", "2kg_rep2")
    forms = import_trials("mine", dataset)[0].forms
    assert set(forms.values()) == {"fraction" if kind == "prepared" else "raw"}


def test_prepared_files_that_are_called_alike_are_trials_by_their_folders(workplace, laid_over):
    for seed, trial in enumerate("abc"):
        table(workplace / f"alike/{trial}/all.csv", prepared(seed))
    prepared_again, _ = import_trials("mine", laid_over(new("alike").text).data.datasets["mine"])
    assert prepared_again.trials.names == ("a", "b", "c")
    np.testing.assert_allclose(prepared_again.trials.emg[1, :, 0], prepared(1)["emg_biceps"], atol=1e-7)


@pytest.mark.parametrize("unit", ["", " [uV]"])
def test_files_that_look_prepared_but_hold_raw_emg_are_recordings(workplace, laid_over, unit):
    for seed, trial in enumerate(("t1", "t2")):
        time, *values = everything(seed).values()
        names = [f"emg_biceps{unit}", f"emg_triceps{unit}", "angle_deg"]
        table(workplace / f"raw/{trial}.csv", {"time_s": time, **dict(zip(names, values, strict=True))})
    dataset = laid_over(new("raw").text).data.datasets["mine"]
    assert dataset.kind == "recorded" and {one.form for one in dataset.emg.values()} == {"raw"}
    assert set(import_trials("mine", dataset)[0].forms) == {"emg_biceps", "emg_triceps"}


def test_tables_with_rows_above_their_names_and_a_row_of_units_are_read(workplace, laid_over):
    for seed, trial in enumerate(("t1", "t2")):
        columns = {name.split(" [")[0]: values for name, values in everything(seed).items()}
        rows = "Recorder 3\nsession 7\n" + ";".join(columns) + "\ns;uV;uV;deg\n"
        body = "\n".join(
            ";".join(f"{v:.6g}".replace(".", ",") for v in row) for row in zip(*columns.values(), strict=True)
        )
        (workplace / "tables").mkdir(exist_ok=True)
        (workplace / "tables" / f"{trial}.csv").write_text(rows + body + "\n")
    dataset = laid_over(new("tables").text).data.datasets["mine"]
    prepared, _ = import_trials("mine", dataset)
    assert prepared.recordings["t1"].raw.emg["emg_biceps"].values == pytest.approx(
        everything(0)["Biceps [uV]"], rel=1e-4
    )


def test_trials_whose_tables_differ_in_order_and_units_of_columns_are_trials_all_the_same(workplace, laid_over):
    """As a German spreadsheet names the columns."""
    for seed, trial in enumerate(("t1", "t2", "t3")):
        columns = dict(
            zip(("Zeit", "Bizeps [uV]", "Trizeps [uV]", "Winkel [deg]"), everything(seed).values(), strict=True)
        )
        if trial == "t2":
            columns["Bizeps [mV]"] = columns.pop("Bizeps [uV]") / 1000
            columns["Winkel [rad]"] = np.radians(columns.pop("Winkel [deg]"))
        table(workplace / f"german/{trial}.csv", columns)
    prepared, _ = import_trials("mine", laid_over(new("german").text).data.datasets["mine"])
    assert [*prepared.recordings] == ["t1", "t2", "t3"]
    for seed, one in enumerate(prepared.recordings.values()):
        assert one.raw.emg["emg_biceps"].values == pytest.approx(burst(seed), rel=1e-5)
        assert np.degrees(one.raw.angle.values).max() == pytest.approx(curl().max(), abs=1e-3)


@pytest.mark.parametrize("choice", ["ms", "sample"])
def test_times_that_count_ms_or_samples_are_to_be_told(workplace, laid_over, choice):
    for seed, trial in enumerate(("t1", "t2")):
        table(workplace / f"slow/{trial}.csv", {**everything(seed), "time": np.arange(len(times()))})
    made = new("slow")
    assert "layout: {time_unit: null} # FILL IN ms, or sample" in made.said
    with pytest.raises(ValueError, match="1 Hz by its times; expected 10 to 50000. If its times are in ms"):
        import_trials("mine", laid_over(made.text).data.datasets["mine"])
    text = made.text.replace("time_unit: null", f"time_unit: {choice}")
    if choice == "sample":
        text = re.sub(r"( +)(column: .*)", r"\1\2\n\1rate_hz: 500", text)
    dataset = laid_over(text).data.datasets["mine"]
    rate = EMG_HZ if choice == "ms" else 500
    assert import_trials("mine", dataset)[0].recordings["t1"].raw.angle.rate == pytest.approx(rate)


def test_an_angle_without_times_may_have_come_as_fast_as_emg_and_makes_no_trials_of_that_rate(workplace, laid_over):
    for seed, trial in enumerate(("t1", "t2")):
        columns = everything(seed)
        table(workplace / f"bare/{trial}.csv", {name: columns[name] for name in columns if name != "time"})
    text = new("bare").text.replace("rate_hz: null", f"rate_hz: {EMG_HZ}")
    dataset = laid_over(text).data.datasets["mine"]
    assert import_trials("mine", dataset)[0].trials.dt == pytest.approx(0.01)


@pytest.mark.parametrize("name", ["Zeit", "Zeit [ms]", "time_ms", "t [s]"])
def test_times_in_ms_are_taken_as_such_and_what_nothing_says_is_marked_as_guessed(workplace, laid_over, name):
    for seed, trial in enumerate(("t1", "t2")):
        columns = {key: values[::2] for key, values in everything(seed).items()}
        table(workplace / f"slow/{trial}.csv", {name: 1000 * columns.pop("time"), **columns})
    made = new("slow")
    assert ("layout: {time_unit: ms} # GUESSED: in s it would be 0.5 Hz" in made.said) == ("ms" not in name)
    assert "500 Hz" in made.text
    recorded = import_trials("mine", laid_over(made.text).data.datasets["mine"])[0].recordings["t1"].raw
    assert recorded.angle.rate == pytest.approx(EMG_HZ / 2)


def test_names_with_braces_are_read_and_what_no_settings_can_name_is_told(workplace, laid_over):
    write_session(workplace / "odd {1}" / "[x]")
    text = new("odd {1}").text
    assert len(import_trials("mine", laid_over(text).data.datasets["mine"])[0].recordings) == 3
    (workplace / "odd {1}/moved.csv").symlink_to("/nowhere/moved.csv")
    assert "moved.csv" in new("odd {1}").said
    (workplace / "odd {1}/a\nb.csv").write_text("x")
    with pytest.raises(ValueError, match=r"'a\\nb.csv' has a line break"):
        new("odd {1}")


def test_a_unit_that_a_column_s_name_ends_in_is_taken(workplace, laid_over):
    """A forearm that stays near 0 deg would look like one in rad."""
    for seed, trial in enumerate(("t1", "t2")):
        columns = {"time": times(), "biceps_uV": burst(seed), "triceps_mV": burst(seed + 9)}
        table(workplace / f"units/{trial}.csv", {**columns, "elbow_deg": 3 + np.sin(times())})
    made = new("units")
    dataset = laid_over(made.text).data.datasets["mine"]
    assert [signal.unit for signal in dataset.emg.values()] == ["uV", "mV"] and dataset.angle.unit == "deg"
    assert made.text.count("# GUESSED: its name ends so") == 2
    prepared, _ = import_trials("mine", dataset)
    assert prepared.recordings["t1"].raw.emg["emg_triceps"].values == pytest.approx(1000 * burst(9), rel=1e-6)


def test_a_side_or_a_muscle_in_brackets_is_a_part_of_the_name(workplace, laid_over):
    for seed, trial in enumerate(("t1", "t2")):
        emg = {f"EMG ({muscle})": burst(seed + 9 * k) for k, muscle in enumerate(("biceps", "triceps"))}
        angle = np.interp(times(), times(rate=ANGLE_HZ), curl())
        table(workplace / f"sides/{trial}.csv", {"time": times(), **emg, "Ellenbogenwinkel (rechts)": angle})
    dataset = laid_over(new("sides").text).data.datasets["mine"]
    assert {name: one.column for name, one in dataset.emg.items()} == {
        "emg_biceps": "EMG (biceps)",
        "emg_triceps": "EMG (triceps)",
    }
    recorded = import_trials("mine", dataset)[0].recordings["t1"].raw
    assert recorded.emg["emg_triceps"].values == pytest.approx(burst(9), rel=1e-6)
    assert np.degrees(recorded.angle.values).max() == pytest.approx(curl().max(), abs=1e-3)


def test_a_matlab_file_with_a_rate_for_each_kind_of_signal_needs_none_in_the_settings(workplace, laid_over):
    (workplace / "matlab").mkdir()
    for seed, trial in enumerate(("t1", "t2")):
        signals = {"emg_biceps": burst(seed), "emg_triceps": burst(seed + 9), "elbow_angle": curl()}
        savemat(workplace / f"matlab/{trial}.mat", {**signals, "fs_emg": float(EMG_HZ), "fs_angle": float(ANGLE_HZ)})
    made = new("matlab")
    assert "rate_hz: null" not in made.text and f"{EMG_HZ:g} Hz" in made.text
    prepared, _ = import_trials("mine", laid_over(made.text).data.datasets["mine"])
    assert (
        prepared.recordings["t1"].raw.emg["emg_biceps"].rate == EMG_HZ
        and prepared.recordings["t1"].raw.angle.rate == ANGLE_HZ
    )


def filled(text):
    """What a person does: names of muscles for numbers of channels, and the first angle of those listed."""
    text = text.replace("emg_channel1", "emg_biceps").replace("emg_channel2", "emg_triceps")
    text = re.sub(r"null # driven by (\w+): FILL IN[^\n]*", r"{emg: \1}", text)
    return re.sub(r"(angle: # FILL IN[^\n]*\n *)# ", r"\1", text)


def test_vicons_devices_and_model_outputs_may_be_one_file_or_two(workplace, laid_over):
    """`a_devices.csv` and `a_model.csv` are two files of one trial, though neither name says EMG or angle."""
    for seed, trial in enumerate(("a", "b")):
        biceps, triceps, angle = burst(seed) * 1e-6, burst(seed + 50) * 1e-6, curl()
        device = [
            f"{n // 10 + 1},{n % 10},{x:.6g},{y:.6g}" for n, (x, y) in enumerate(zip(biceps, triceps, strict=True))
        ]
        device = [
            "Devices",
            f"{EMG_HZ}",
            ",,EMG - Voltage,",
            "Frame,Sub Frame,Voltage.BIC,Voltage.TRI",
            ",,V,V",
            *device,
        ]
        model = [
            "Model Outputs",
            f"{ANGLE_HZ:g}",
            f",,Jane {trial}:RElbowAngles,,",
            "Frame,Sub Frame,X,Y,Z",
            ",,deg,deg,deg",
        ]
        model += [f"{n + 1},0,{value:.8g},0,0" for n, value in enumerate(angle)]
        for folder in ("one", "two"):
            (workplace / folder).mkdir(exist_ok=True)
        (workplace / f"one/{trial}.csv").write_text("\n".join([*device, "", *model]) + "\n")
        (workplace / f"two/{trial}_devices.csv").write_text("\n".join(device) + "\n")
        (workplace / f"two/{trial}_model.csv").write_text("\n".join(model) + "\n")
    for folder in ("one", "two"):
        made = new(folder)
        assert "Jane" not in made.text + made.said
        assert "Before it runs, correct" in made.said
        dataset = laid_over(filled(made.text)).data.datasets["mine"]
        assert dataset.trials == ("a", "b") and set(dataset.emg) == {"emg_biceps", "emg_triceps"}
        prepared, _ = import_trials("mine", dataset)
        assert prepared.recordings["b"].raw.angle.values == pytest.approx(np.radians(curl()), abs=1e-6)
        assert prepared.recordings["b"].raw.emg["emg_biceps"].values == pytest.approx(burst(1), rel=1e-4, abs=1e-4)
    path = workplace / "one/b.csv"
    lines = path.read_text().splitlines()
    lines[-1] = "1200,0,lost,0,0"
    path.write_text("\n".join(lines))
    with pytest.raises(ValueError, match=f"b.csv, row {len(lines)}: RElbowAngles X is 'lost'"):
        import_trials("mine", laid_over(filled(new("one").text)).data.datasets["mine"])


def test_formats_may_be_mixed_and_what_files_do_not_say_is_guessed_or_asked_for(workplace, laid_over):
    for seed, trial in enumerate(("t1", "t2")):
        (workplace / "mixed").mkdir(exist_ok=True)
        savemat(workplace / f"mixed/{trial}_emg.mat", {"biceps": np.abs(burst(seed)), "triceps": burst(seed + 9)})
        degrees = "\n".join(f"{t:.2f}\t{a:.6f}" for t, a in zip(times(rate=ANGLE_HZ), curl(), strict=True))
        head = "motion\ninDegrees=yes\nendheader\ntime\tr_elbow_flex\n"
        (workplace / f"mixed/{trial}.mot").write_text(head + degrees + "\n")
    made = new("mixed")
    dataset = laid_over(made.text).data.datasets["mine"]
    assert dataset.emg["emg_biceps"].form == "envelope" and dataset.emg["emg_triceps"].form == "raw"
    assert dataset.emg["emg_biceps"].unit == "au" and dataset.angle.unit is None and dataset.angle.column is None
    assert "rate_hz: null # FILL IN" in made.text and "samples a second" in made.said
    stated = made.text.replace("rate_hz: null", f"rate_hz: {EMG_HZ}")
    prepared, _ = import_trials("mine", laid_over(stated).data.datasets["mine"])
    assert prepared.recordings["t2"].raw.angle.values == pytest.approx(np.radians(curl()), abs=1e-6)


def test_maximum_contractions_set_what_counts_as_one(workplace, laid_over):
    write_session(workplace / "curls")
    for muscle in ("biceps", "triceps"):
        noraxon(workplace / "curls/mvc" / f"{muscle}.csv", "x", burst(99, scale=200), EMG_HZ, "uV")
    made = new("curls")
    assert "unknown gain" not in made.text
    dataset = laid_over(made.text).data.datasets["mine"]
    assert dataset.mvc == ("mvc",) and "mvc" not in dataset.trials
    prepared, _ = import_trials("mine", dataset)
    assert max(envelope.max() for envelope in np.moveaxis(prepared.trials.emg, -1, 0)) < 0.9


def test_the_persons_forearm_is_in_the_arm(workplace, laid_over):
    write_session(workplace / "curls")
    light, heavy = (laid_over(new("curls", person=(m, 1.7, "f")).text).physics_of("mine").joint for m in (50, 90))
    assert heavy.mass_kg / light.mass_kg == pytest.approx(90 / 50, rel=1e-3)


def test_an_arm_of_other_settings_is_taken_with_its_groups(workplace):
    write_session(workplace / "curls")
    muscles = {name: None for name in ("TRIlong", "TRIlat", "TRImed")}
    arm = {"preset": "arm26", "muscles": muscles}
    Path("arm.yaml").write_text(yaml.safe_dump({"physics": {"arms": {"thin": arm}}}))
    made = new("curls", config=[Path("config.yaml"), Path("arm.yaml")], arm="thin")
    dataset = yaml.safe_load(made.text)["data"]["datasets"]["mine"]
    assert dataset["arm"] == "thin" and set(dataset["identify"]) == {"strength_flexors", "length_flexors"}
    assert "config.yaml arm.yaml mine.yaml" in made.said
    lacks = made.said.partition("Before it runs, correct:\n")[2].partition("Wrote")[0].splitlines()
    assert [line.split(":")[0] for line in lacks] == ["  data.datasets.mine.conditions"]
    assert "there is no 'thin'" in new("curls", arm="thin").said


@pytest.mark.parametrize("name", ["goniometer", "Gonio", "flexion"])
def test_what_the_field_calls_an_angle_is_found(workplace, name):
    for trial in ("curl1", "curl2"):
        columns = {"time_s": times(), "biceps": np.abs(np.sin(times())), name: 40 + 30 * np.sin(times())}
        table(workplace / "raw" / f"{trial}.csv", columns)
    assert yaml.safe_load(new("raw").text)["data"]["datasets"]["mine"]["angle"]["column"] == name


def test_a_machine_has_no_emg_and_a_motor_where_a_column_is_a_torque(workplace):
    Path("rig.yaml").write_text(
        yaml.safe_dump({"physics": {"arms": {"rig": {"muscles": {}, "joint": {"mass_kg": 0.8, "length_m": 0.3}}}}})
    )
    for trial in ("run1", "run2"):
        columns = {"time_s": times(rate=200), "angle_deg": np.sin(times(rate=200)), "torque_Nm": times(rate=200)}
        table(workplace / "driven" / f"{trial}.csv", columns)
        table(workplace / "free" / f"{trial}.csv", {"time_s": columns["time_s"], "angle_deg": columns["angle_deg"]})
    for folder, motor in (("driven", "torque_Nm"), ("free", None)):
        made = new(folder, config=[Path("config.yaml"), Path("rig.yaml")], arm="rig")
        dataset = yaml.safe_load(made.text)["data"]["datasets"]["mine"]
        assert "train networks" not in made.text, "there is no EMG for one"
        assert "emg" not in dataset and dataset.get("motor", {"column": None})["column"] == motor
        assert dataset["angle"]["unit"] == "deg" and ("scatter" in dataset) is bool(motor)
        lacks = made.said.partition("Before it runs, correct:\n")[2].partition("Wrote")[0].splitlines()
        assert [line.split(":")[0] for line in lacks] == ["  data.datasets.mine.conditions"]


@pytest.mark.parametrize(
    ("trials", "last"),
    [
        (["load2.75_1", "load2.75_2", "load5.5_1", "load5.5_2"], ["load2.75_2", "load5.5_2"]),
        (["trial1", "trial2", "trial3"], ["trial3"]),
        (["light", "heavy"], ["heavy"]),
        (["1", "2"], ["2"]),
        (["slow 1", "slow 2", "fast"], ["slow 2"]),
        (["S1_0kg_a", "S1_0kg_b", "S1_2kg_a", "S1_2kg_b"], ["S1_0kg_b", "S1_2kg_b"]),
        (["t1_0,5kg", "t2_0,5kg", "t3_2kg"], ["t2_0,5kg"]),
    ],
)
def test_the_last_trial_of_each_condition_is_held_out(trials, last):
    assert held_out(trials) == last


def test_a_table_without_names_of_columns_is_refused_and_says_so(workplace):
    for trial in ("t1", "t2"):
        table(workplace / f"bare/{trial}.csv", everything(0))
        path = workplace / f"bare/{trial}.csv"
        path.write_text(path.read_text().partition("\n")[2])
    with pytest.raises(ValueError, match="t1.csv: numbers already in row 1; expected"):
        new("bare")


def test_a_name_that_is_taken_or_cannot_be_one_is_refused(workplace):
    with pytest.raises(ValueError, match="there is a dataset case1 in config.yaml already"):
        new(workplace, "case1")
    with pytest.raises(ValueError, match="'my arm' cannot be the name of a dataset"):
        new(workplace, "my arm")


@pytest.mark.parametrize("data", ["[1]", "{datasets: 5}", "{datasets: [mine]}", "null"])
def test_what_is_no_section_below_is_replaced_as_the_workflow_does_it(workplace, data):
    write_session(workplace / "curls")
    Path("config.yaml").write_text(f"data: {data}\n")
    assert "mine" in yaml.safe_load(new("curls").text)["data"]["datasets"]


@pytest.fixture
def command(workplace):
    write_session(workplace / "curls")
    return lambda *more: CliRunner().invoke(app, ["new", "mine", "--from", "curls", *more])


def test_the_command_writes_the_file_and_says_what_to_run(command, laid_over):
    done = command("--mass", "70", "--height", "1.7", "--sex", "f")
    assert done.exit_code == 0 and laid_over(Path("mine.yaml").read_text()).data.datasets["mine"].arm == "mine"
    lines = [line for line in done.stdout.splitlines() if line.startswith("  snakemake")]
    assert len(lines) == 2 and all(line.endswith("--configfile config.yaml mine.yaml") for line in lines)
    assert (
        "test: [c] # GUESSED: the last of each condition" in done.stdout and "FILL IN" in Path("mine.yaml").read_text()
    )


def test_the_command_writes_over_a_file_only_when_told_to(command):
    Path("mine.yaml").write_text("mine: precious\n")
    done = command()
    assert done.exit_code == 2 and "is there already" in done.stderr and "precious" in Path("mine.yaml").read_text()
    assert command("--force").exit_code == 0 and "precious" not in Path("mine.yaml").read_text()
    before = Path("config.yaml").read_text()
    done = CliRunner().invoke(app, ["new", "config", "--from", "curls", "--force"])
    assert done.exit_code == 2 and "config.yaml is the configuration" in done.stderr
    assert Path("config.yaml").read_text() == before


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--mass", "70"], "--mass, --height and --sex are given together"),
        (["--mass", "70", "--height", "1.7", "--sex", "f", "--arm", "paper"], "has a forearm of its own"),
        (["--config", "gone.yaml"], "There is no gone.yaml"),
    ],
)
def test_the_command_explains_a_mistake_in_one_line(command, options, says):
    done = command(*options)
    assert done.exit_code == 2 and says in done.stderr and not Path("mine.yaml").exists()


def test_a_persons_forearm_and_a_brachioradialis_go_together_and_each_strength_is_identified(workplace, laid_over):
    write_session(workplace / "curls")
    for trial in "abc":
        noraxon(workplace / f"curls/{trial}/brachioradialis.csv", "x", burst(7), EMG_HZ, "uV")
    settings = laid_over(new("curls", person=(70, 1.7, "f")).text)
    arm, dataset = settings.physics_of("mine"), settings.data.datasets["mine"]
    assert arm.muscles["BRD"].emg == "emg_brachioradialis" and arm.muscles["BIClong"].emg == "emg_biceps"
    assert {"strength_brachioradialis", "strength_flexors"} <= set(dataset.identify) and dataset.arm == "mine"
