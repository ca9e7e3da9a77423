"""`myowave predict`: a line in, a line out, the same numbers as a batch, and mistakes named by their line."""

import io
import os
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import torch
from typer.testing import CliRunner

from myowave.cli import app
from myowave.learning.prediction import predict_free_running, to_tensors
from myowave.learning.task import Task
from myowave.learning.training import train_scale

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


def run(*arguments: object, text: str | None = None):
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
    text = table.drop(columns="time_s").to_csv(index=False)
    result = run("--checkpoint", path, "--emg", "-", "--seed", SEEDS[1], "--start-deg", "30,30,30,30", text=text)
    written = pd.read_csv(io.StringIO(result.stdout))
    assert list(written) == ["time_s", "angle_rad"]
    np.testing.assert_allclose(written["angle_rad"], expected(network, trials, np.deg2rad(30))[1], rtol=0, atol=1e-6)
    np.testing.assert_allclose(written["time_s"], trials.time, atol=1e-6)


def test_the_assumed_start_is_said(checkpoint, trials, table):
    network, path = checkpoint
    result = run("--checkpoint", path, "--emg", "-", text=table.to_csv(index=False))
    assert "Assumed: at rest at" in result.stderr
    written = pd.read_csv(io.StringIO(result.stdout))
    batch = expected(network, trials, network.scaling.angle_mean)
    np.testing.assert_allclose(written["angle_rad"], batch.mean(0), rtol=0, atol=1e-6)


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


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda t: t.rename(columns={"emg_triceps": "triceps"}), ["line 1", "emg_triceps", "triceps"]),
        (with_biceps("abc"), ["line 11", "'abc'"]),
        (with_biceps("nan"), ["line 11", "'nan'"]),
        (with_biceps("1.51"), ["line 11", "emg_biceps is 1.51", "expected 0 to 1.5", "maximum voluntary contraction"]),
        (with_biceps("-0.01"), ["line 11", "emg_biceps is -0.01", "expected 0 to 1.5", "Rectify"]),
        (lambda t: t.assign(time_s=t["time_s"] / 2), ["line 3", "time_s", "Resample"]),
    ],
)
def test_a_spoilt_line_is_named_and_what_came_before_is_kept(checkpoint, table, tmp_path, spoil, says):
    out = tmp_path / "out.csv"
    text = spoil(table).to_csv(index=False)
    result = run("--checkpoint", checkpoint[1], "--emg", "-", "--output", out, text=text)
    assert result.exit_code == 2
    assert all(word in result.stderr for word in says), result.stderr
    good = int(says[0].split()[1]) - 2
    assert len(out.read_text().splitlines()) == (good + 1 if good > 0 else 0)


def test_what_is_no_checkpoint_is_refused(checkpoint, table, tmp_path):
    other = tmp_path / "other.pt"
    other.write_text("not a network")
    result = run("--checkpoint", other, "--emg", "-", text=table.to_csv(index=False))
    assert result.exit_code == 2 and "not a checkpoint" in result.stderr
    assert run("--checkpoint", tmp_path / "none.pt", "--emg", "-", text="").exit_code == 2
    wrong = run("--checkpoint", checkpoint[1], "--emg", "-", "--start-deg", "30,31", text=table.to_csv(index=False))
    assert wrong.exit_code == 2 and "2 angles" in wrong.stderr
