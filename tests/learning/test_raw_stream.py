"""`myowave predict --raw`: raw EMG sample by sample gives what its preparation with causal filters gives as a whole."""

import io
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch
from matplotlib.figure import Figure
from typer.testing import CliRunner

from myowave.cli import app
from myowave.data.importing import prepare
from myowave.data.processing.excitation import RealTime
from myowave.data.processing.sampled import Sampled
from myowave.data.recording import RawTrial, Session
from myowave.learning.inputs import to_tensors
from myowave.learning.prediction import predict_free_running
from myowave.learning.streaming.raw import read_raw_samples
from myowave.learning.task import Task
from myowave.learning.training import train_scale
from myowave.settings import RecordedDataset, RolloutRecipe

RATE, ANGLE_RATE, SECONDS = 500.0, 60.0, 4.0
MUSCLES = ("emg_biceps", "emg_triceps")


def raw_emg(seed, rate=RATE):
    """Noise [uV] that swells and fades, with hum, about the offset of an amplifier that drifts."""
    random, time = np.random.default_rng(seed), np.arange(0, SECONDS, 1 / rate)
    swell = 20 + 60 * np.sin(2 * np.pi * time / 2 + seed) ** 2
    return 300 + 5 * time + swell * random.standard_normal(len(time)) + 80 * np.sin(2 * np.pi * 50 * time)


def session(rate=RATE, last=1.0):
    """Three trials, of which the last tests; its EMG is `last` times as large."""
    time = np.arange(0, SECONDS - 0.1, 1 / ANGLE_RATE)
    angle = Sampled(1.0 + 0.6 * np.sin(2 * np.pi * time / 2), ANGLE_RATE, 0.0, "rad")
    trials = {}
    for t, name in enumerate("abc"):
        gain = last if name == "c" else 1.0
        emg = {m: Sampled(gain * raw_emg(10 * t + i, rate), rate, 0.0, "uV") for i, m in enumerate(MUSCLES)}
        trials[name] = RawTrial(emg, angle, {})
    return Session(trials, dict.fromkeys(MUSCLES, "raw"))


def settings(**processing) -> RecordedDataset:
    return RecordedDataset(
        kind="recorded", trials=list("abc"), test=["c"], angle={"file": "a"}, emg={m: {"file": "e"} for m in MUSCLES},
        processing={"phase": "causal", "band_pass_hz": (20.0, 200.0), "low_pass_hz": 4.0, **processing},
    )  # fmt: skip


def as_lines(recorded: Session, trial: str, **columns) -> list[str]:
    emg = recorded.trials[trial].emg
    table = pd.DataFrame({"time_s": 7.0 + emg[MUSCLES[0]].time, **{m: emg[m].values for m in MUSCLES}, **columns})
    return table.to_csv(index=False).splitlines(keepends=True)


def stream(prepared, lines):
    real_time = RealTime.model_validate(prepared.trials.real_time)
    return list(read_raw_samples(lines, real_time, prepared.trials.dt, "the amplifier", say=str))


@pytest.mark.parametrize(
    "processing",
    [{}, {"band_pass_hz": None}, {"notch_hz": 50.0}, {"rate_hz": 100.0}, {"rate_hz": 37.0}, {"rate_hz": 700.0}],
    ids=str,
)
def test_sample_by_sample_is_the_batch_to_rounding(processing):
    recorded = session()
    prepared = prepare("me", settings(**processing), recorded)
    for t, name in enumerate("abc"):
        samples, batch = (
            stream(prepared, as_lines(recorded, name)),
            prepared.trials.emg[t, : prepared.trials.lengths[t]],
        )
        np.testing.assert_allclose([s.emg for s in samples[: len(batch)]], batch, rtol=0, atol=1e-9)
        assert len(samples) >= len(batch)
        times = [s.time for s in samples[: len(batch)]]
        np.testing.assert_allclose(times, 7.0 + np.arange(len(batch)) * prepared.trials.dt, atol=1e-6)


def test_a_causal_preparation_knows_nothing_of_what_comes_later_and_nothing_of_test_trials():
    one, other = session(), session(last=1.2)
    late = one.trials["a"].emg["emg_biceps"].values.copy()
    late[1000:] *= 0.5
    spoilt = replace(one.trials["a"], emg={**one.trials["a"].emg, "emg_biceps": Sampled(late, RATE, 0.0, "uV")})
    changed = Session({**one.trials, "a": spoilt}, one.forms)
    wanted = settings(rate_hz=100.0)
    first, second = prepare("me", wanted, one), prepare("me", wanted, changed)
    early = slice(0, 199)  # 2 s, less the sample that waits for the next one of the amplifier
    scale = first.gains["emg_biceps"] / second.gains["emg_biceps"]
    np.testing.assert_allclose(scale * first.trials.emg[0, early, 0], second.trials.emg[0, early, 0], rtol=1e-9)
    louder = prepare("me", settings(band_pass_hz=None), other).trials.real_time
    assert louder == prepare("me", settings(band_pass_hz=None), one).trials.real_time


def test_an_answer_comes_with_the_sample_of_the_amplifier_that_it_needs():
    recorded = session()
    prepared = prepare("me", settings(rate_hz=100.0), recorded)
    lines, asked = as_lines(recorded, "a"), 0

    def amplifier():
        nonlocal asked
        for line in lines:
            asked += 1
            yield line

    real_time = RealTime.model_validate(prepared.trials.real_time)
    samples = read_raw_samples(amplifier(), real_time, 0.01, "amplifier", say=str)
    waits = [asked for _ in zip(range(50), samples, strict=False)]
    assert waits[0] == 2 + 27, "the first lag of the low-pass, 56 ms, and the line of names"
    assert np.all(np.diff(waits[10:]) == 5)  # 500 Hz against 100 Hz


FAULTS = {
    "another rate": (lambda t: t.assign(time_s=t["time_s"] * 2), "line 3: time_s goes from"),
    "a clock that is slower": (lambda t: t.assign(time_s=t["time_s"] * 1.05), "500 Hz, as it was recorded"),
    "volts for microvolts": (lambda t: t.assign(emg_biceps=1e3 * t["emg_biceps"]), "Raw EMG is expected in uV"),
    "no number": (lambda t: t.assign(emg_biceps="lost"), "line 2: emg_biceps is 'lost'"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_raw_emg_that_is_something_else_is_refused(fault):
    spoil, says = FAULTS[fault]
    recorded = session()
    prepared = prepare("me", settings(), recorded)
    table = spoil(pd.read_csv(io.StringIO("".join(as_lines(recorded, "a")))))
    with pytest.raises(ValueError, match="amplifier, line") as caught:
        stream(prepared, table.to_csv(index=False).splitlines(keepends=True))
    assert says in str(caught.value)


@pytest.fixture(scope="module")
def network_of(model, wanted):
    """Trains on a prepared session."""

    def train(trials):
        recipe = RolloutRecipe(hidden=4, epochs=1, rollout_s=0.2, simulated_trials=0)
        task = Task({0: trials}, model, recipe, wanted, total=1, seeds=(0, 1), device=torch.device("cpu"))
        *_, last = train_scale(task, level=0)
        return last.checkpoint

    return train


def predict(checkpoint, folder, text):
    checkpoint.save(folder / "scale-0.pt")
    command = ["predict", "--raw", "--checkpoint", str(folder / "scale-0.pt"), "--emg", "-", "--start-deg", "40"]
    return CliRunner().invoke(app, command, input=text)


def test_the_command_predicts_from_raw_emg_what_the_batch_predicts(network_of, tmp_path):
    recorded = session()
    trials = prepare("me", settings(), recorded).trials
    checkpoint = network_of(trials)
    result = predict(checkpoint, tmp_path, "".join(as_lines(recorded, "c")))
    assert result.exit_code == 0, result.output
    inputs, angle = to_tensors(trials.select(["c"]), torch.device("cpu"))
    angle[:] = np.deg2rad(40)
    batch = predict_free_running(checkpoint.network, inputs, angle, trials.dt)[:, 0].mean(0).numpy()
    written = pd.read_csv(io.StringIO(result.stdout))["angle_rad"].to_numpy()
    np.testing.assert_allclose(written[: len(batch)], batch, rtol=0, atol=1e-6)


@pytest.mark.parametrize("raw", [True, False])
def test_the_picture_is_told_how_far_apart_lines_without_times_are(network_of, tmp_path, monkeypatch, raw):
    recorded, steps = session(), []
    checkpoint = network_of(prepare("me", settings(), recorded).trials)
    text = "".join(as_lines(recorded, "c", emg_biceps=0.1, emg_triceps=0.1))
    monkeypatch.setattr("myowave.learning.figures.draw_prediction", lambda *given: steps.append(given[3]) or Figure())
    checkpoint.save(tmp_path / "scale-0.pt")
    lines = "\n".join(line.partition(",")[2] for line in text.splitlines())
    command = ["predict", *["--raw"] * raw, "--checkpoint", f"{tmp_path}/scale-0.pt", "--emg", "-"]
    done = CliRunner().invoke(app, [*command, "--picture", f"{tmp_path}/look.png"], input=lines)
    assert done.exit_code == 0 and steps == [1 / RATE if raw else checkpoint.dt], done.output


def test_a_network_that_cannot_run_causally_says_so_and_what_to_do(network_of, trials, tmp_path):
    prepared = prepare("me", settings(phase="zero"), session())
    result = predict(network_of(prepared.trials), tmp_path, "")
    assert result.exit_code == 2 and "filtered forwards and backwards" in result.stderr
    assert "data.datasets.me.processing.phase: causal" in result.stderr and len(result.stderr.splitlines()) == 1
    result = predict(network_of(trials), tmp_path, "")
    assert result.exit_code == 2 and "came with processed EMG" in result.stderr
