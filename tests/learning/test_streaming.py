"""`myowave predict`: a line in, a line out, the same numbers as a batch, and mistakes named by their line."""

import io
import itertools
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
import yaml
from typer.testing import CliRunner

from myowave.cli import app
from myowave.data.store import write_trials
from myowave.learning.inputs import Given, to_tensors
from myowave.learning.prediction import predict_free_running
from myowave.learning.streaming.command import predict_lines, start_angles
from myowave.learning.streaming.predictor import Predictor
from myowave.learning.streaming.reading import LONGEST
from myowave.learning.streaming.sources import find_checkpoint, trial_lines, trial_of
from myowave.learning.task import Task
from myowave.learning.training import train_scale
from myowave.settings.recording import RawSignal

ROOT = Path(__file__).parents[2]
SEEDS = (0, 1)


@pytest.fixture(scope="module")
def checkpoint(scales, model, wanted, settings, tmp_path_factory):
    """A checkpoint and the file it is in."""
    recipe = settings.learning.recipes["rollout"].model_copy(
        update={"hidden": 8, "epochs": 4, "rollout_s": 0.3, "simulated_trials": 0}
    )
    *_, last = train_scale(Task(scales, model, recipe, wanted, total=1, seeds=SEEDS), level=0)
    path = tmp_path_factory.mktemp("network") / "scale-0.pt"
    last.checkpoint.save(path)
    return last.checkpoint, path


@pytest.fixture
def table(trials) -> pd.DataFrame:
    """EMG of the test trial as a user's file has it, columns in another order and one more."""
    emg = dict(zip(trials.channels, trials.emg[2].T, strict=True))
    return pd.DataFrame({"emg_triceps": emg["emg_triceps"], "note": 1, "time_s": trials.time, **emg})


def run(*arguments: object, text: str | bytes | None = None):
    return CliRunner().invoke(app, ["predict", *map(str, arguments)], input=text)


def expected(checkpoint, trials, start_rad: float) -> np.ndarray:
    """(S, N) [rad] of the batch."""
    network = checkpoint.network
    emg, angle = to_tensors(trials.select(["3"]), torch.device("cpu"))
    angle[:] = start_rad
    return predict_free_running(network, emg, angle, trials.dt)[:, 0].numpy()


def test_file_and_stream_give_the_mean_and_spread_of_the_batch(checkpoint, trials, table, tmp_path):
    network, path = checkpoint
    table.to_csv(tmp_path / "emg.csv", index=False)
    out = tmp_path / "out.csv"
    result = run("--checkpoint", path, "--emg", tmp_path / "emg.csv", "--start-deg", 30, "--output", out)
    assert result.exit_code == 0, result.output
    piped = run("--checkpoint", path, "--emg", "-", "--start-deg", 30, text=table.to_csv(index=False))
    assert piped.stdout == out.read_text()
    written, batch = pd.read_csv(out), expected(network, trials, np.deg2rad(30))
    np.testing.assert_allclose(written["time_s"], trials.time, atol=1e-6)
    np.testing.assert_allclose(written["angle_rad"], batch.mean(0), rtol=0, atol=1e-6)
    np.testing.assert_allclose(written["spread_rad"], batch.std(0), rtol=1e-2, atol=1e-9)


def test_one_seed_from_measured_angles_without_times(checkpoint, trials, table):
    network, path = checkpoint
    text = table.rename(columns={"time_s": "another_time_s"}).to_csv(index=False)
    starts = ",".join(["30"] * network.network.history)
    result = run("--checkpoint", path, "--emg", "-", "--seed", SEEDS[1], "--start-deg", starts, text=text)
    written = pd.read_csv(io.StringIO(result.stdout))
    assert list(written) == ["time_s", "angle_rad"]
    assert f"no column time_s. Assumed: samples {network.dt:g} s apart" in result.stderr
    np.testing.assert_allclose(written["angle_rad"], expected(network, trials, np.deg2rad(30))[1], rtol=0, atol=1e-6)
    np.testing.assert_allclose(written["time_s"], trials.time, atol=1e-6)


def test_samples_at_a_whole_multiple_of_the_rate_are_thinned_as_the_import_does(checkpoint, table):
    """The import keeps the first sample and then one of so many; what lies between is not looked at."""
    finer = table.loc[table.index.repeat(3)].reset_index(drop=True)
    finer["time_s"] = np.arange(len(finer)) * checkpoint[0].dt / 3
    finer.loc[finer.index % 3 > 0, "emg_biceps"] = 0.9
    told = [run("--checkpoint", checkpoint[1], "--emg", "-", text=t.to_csv(index=False)) for t in (table, finer)]
    coarse, fine = (pd.read_csv(io.StringIO(result.stdout)) for result in told)
    pd.testing.assert_frame_equal(coarse, fine, atol=1e-6)
    finer.loc[30:, "time_s"] += 0.01
    result = run("--checkpoint", checkpoint[1], "--emg", "-", text=finer.to_csv(index=False))
    assert result.exit_code == 2 and "line 32: time_s goes" in result.stderr and "whole multiple" in result.stderr


@pytest.mark.parametrize("ending", [".csv.gz", ".parquet"])
def test_a_file_may_be_compressed_or_a_parquet_file(ending, checkpoint, table, tmp_path):
    path = tmp_path / f"emg{ending}"
    table.to_parquet(path) if ending == ".parquet" else table.to_csv(path, index=False)
    of_file = run("--checkpoint", checkpoint[1], "--emg", path)
    piped = run("--checkpoint", checkpoint[1], "--emg", "-", text=table.to_csv(index=False))
    assert of_file.exit_code == 0 and of_file.stdout == piped.stdout


@pytest.fixture
def project(checkpoint, trials, tmp_path, monkeypatch):
    """A folder with settings, results of a dataset `small` and one further recording of it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").symlink_to(ROOT / "data")
    network = tmp_path / "results/learning/small/base/rollout/1-scale/scale-0.pt"
    network.parent.mkdir(parents=True)
    network.write_bytes(checkpoint[1].read_bytes())
    stored = tmp_path / "results/data/small/trials.parquet"
    stored.parent.mkdir(parents=True)
    write_trials(trials, stored)
    for name, at in (("1", 0), ("2", 1), ("3", 2), ("new", 2)):
        emg = trials.emg[at] if name != "new" else 0.9 * trials.emg[at]
        columns = {"time_s": trials.time, **dict(zip(trials.channels, emg.T, strict=True))}
        pd.DataFrame({**columns, "angle_rad": trials.angle[at] + 0.1 * (name == "new")}).to_csv(
            f"{name}.csv", index=False
        )
    block = {"kind": "measured", "files": ["*.csv"], "test": ["3"]}
    text = yaml.safe_dump({"data": {"datasets": {"small": block}}, "targets": {"datasets": ["small"]}})
    (tmp_path / "mine.yaml").write_text(text)
    return "--config", ROOT / "config.yaml", "--config", "mine.yaml"


def test_a_trial_of_a_dataset_needs_no_file_names_and_has_a_picture(project, checkpoint, trials, tmp_path):
    batch = predict_free_running(
        checkpoint[0].network, *to_tensors(trials.select(["3"]), torch.device("cpu")), trials.dt
    )
    result = run("--dataset", "small", "--trial", "3", "--picture", "glance.png", *project)
    assert result.exit_code == 0 and "Network: results/learning/small/base" in result.stderr, result.output
    replace(checkpoint[0], dataset="of_another").save(tmp_path / "other.pt")
    other = run("--dataset", "small", "--trial", "3", "--checkpoint", "other.pt", *project)
    assert "other.pt was trained on of_another, not on small" in other.stderr
    assert "was trained on" not in result.stderr
    written = pd.read_csv(io.StringIO(result.stdout))
    np.testing.assert_allclose(written["angle_rad"], batch[:, 0].mean(0), rtol=0, atol=1e-6)
    assert (tmp_path / "glance.png").read_bytes().startswith(b"\x89PNG")


def test_the_method_of_a_network_counts_and_not_what_its_recipe_is_called(project, checkpoint):
    """The paper's comes last of one model; models with more effects are not looked at."""
    network, _ = checkpoint
    architecture = replace(network.architecture, method="paper")
    weights = {name: torch.zeros(len(SEEDS), *shape) for name, shape in architecture.shapes.items()}
    learnt = Path("results/learning/small")
    (learnt / "base/rollout").rename(learnt / "base/after_the_paper")
    for folder, of in (
        ("base/a/1-scale", replace(network, architecture=architecture, weights=weights)),
        ("base+joint_damping/rollout/1-scale", network),
    ):
        of.save(learnt / folder / "scale-0.pt")
    assert find_checkpoint("small") == learnt / "base/after_the_paper/1-scale/scale-0.pt"
    shutil.copytree(learnt / "base/after_the_paper/1-scale", learnt / "base/aaa/3-scale")
    assert find_checkpoint("small") == learnt / "base/after_the_paper/1-scale/scale-0.pt", "a name decides last"
    shutil.rmtree(learnt / "base/aaa")
    shutil.rmtree(learnt / "base/after_the_paper")
    assert find_checkpoint("small") == learnt / "base/a/1-scale/scale-0.pt"


def test_a_recording_that_was_made_since_is_prepared_as_the_others(project, checkpoint):
    by_name = run("--dataset", "small", "--trial", "new", *project)
    by_file = run("--dataset", "small", "--emg", "new.csv", *project)
    alone = run("--checkpoint", checkpoint[1], "--emg", "new.csv")
    assert by_name.exit_code == 0, by_name.output
    read = [pd.read_csv(io.StringIO(result.stdout)) for result in (by_name, by_file, alone)]
    for other in read[1:]:
        pd.testing.assert_frame_equal(read[0], other, atol=1e-6)


def test_a_trial_that_the_settings_name_is_prepared_as_they_say_where_none_is_stored(project, checkpoint):
    config, stored = [ROOT / "config.yaml", Path("mine.yaml")], Path("results/data/small/trials.parquet")
    there = {name: trial_lines("small", name, checkpoint[0], config) for name in ("1", "3")}
    stored.unlink()
    for name, lines in there.items():
        found, expected = (
            pd.read_csv(io.StringIO("\n".join(each)))
            for each in (trial_lines("small", name, checkpoint[0], config), lines)
        )
        pd.testing.assert_frame_equal(found, expected)


def test_a_file_is_of_the_trial_that_the_settings_have_this_very_file_for(project):
    """A recorder's name says the muscle, and its folder the trial; the angle's file is no EMG."""
    config = [ROOT / "config.yaml", Path("mine.yaml")]
    folder, file = "data/elbow_curls/emg/new_1", "Noraxon Ultium-RT BICEPS BR..csv.gz"
    assert trial_of(Path(folder, file), "human_curls", config) == "new_1"
    assert trial_of(Path("data").absolute().parent / folder / file, "human_curls", config) == "new_1"
    assert trial_of(Path("new.csv").absolute(), "small", config) == "new"
    for dataset in ("human_curls", "small", "case1", "of another run"):
        assert trial_of(Path(folder, "new.csv"), dataset, config) is None
    both = RawSignal(file="raw/{trial}/{trial}_emg.csv")
    assert both.trial_of(Path("raw/a/a_emg.csv")) == "a" and both.trial_of(Path("raw/a/b_emg.csv")) is None


def test_another_file_that_is_called_as_a_trial_is_read_itself(project):
    Path("other").mkdir()
    shutil.copy("2.csv", "other/1.csv")
    other, second, first = (
        run("--dataset", "small", *given, *project)
        for given in (("--emg", "other/1.csv"), ("--emg", "2.csv"), ("--trial", "1"))
    )
    read = [pd.read_csv(io.StringIO(result.stdout)) for result in (other, second, first)]
    pd.testing.assert_frame_equal(read[0], read[1], atol=1e-6)
    assert np.ptp(read[0]["angle_rad"] - read[2]["angle_rad"]) > 1e-3
    missing = run("--dataset", "small", "--emg", "other/3.csv", *project)
    assert missing.exit_code == 2 and "other/3.csv: No such file" in missing.stderr


@pytest.mark.parametrize("constants", [{}, {"load": 2.0}])
def test_what_is_known_of_other_trials_has_the_value_that_it_had_in_training(project, checkpoint, trials, constants):
    """A trial that names none has the dataset's constant, or the default of the model."""
    given = Given(known={"load": 0.5}, told=("load",))
    network = replace(checkpoint[0], architecture=replace(checkpoint[0].architecture, given=given))
    conditions, stored = {"1": {"load": 1.0}}, "results/data/small/trials.parquet"
    write_trials(replace(trials, conditions=conditions, constants=constants), stored)
    config, of_nothing = [ROOT / "config.yaml", Path("mine.yaml")], Path("mine.yaml").read_text()
    laid_over = yaml.safe_load(of_nothing)
    laid_over["data"]["datasets"]["small"] |= {"conditions": conditions, "constants": constants}
    config[1].write_text(yaml.safe_dump(laid_over))
    read = [pd.read_csv(io.StringIO("\n".join(trial_lines("small", name, network, config)))) for name in ("1", "3")]
    assert set(read[0]["load"]) == {1.0} and set(read[1]["load"]) == {constants.get("load", 0.5)}
    later = trial_lines("small", "new", network, config)[0]
    assert ("load" in later) == bool(constants), "else nobody has said what the hand holds in a later trial"
    write_trials(trials, stored)
    config[1].write_text(of_nothing)
    assert "load" not in trial_lines("small", "3", network, config)[0]


def test_a_trial_that_was_prepared_with_another_load_is_not_predicted(project):
    mine = Path("mine.yaml")
    laid_over = yaml.safe_load(mine.read_text())
    laid_over["data"]["datasets"]["small"]["conditions"] = {"1": {"load": 2.0}}
    mine.write_text(yaml.safe_dump(laid_over))
    result = run("--dataset", "small", "--trial", "1", *project)
    assert result.exit_code == 2 and "prepared with other conditions.1 than" in result.stderr, result.output
    assert f"trials.parquet --configfile {ROOT}/config.yaml mine.yaml" in result.stderr


def test_of_a_trial_that_is_not_there_all_that_are_are_told(project):
    for arguments, says in (
        (("--dataset", "small", "--trial", "4"), "has no trial '4'. There are 1, 2, 3."),
        (("--dataset", "smal", "--trial", "4"), "There is no network of 'smal'"),
        (("--trial", "4"), "Give --dataset NAME --trial TRIAL"),
        (("--dataset", "small"), "Give --dataset NAME --trial TRIAL"),
        (("--dataset", "small", "--trial", "1", "--emg", "new.csv"), "--trial 1 and --emg new.csv are both given"),
    ):
        result = run(*arguments, *project)
        assert result.exit_code == 2 and says in result.stderr, result.output


def test_the_assumed_start_is_said(checkpoint, trials, table):
    network, path = checkpoint
    result = run("--checkpoint", path, "--emg", "-", text=table.to_csv(index=False))
    assert "no column angle_rad or angle_deg. Assumed: at rest at" in result.stderr
    written = pd.read_csv(io.StringIO(result.stdout))
    batch = expected(network, trials, network.scaling.angle_mean)
    np.testing.assert_allclose(written["angle_rad"], batch.mean(0), rtol=0, atol=1e-6)


@pytest.mark.parametrize(("column", "scale"), [("angle_rad", 1.0), ("angle_deg", 180 / np.pi)])
def test_a_measured_angle_is_the_start_and_no_more_of_it_is_looked_at(checkpoint, trials, table, column, scale):
    network, path = checkpoint
    emg, angle = to_tensors(trials.select(["3"]), torch.device("cpu"))
    batch = predict_free_running(network.network, emg, angle, trials.dt)[:, 0].numpy()
    measured = scale * trials.angle[2]
    measured[network.network.history :] = 0.0
    result = run("--checkpoint", path, "--emg", "-", text=table.assign(**{column: measured}).to_csv(index=False))
    taken = f"Start: the first {network.network.history} angles of the column {column}"
    assert result.exit_code == 0 and taken in result.stderr
    written = pd.read_csv(io.StringIO(result.stdout))
    np.testing.assert_allclose(written["angle_rad"], batch.mean(0), rtol=0, atol=1e-6)
    told = run("--checkpoint", path, "--emg", "-", "--start-deg", 30, text=table.assign(**{column: measured}).to_csv())
    assert "Start" not in told.stderr and "0.523598" in told.stdout.splitlines()[1], "what is said counts more"


def test_an_angle_column_that_holds_no_angle_is_not_the_start_and_it_is_said_why(checkpoint, table):
    network, path = checkpoint
    for column, value in (("angle_rad", 30.0), ("angle_deg", np.nan)):
        text = table.assign(**{column: value}).to_csv(index=False)
        result = run("--checkpoint", path, "--emg", "-", text=text)
        assert result.exit_code == 0 and f"line 2: {column} is" in result.stderr and "Assumed: at rest" in result.stderr
        assert float(result.stdout.splitlines()[1].split(",")[1]) == pytest.approx(network.scaling.angle_mean)
    half = table.assign(angle_deg=[30.0, 31.0, "lost", *[33.0] * (len(table) - 3)]).to_csv(index=False)
    result = run("--checkpoint", path, "--emg", "-", text=half)
    assert result.exit_code == 2 and "line 4: angle_deg is 'lost'" in result.stderr and "--start-deg" in result.stderr


def test_degrees_are_those_of_the_radians(checkpoint, table):
    texts = [run("--checkpoint", checkpoint[1], "--emg", "-", *deg, text=table.to_csv()) for deg in ((), ("--deg",))]
    rad, deg = (pd.read_csv(io.StringIO(result.stdout)) for result in texts)
    assert list(deg) == ["time_s", "angle_deg", "spread_deg", "low_deg", "high_deg"]
    np.testing.assert_allclose(np.deg2rad(deg["angle_deg"]), rad["angle_rad"], rtol=1e-7)
    for end in ("low", "high"):
        np.testing.assert_allclose(np.deg2rad(deg[f"{end}_deg"]), rad[f"{end}_rad"], rtol=1e-6)
    np.testing.assert_allclose(np.deg2rad(deg["spread_deg"]), rad["spread_rad"], rtol=1e-2, atol=1e-8)


def test_each_line_is_answered_before_the_next_one_comes(checkpoint, table):
    lines = table.to_csv(index=False).splitlines(keepends=True)
    command = [sys.executable, "-m", "myowave.cli", "predict", "--checkpoint", str(checkpoint[1]), "--emg", "-"]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment
    ) as process:
        for i, line in enumerate(lines[:12]):
            process.stdin.write(line)
            process.stdin.flush()
            if i:
                answers = [process.stdout.readline() for _ in range(2 if i == 1 else 1)]  # the names come first
                assert answers[-1].startswith(f"{table['time_s'][i - 1]:.4g}"[:4])
        process.stdin.close()
        assert process.stdout.read() == ""
    assert process.returncode == 0


def with_biceps(word: str):
    """Replaces one number of the biceps, in the eleventh line, by a word."""
    return lambda t: t.astype(object).mask((t.index == 9)[:, None] & (t.columns == "emg_biceps"), word)


def with_line(number: int, change):
    """Changes the text of one line."""

    def spoil(table):
        lines = table.to_csv(index=False).splitlines(keepends=True)
        lines[number - 1] = change(lines[number - 1])
        return "".join(lines)

    return spoil


FAULTS = {
    "no such channel": (lambda t: t.rename(columns={"emg_triceps": "triceps"}), ["line 1", "emg_triceps", "triceps"]),
    "no header": (lambda t: t.to_csv(index=False, header=False), ["line 1", "no column emg_biceps"]),
    "a channel twice": (with_line(1, lambda x: x.replace("note", "emg_biceps")), ["line 1", "emg_biceps", "keep one"]),
    "text": (with_biceps("abc"), ["line 11", "'abc'"]),
    "not a number": (with_biceps("nan"), ["line 11", "'nan'"]),
    "infinite": (with_biceps("inf"), ["line 11", "'inf'"]),
    "nothing in a cell": (with_biceps(""), ["line 11", "''", "expected a number"]),
    "not normalised": (
        with_biceps("5.1"),
        ["line 11", "emg_biceps is 5.1", "expected 0 to 5", "maximum voluntary contraction"],
    ),
    "not rectified": (with_biceps("-0.2"), ["line 11", "emg_biceps is -0.2", "expected 0 to 5", "Rectify"]),
    "another rate": (lambda t: t.assign(time_s=t["time_s"] / 1.5), ["line 3", "time_s", "Resample"]),
    "time in ms": (lambda t: t.assign(time_s=t["time_s"] * 1000), ["line 3", "time_s", "Resample"]),
    "time goes back": (with_line(9, lambda x: x.replace(x.split(",")[2], "0.01")), ["line 9", "time_s goes from"]),
    "a stray quote": (with_line(7, lambda x: '"' + x), ["line 7", "no line of CSV"]),
    "a quote inside": (with_line(7, lambda x: x.replace(",", ',"', 1)), ["line 7", "no line of CSV"]),
    "a quote before the last cell": (with_line(7, lambda x: ',"'.join(x.rsplit(",", 1))), ["line 7", "no line of CSV"]),
    "a cell too many": (with_line(7, lambda x: "0," + x), ["line 7", "5 values", "names 4 columns"]),
    "a line cut off": (with_line(7, lambda x: x[:9] + "\n"), ["line 7", "values, but the first line names 4"]),
    "a line without an end": (with_line(7, lambda x: 9 * LONGEST * "0"), ["line 7", "without end"]),
    "a zero byte": (with_line(7, lambda x: x.replace("0", "\0", 1)), ["line 7", "expected a number"]),
    "bytes of another encoding": (with_line(7, lambda x: x.replace(",1,", ",1,\udcff", 1)), ["line 7", "\\xff"]),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_spoilt_line_is_named_and_what_came_before_is_kept(checkpoint, table, tmp_path, fault):
    spoil, says = FAULTS[fault]
    out, spoilt = tmp_path / "out.csv", spoil(table)
    text = spoilt if isinstance(spoilt, str) else spoilt.to_csv(index=False)
    result = run(
        "--checkpoint", checkpoint[1], "--emg", "-", "--output", out, text=text.encode(errors="surrogateescape")
    )
    assert result.exit_code == 2
    assert all(word in result.stderr for word in says), result.stderr
    good = int(says[0].split()[1]) - 2
    assert len(out.read_text().splitlines()) == good + 1 if good > 0 else not out.exists()


def test_a_stray_quote_holds_no_answer_back(checkpoint, table):
    network, _ = checkpoint
    lines = table.to_csv(index=False).splitlines(keepends=True)
    lines[5] = '"' + lines[5]

    def endless():
        yield from lines[:6]
        raise AssertionError("another line was asked for before the quote was told")

    answers = predict_lines(Predictor(network), endless(), "the sensor", start_angles(network, "30"), say=str)
    assert len([next(answers) for _ in range(5)]) == 5
    with pytest.raises(ValueError, match="the sensor, line 6"):
        next(answers)


def test_input_that_is_closed_or_never_ends_is_told(checkpoint, tmp_path, monkeypatch, capsys):
    os.mkfifo(tmp_path / "emg.csv")
    for endless in (tmp_path / "emg.csv", "/dev/zero"):
        result = run("--checkpoint", checkpoint[1], "--emg", endless)
        assert result.exit_code == 2 and "this is a pipe or a device; expected a file" in result.stderr
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(SystemExit, match="2"):
        app(["predict", "--checkpoint", str(checkpoint[1]), "--emg", "-"])
    assert "Standard input is closed" in capsys.readouterr().err


def test_only_what_is_a_prediction_is_written_over(checkpoint, table, tmp_path):
    emg, link, other, out = (tmp_path / name for name in ("emg.csv", "link.csv", "another_trial.csv", "out.csv"))
    for path in (emg, other):
        table.assign(angle_rad=0.5)[["time_s", "angle_rad", "emg_biceps", "emg_triceps"]].to_csv(path, index=False)
    link.symlink_to(emg)
    held = {path: path.read_bytes() for path in (emg, link, other, checkpoint[1])}
    asked = ("--checkpoint", checkpoint[1], "--emg", emg)
    for option, path in itertools.product(("--output", "--picture"), held):
        result = run(*asked, option, path)
        assert result.exit_code == 2 and f"{path} is there already, and is no " in result.stderr
    assert {path: path.read_bytes() for path in held} == held
    assert run(*asked, "--output", out, "--picture", out).exit_code == 2 and not out.exists()
    for _, ending in itertools.product(range(2), ("png", "pdf", "svg")):  # the second time over the first
        assert run(*asked, "--output", out, "--picture", tmp_path / f"look.{ending}").exit_code == 0


@pytest.mark.parametrize("name", ["look.xyz", "look"])
def test_a_picture_of_no_format_is_refused_before_anything_is_predicted(checkpoint, table, tmp_path, name):
    result = run("--checkpoint", checkpoint[1], "--emg", "-", "--picture", name, text=table.to_csv(index=False))
    assert result.exit_code == 2 and not result.stdout
    assert f"{name}: the ending is {Path(name).suffix!r}; expected .png" in result.stderr


@pytest.mark.parametrize("angles", ["nan", "inf", "1e9", "30,nan,30,30", "", "30;31", "thirty"])
def test_a_start_that_is_no_angle_is_refused(checkpoint, table, angles):
    result = run("--checkpoint", checkpoint[1], "--emg", "-", f"--start-deg={angles}", text=table.to_csv(index=False))
    assert result.exit_code == 0 if not angles else result.exit_code == 2 and "expected angles of -180" in result.stderr


def flip_weight(path, content):
    """Change one byte of a weight, wherever the file holds it."""
    held = bytearray(path.read_bytes())
    held[held.index(content["weights"]["output"].numpy().tobytes())] ^= 0xFF
    path.write_bytes(held)


CHECKPOINTS = {
    "text": (lambda path, _: path.write_text("not a network"), "not a checkpoint"),
    "a byte of a weight": (flip_weight, "damaged"),
    "a field missing": (lambda path, c: torch.save({k: c[k] for k in c if k != "dt"}, path), "dt: Field required"),
    "a seed more": (lambda path, c: torch.save(c | {"seeds": (0, 1, 2)}, path), "do not fit each other"),
}


@pytest.mark.parametrize("fault", CHECKPOINTS)
def test_what_is_no_checkpoint_is_refused(checkpoint, table, tmp_path, fault):
    """In one line; tests/bad_inputs has the others."""
    spoil, says = CHECKPOINTS[fault]
    path = tmp_path / "scale-0.pt"
    path.write_bytes(checkpoint[1].read_bytes())
    spoil(path, torch.load(path, weights_only=True))
    result = run("--checkpoint", path, "--emg", "-", text=table.to_csv(index=False))
    assert result.exit_code == 2 and re.search(says, result.stderr), result.output
    assert str(path) in result.stderr and len(result.stderr.splitlines()) == 1 and not result.stdout


def test_files_that_are_not_there_are_named(checkpoint, table, tmp_path):
    assert run("--checkpoint", tmp_path / "none.pt", "--emg", "-", text="").exit_code == 2
    for name, says in ((tmp_path / "none.csv", "No such file"), (tmp_path, "Is a directory")):
        result = run("--checkpoint", checkpoint[1], "--emg", name)
        assert result.exit_code == 2 and f"{name}: {says}" in result.stderr and "Errno" not in result.stderr
    wrong = run("--checkpoint", checkpoint[1], "--emg", "-", "--start-deg", "30,31", text=table.to_csv(index=False))
    assert wrong.exit_code == 2 and "2 angles" in wrong.stderr
