"""`myowave new`: settings from a folder of recordings that import as they are, or say what is missing."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.io import savemat
from sessions import ANGLE_HZ, EMG_HZ, burst, curl, noraxon, write_session
from typer.testing import CliRunner

from myowave.cli import app
from myowave.data.importing import import_trials
from myowave.starting.arm import Choice, arm_of
from myowave.starting.study import new_study
from myowave.starting.subject import Body

ROOT = Path(__file__).parents[2]


def study_of(folder, name="mine", **choices):
    return new_study(name, Path(folder), Path(f"{name}.yaml"), **choices)


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


def test_raw_recordings_become_a_dataset_that_can_be_prepared(workplace, laid_over):
    write_session(workplace / "curls")
    text = study_of("curls").text
    settings = laid_over(text)
    dataset = settings.data.datasets["mine"]
    assert (dataset.kind, dataset.trials, dataset.test, dataset.arm) == ("recorded", ("a", "b", "c"), ("c",), "arm26")
    assert settings.targets.without_networks == ("mine",) and not settings.targets.datasets
    assert set(dataset.identify) == {f"{k}_{g}" for k in ("strength", "length") for g in ("flexors", "extensors")}
    prepared, _ = import_trials("mine", dataset, ".", settings.physics_of("mine").tables)
    assert set(prepared.raw["a"].emg) == {"emg_biceps", "emg_triceps"}
    assert np.degrees(prepared.raw["a"].angle.values).max() == pytest.approx(curl().max(), abs=1e-3)


def test_opensim_files_and_a_german_export_become_datasets_that_can_be_prepared(workplace, laid_over):
    """A straight arm of 180 deg, EMG in a file that says inDegrees; decimal commas, times in ms."""
    for seed, trial in enumerate(("t1", "t2")):
        emg = {"time": times(), "BIClong": burst(seed) * 1e-6, "TRIlat": burst(seed + 50) * 1e-6}
        head = "x\nversion=1\ninDegrees=yes\nendheader\n"
        table(workplace / "opensim" / f"{trial}_emg.sto", emg, head, "\t")
        angle = {"time": times(rate=ANGLE_HZ), "elbow_flexion_r": 180 - curl()}
        table(workplace / "opensim" / f"{trial}_ik.mot", angle, head, "\t")
        spoken = {"Bizeps [mV]": burst(seed) / 1000, "Trizeps [mV]": burst(seed + 50) / 1000}
        table(workplace / "german" / f"EMG_{trial}.csv", {"time_ms": 1000 * times(), **spoken}, separator=";")
        angle = {"time_ms": 1000 * times(rate=ANGLE_HZ), "Ellbogenwinkel": curl()}
        table(workplace / "german" / f"Winkel_{trial}.csv", angle, separator=";")
        for path in (workplace / "german").iterdir():
            path.write_text(path.read_text().replace(".", ","))
    for folder, unit in (("opensim", "au (guessed), 1000 Hz"), ("german", "mV, 1000 Hz")):
        study = study_of(folder)
        assert f", {unit}" in study.said
        corrected = study.text
        if folder == "opensim":
            assert "Where 180 is straight: sign: -1, offset_deg: 180" in study.said
            corrected = corrected.replace("sign: 1 #", "sign: -1 #").replace("offset_deg: 0.0", "offset_deg: 180")
        settings = laid_over(corrected)
        dataset = settings.data.datasets["mine"]
        assert set(dataset.emg) == {"emg_biceps", "emg_triceps"} and dataset.arm == "arm26"
        prepared, _ = import_trials("mine", dataset, ".", settings.physics_of("mine").tables)
        assert prepared.trials.dt == pytest.approx(0.01)
        assert np.degrees(prepared.trials.angle).max() == pytest.approx(curl().max(), abs=1)


def test_no_label_inside_the_files_is_copied_where_it_may_be_a_persons(workplace):
    write_session(workplace / "curls")  # labels there are "Jane Doe biceps"
    for seed, trial in enumerate(("t1", "t2")):
        columns = {name.replace("Biceps", "Jane Doe biceps"): v for name, v in everything(seed).items()}
        table(workplace / "tables" / f"{trial}.csv", columns)
    for folder in ("curls", "tables"):
        study = study_of(folder)
        assert "Jane" not in study.text + study.said and "Doe" not in study.text + study.said
    assert "column: null # FILL IN" in study.text and "were not copied" in study.said


def test_prepared_files_become_a_measured_dataset_that_can_be_imported(workplace, laid_over):
    shutil.copytree(ROOT / "data/bench_elbow", "bench")
    study = study_of("bench", arm="default")
    dataset = laid_over(study.text).data.datasets["mine"]
    assert (dataset.kind, dataset.files, dataset.test) == ("measured", ("bench/*.csv",), ("trial5",))
    assert dataset.arm == "paper"
    trials = import_trials("mine", dataset, channels=("emg_biceps", "emg_triceps"))[0].trials
    assert list(trials.names) == [f"trial{n}" for n in range(1, 6)]


def test_prepared_files_beside_others_are_named_one_by_one_and_spare_columns_ignored(workplace, laid_over):
    for n in (1, 2):
        time = times(3, 100)
        columns = {"time_s": time, "emg_bic": time / 3, "emg_tri": time / 9, "emg_delt": time / 5}
        table(workplace / "mix" / f"t{n}.csv", {**columns, "angle_deg": 20 * n * time})
    (workplace / "mix/list.csv").write_text("trial,when\nt1,today\n")
    settings = laid_over(study_of("mix").text)
    dataset, arm = settings.data.datasets["mine"], settings.physics_of("mine")
    assert dataset.files == ("mix/t1.csv", "mix/t2.csv") and dataset.ignore_columns == ("emg_delt",)
    assert {muscle.side: muscle.emg for muscle in arm.muscles.values()} == {"flexor": "emg_bic", "extensor": "emg_tri"}
    assert list(import_trials("mine", dataset, channels=arm.channels)[0].trials.names) == ["t1", "t2"]


def test_tables_with_rows_above_their_names_and_a_row_of_units_are_read(workplace, laid_over):
    for seed, trial in enumerate(("t1", "t2")):
        columns = {name.split(" [")[0]: values for name, values in everything(seed).items()}
        rows = "Recorder 3\nsession 7\n" + ";".join(columns) + "\ns;uV;uV;deg\n"
        body = "\n".join(
            ";".join(f"{v:.6g}".replace(".", ",") for v in row) for row in zip(*columns.values(), strict=True)
        )
        (workplace / "tables").mkdir(exist_ok=True)
        (workplace / "tables" / f"{trial}.csv").write_text(rows + body + "\n")
    dataset = laid_over(study_of("tables").text).data.datasets["mine"]
    assert (dataset.layout.header_row, dataset.layout.units_row) == (3, 4)
    prepared, _ = import_trials("mine", dataset)
    assert prepared.raw["t1"].emg["emg_biceps"].values == pytest.approx(everything(0)["Biceps [uV]"], rel=1e-4)


def test_a_column_of_times_in_another_language_is_found(workplace, laid_over):
    for seed, trial in enumerate(("t1", "t2")):
        table(workplace / "zeit" / f"{trial}.csv", {"Zeit": times(), **dict(list(everything(seed).items())[1:])})
    dataset = laid_over(study_of("zeit").text).data.datasets["mine"]
    assert dataset.layout.time_column == "Zeit"
    assert import_trials("mine", dataset)[0].raw["t1"].angle.rate == pytest.approx(EMG_HZ)


def test_tables_that_are_written_in_two_ways_are_said(workplace):
    for seed, trial in enumerate(("t1", "t2")):
        time, biceps, triceps, angle = everything(seed).values()
        table(workplace / f"two/{trial}_emg.csv", {"time": time, "biceps": biceps, "triceps": triceps})
        table(workplace / f"two/{trial}_angle.csv", {"time": time, "elbow": angle}, head="Recorder 3\n")
    assert "export them alike" in study_of("two").said
    for trial in ("t1", "t2"):
        path = workplace / f"two/{trial}_angle.csv"
        path.write_text(path.read_text().removeprefix("Recorder 3\n"))
    assert "export them alike" not in study_of("two").said


def test_a_unit_that_a_column_s_name_ends_in_is_taken(workplace, laid_over):
    """A forearm that stays near 0 deg would look like one in rad."""
    for seed, trial in enumerate(("t1", "t2")):
        columns = {"time": times(), "biceps_uV": burst(seed), "triceps_mV": burst(seed + 9)}
        table(workplace / f"units/{trial}.csv", {**columns, "elbow_deg": 3 + np.sin(times())})
    study = study_of("units")
    dataset = laid_over(study.text).data.datasets["mine"]
    assert [signal.unit for signal in dataset.emg.values()] == ["uV", "mV"] and dataset.angle.unit == "deg"
    assert study.text.count("# GUESSED: its name ends so") == 3 and "emg_biceps: t1" not in study.said
    prepared, _ = import_trials("mine", dataset)
    assert prepared.raw["t1"].emg["emg_triceps"].values == pytest.approx(1000 * burst(9), rel=1e-6)


def test_a_matlab_file_with_a_rate_for_each_kind_of_signal_needs_none_in_the_settings(workplace, laid_over):
    (workplace / "matlab").mkdir()
    for seed, trial in enumerate(("t1", "t2")):
        signals = {"emg_biceps": burst(seed), "emg_triceps": burst(seed + 9), "elbow_angle": curl()}
        savemat(workplace / f"matlab/{trial}.mat", {**signals, "fs_emg": float(EMG_HZ), "fs_angle": float(ANGLE_HZ)})
    study = study_of("matlab")
    assert "rate_hz: null" not in study.text and f"{ANGLE_HZ:g} Hz" in study.said
    prepared, _ = import_trials("mine", laid_over(study.text).data.datasets["mine"])
    assert prepared.raw["t1"].emg["emg_biceps"].rate == EMG_HZ and prepared.raw["t1"].angle.rate == ANGLE_HZ


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
        study = study_of(folder)
        assert "Jane" not in study.text + study.said
        dataset = laid_over(study.text).data.datasets["mine"]
        assert dataset.trials == ("a", "b") and set(dataset.emg) == {"emg_biceps", "emg_triceps"}
        prepared, _ = import_trials("mine", dataset)
        assert prepared.raw["b"].angle.values == pytest.approx(np.radians(curl()), abs=1e-6)
        assert prepared.raw["b"].emg["emg_biceps"].values == pytest.approx(burst(1), rel=1e-4, abs=1e-4)
    path = workplace / "one/b.csv"
    lines = path.read_text().splitlines()
    lines[-1] = "1200,0,lost,0,0"
    path.write_text("\n".join(lines))
    with pytest.raises(ValueError, match=f"b.csv, row {len(lines)}: RElbowAngles X is 'lost'"):
        import_trials("mine", laid_over(study_of("one").text).data.datasets["mine"])


def test_formats_may_be_mixed_and_what_files_do_not_say_is_guessed_or_asked_for(workplace, laid_over):
    for seed, trial in enumerate(("t1", "t2")):
        (workplace / "mixed").mkdir(exist_ok=True)
        savemat(workplace / f"mixed/{trial}_emg.mat", {"biceps": np.abs(burst(seed)), "triceps": burst(seed + 9)})
        degrees = "\n".join(f"{t:.2f}\t{a:.6f}" for t, a in zip(times(rate=ANGLE_HZ), curl(), strict=True))
        head = "motion\ninDegrees=yes\nendheader\ntime\tr_elbow_flex\n"
        (workplace / f"mixed/{trial}.mot").write_text(head + degrees + "\n")
    study = study_of("mixed")
    dataset = laid_over(study.text).data.datasets["mine"]
    assert dataset.emg["emg_biceps"].form == "envelope" and dataset.emg["emg_triceps"].form == "raw"
    assert dataset.emg["emg_biceps"].unit == "au" and dataset.angle.unit is None and dataset.angle.column is None
    assert "rate_hz: null # FILL IN" in study.text and "samples a second" in study.said
    stated = study.text.replace("rate_hz: null", f"rate_hz: {EMG_HZ}")
    prepared, _ = import_trials("mine", laid_over(stated).data.datasets["mine"])
    assert prepared.raw["t2"].angle.values == pytest.approx(np.radians(curl()), abs=1e-6)


def test_maximum_contractions_set_what_counts_as_one(workplace, laid_over):
    write_session(workplace / "curls")
    for muscle in ("biceps", "triceps"):
        noraxon(workplace / "curls/mvc" / f"{muscle}.csv", "x", burst(99, scale=200), EMG_HZ, "uV")
    dataset = laid_over(study_of("curls").text).data.datasets["mine"]
    assert dataset.mvc == ("mvc",) and dataset.processing.normalise == "mvc" and "mvc" not in dataset.trials
    prepared, _ = import_trials("mine", dataset)
    assert max(envelope.max() for envelope in np.moveaxis(prepared.trials.emg, -1, 0)) < 0.9


def test_an_arm_without_extensors_where_no_triceps_was_recorded(workplace, laid_over):
    write_session(workplace / "curls")
    for trial in "abc":
        (workplace / f"curls/{trial}/triceps.csv").unlink()
    study = study_of("curls")
    settings = laid_over(study.text)
    assert {muscle.side for muscle in settings.physics_of("mine").muscles.values()} == {"flexor"}
    assert set(settings.data.datasets["mine"].identify) == {"strength_flexors", "length_flexors"}
    assert "no extensor of the elbow was recorded" in study.said


def test_the_persons_forearm_is_in_the_arm(workplace, laid_over):
    write_session(workplace / "curls")
    light, heavy = (
        laid_over(study_of("curls", body=Body(m, 1.7, "f")).text).physics_of("mine").joint for m in (50, 90)
    )
    assert heavy.mass_kg / light.mass_kg == pytest.approx(90 / 50, rel=1e-3)


def test_an_arm_of_other_settings_is_taken_with_its_groups(workplace):
    write_session(workplace / "curls")
    muscles = {name: None for name in ("TRIlong", "TRIlat", "TRImed")}
    arm = {"preset": "arm26", "muscles": muscles}
    Path("arm.yaml").write_text(yaml.safe_dump({"physics": {"arms": {"thin": arm}}}))
    study = study_of("curls", config=[Path("config.yaml"), Path("arm.yaml")], arm="thin")
    dataset = yaml.safe_load(study.text)["data"]["datasets"]["mine"]
    assert dataset["arm"] == "thin" and set(dataset["identify"]) == {"strength_flexors", "length_flexors"}
    assert "config.yaml arm.yaml mine.yaml" in study.said and "Before it runs" not in study.said
    assert "there is no 'thin'" in study_of("curls", arm="thin").said


def test_a_channel_without_a_muscle_is_asked_for(workplace):
    write_session(workplace / "curls")
    for trial in "abc":
        for number, muscle in enumerate(("biceps", "triceps")):
            (workplace / f"curls/{trial}/{muscle}.csv").rename(workplace / f"curls/{trial}/emg{number}.csv")
            path = workplace / f"curls/{trial}/emg{number}.csv"
            path.write_text(path.read_text().replace(muscle, "sensor"))
    said = study_of("curls").said
    assert "no channel has the name of an elbow's muscle" in said and "Before it runs, correct" in said


def test_a_table_without_names_of_columns_is_refused_and_says_so(workplace):
    for trial in ("t1", "t2"):
        table(workplace / f"bare/{trial}.csv", everything(0))
        path = workplace / f"bare/{trial}.csv"
        path.write_text(path.read_text().partition("\n")[2])
    with pytest.raises(ValueError, match="t1.csv: numbers already in row 1; expected a row with names of columns"):
        study_of("bare")


def test_a_folder_with_emg_but_no_angle_is_refused(workplace):
    write_session(workplace / "curls")
    for trial in "abc":
        (workplace / f"curls/{trial}/elbow.csv").unlink()
        (workplace / f"curls/{trial}/tilt.csv").unlink()
    with pytest.raises(ValueError, match="no angle recognised among 2 signals in .trial./biceps.csv, .*Rename"):
        study_of("curls")


def test_a_name_that_is_taken_or_cannot_be_one_is_refused(workplace):
    with pytest.raises(ValueError, match="there is a dataset case1 in config.yaml already"):
        study_of(workplace, "case1")
    with pytest.raises(ValueError, match="'my study' cannot be the name of a study"):
        study_of(workplace, "my study")


@pytest.fixture
def command(workplace):
    write_session(workplace / "curls")
    return lambda *more: CliRunner().invoke(app, ["new", "mine", "--from", "curls", *more])


def test_the_command_writes_the_file_and_says_what_to_run(command, laid_over):
    done = command("--mass", "70", "--height", "1.7", "--sex", "f")
    assert done.exit_code == 0 and laid_over(Path("mine.yaml").read_text()).data.datasets["mine"].arm == "mine"
    lines = [line for line in done.stdout.splitlines() if line.startswith("  snakemake")]
    assert len(lines) == 2 and all(line.endswith("--configfile config.yaml mine.yaml") for line in lines)
    assert "c, the last" in done.stdout and "FILL IN" in Path("mine.yaml").read_text()


def test_the_command_writes_over_a_file_only_when_told_to(command):
    Path("mine.yaml").write_text("mine: precious\n")
    done = command()
    assert done.exit_code == 2 and "is there already" in done.stderr and "precious" in Path("mine.yaml").read_text()
    assert command("--force").exit_code == 0 and "precious" not in Path("mine.yaml").read_text()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--mass", "70"], "--mass, --height and --sex are given together"),
        (["--mass", "70", "--height", "1.7", "--sex", "f", "--arm", "default"], "has a forearm of its own"),
        (["--config", "gone.yaml"], "There is no gone.yaml"),
    ],
)
def test_the_command_explains_a_mistake_in_one_line(command, options, says):
    done = command(*options)
    assert done.exit_code == 2 and says in done.stderr and not Path("mine.yaml").exists()


def test_a_brachioradialis_that_was_recorded_has_an_arm_that_uses_it(workplace):
    with_it, without = (
        arm_of("mine", ("emg_biceps", "emg_triceps", *more), Choice()) for more in (("emg_brachioradialis",), ())
    )
    assert (with_it.name, without.name) == ("arm26_brd", "arm26") and set(with_it.groups) - set(without.groups)
    assert "emg_brachioradialis" in with_it.channels and not with_it.to_do and not without.to_do


def test_a_persons_forearm_and_a_brachioradialis_go_together_and_each_strength_is_identified(workplace, laid_over):
    write_session(workplace / "curls")
    for trial in "abc":
        noraxon(workplace / f"curls/{trial}/brachioradialis.csv", "x", burst(7), EMG_HZ, "uV")
    settings = laid_over(study_of("curls", body=Body(70, 1.7, "f")).text)
    arm, dataset = settings.physics_of("mine"), settings.data.datasets["mine"]
    assert arm.muscles["BRD"].emg == "emg_brachioradialis" and arm.muscles["BIClong"].emg == "emg_biceps"
    assert {"strength_brachioradialis", "strength_flexors"} <= set(dataset.identify) and dataset.arm == "mine"


def test_a_brachioradialis_alone_drives_all_flexors(workplace):
    arm = arm_of("mine", ("emg_brachioradialis", "emg_triceps"), Choice())
    assert "      preset: arm26 # muscles with moment arms of an adult, and curves" in arm.lines
    assert "        BIClong: {emg: emg_brachioradialis}" in arm.lines
