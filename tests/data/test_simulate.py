"""Synthetic trials: what Fig. 7 and Table 2 ask of them, and a truth that does not leak."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.signal import find_peaks

from myowave.data.json_files import write_json
from myowave.data.simulate import (
    ANGLE_RANGE,
    FREQUENCY_RANGE,
    MANOEUVRES,
    Manoeuvre,
    simulate_trials,
    synthetic_emg,
)
from myowave.data.store import write_trials
from myowave.physics.effects import catalogue
from myowave.physics.motion import simulate
from myowave.physics.muscle import EXTENSOR, FLEXOR
from myowave.physics.simulation import Simulation, channels_of
from myowave.settings import SimulatedDataset


def dataset(**changes):
    return SimulatedDataset(**({"kind": "simulated", "test": ("3",)} | changes))


@pytest.fixture(scope="module")
def plain(base):
    """Trials of seed 1 without any noise."""
    return simulate_trials("case", dataset(emg_noise=0.0), base, {})[0]


@pytest.fixture(scope="module")
def case3(base):
    return simulate_trials("case3", dataset(emg_noise=0.2), base, {})


def test_emg_is_a_smooth_fraction_that_reaches_1():
    for seed in range(30):
        emg = synthetic_emg(seed)
        assert emg.min() >= 0 and emg.max() <= 1
        assert emg.max(axis=1) == pytest.approx(1.0)
        assert np.abs(np.diff(emg, axis=1)).max() < 0.15


def test_each_trial_has_a_frequency_of_its_own_that_wanders():
    dt = 0.05
    flexor = synthetic_emg(0, samples=8000, dt=dt)[..., 0]
    bursts = [find_peaks(channel, prominence=0.1)[0] * dt for channel in flexor]
    rates = sorted(1 / np.diff(times).mean() for times in bursts)
    assert (np.diff(rates) > 0.1 * np.array(rates[1:])).all()
    assert rates[0] > FREQUENCY_RANGE[0] and rates[-1] < FREQUENCY_RANGE[1]
    for times in bursts:
        assert np.ptp(np.diff(times)) > 0.2 * np.diff(times).mean()


def test_a_seed_is_a_dataset():
    assert (synthetic_emg(1) == synthetic_emg(1)).all()
    assert not np.allclose(synthetic_emg(1), synthetic_emg(2))
    assert not np.allclose(synthetic_emg(1), synthetic_emg(1, draw=1))


@pytest.mark.parametrize("emg_noise", [0.0, 0.1, 0.15, 0.2])
def test_the_angle_stays_in_range_from_rest_at_30_degrees(base, emg_noise):
    trials, _ = simulate_trials("case", dataset(trials=8, samples=300, emg_noise=emg_noise, seed=7), base, {})
    assert trials.angle.min() > ANGLE_RANGE[0] and trials.angle.max() < ANGLE_RANGE[1]
    assert (np.ptp(trials.angle, axis=1) > 0.3).all()
    assert (trials.angle[:, 0] == dataset().start_rad).all()
    # From rest under a constant torque (the delay holds the first EMG) distances grow as 1, 3, 5, ...
    first, second = np.diff(trials.angle[:, :3]).T
    assert (second / first) == pytest.approx(3.0, rel=0.15)
    assert trials.emg.min() >= 0 and trials.emg.max() <= 1


def test_the_stored_emg_with_its_noise_drives_the_motion(case3, base):
    trials, truth = case3
    drive = channels_of(base, trials.channels, torch.from_numpy(trials.emg))
    again = simulate(Simulation(base, truth["parameters"], drive, trials.dt), trials.angle[0, 0])
    assert np.abs(again.angle.numpy() - trials.angle).max() < 2e-4  # one step between kinks; stored motion has more


def test_cases_differ_in_their_noise_alone(plain, case3):
    noisy = case3[0].emg
    inside = (noisy > 0) & (noisy < 1) & (np.abs(plain.emg - 0.5) < 0.05)  # where hardly any noise is cut off
    assert (noisy - plain.emg)[inside].std() == pytest.approx(0.2, rel=0.1)
    assert np.abs(case3[0].angle - plain.angle).max() > np.radians(1)


def test_angle_noise_is_on_the_measurement_not_in_the_motion(base, plain):
    noisy = simulate_trials("noisy", dataset(emg_noise=0.0, angle_noise_deg=1.0), base, {})[0]
    assert (plain.emg == noisy.emg).all()
    error = np.degrees(noisy.angle - plain.angle)
    assert error.std() == pytest.approx(1.0, rel=0.05)
    assert abs((error[:, 1:] * error[:, :-1]).mean()) < 0.1


def test_a_trial_out_of_range_is_redrawn_alone_and_this_is_recorded(base):
    settings = dataset(trials=8, emg_noise=0.25, seed=9)
    trials, _ = simulate_trials("case", settings, base, {})
    draws = np.array(list(trials.provenance["draws"].values()))
    assert 0 < (draws > 0).sum() < 8
    assert trials.angle.min() > ANGLE_RANGE[0] and trials.angle.max() < ANGLE_RANGE[1]


def test_a_hidden_effect_moves_the_arm_and_is_nowhere_in_the_trials(base, plain, tmp_path):
    hidden = {"joint_damping": {"c": 1.2345}}
    settings = dataset(hidden_effect=hidden, emg_noise=0.0, angle_noise_deg=0.54321)
    trials, truth = simulate_trials("case", settings, base, catalogue())
    assert np.abs(trials.angle - plain.angle).max() > np.radians(5)
    assert (trials.emg == plain.emg).all()
    assert truth["model"] == "base+joint_damping" and truth["effects"] == ["joint_damping"]
    assert truth["parameters"]["joint_damping.c"] == 1.2345
    write_trials(trials, tmp_path / "trials.parquet")
    write_trials(replace(plain, angle=trials.angle), tmp_path / "plain.parquet")
    assert (tmp_path / "trials.parquet").read_bytes() == (tmp_path / "plain.parquet").read_bytes()


def test_the_truth_is_written_apart(case3, tmp_path):
    write_json(case3[1], tmp_path / "truth.json")
    truth = json.loads((tmp_path / "truth.json").read_text())
    assert truth["emg_noise"] == 0.2 and truth["parameters"]["f0_Bi"] == 300.0 and truth["effects"] == []


def test_known_loads_act_in_their_trials_alone(base, plain):
    settings = dataset(emg_noise=0.0, conditions={"4": {"load": 0.5}}, constants={"mass": 1.0})
    loaded, _ = simulate_trials("case", settings, base, {})
    same = [np.abs(loaded.angle[i] - plain.angle[i]).max() < 1e-8 for i in range(5)]
    assert same == [True, True, True, False, True]
    drive = channels_of(base, loaded.channels, torch.from_numpy(loaded.emg[3:4]))
    again = simulate(Simulation(base, {"load": 0.5}, drive, loaded.dt), settings.start_rad)
    assert np.abs(again.angle.numpy() - loaded.angle[3]).max() < 2e-4


def test_manoeuvres_do_what_they_are_called():
    def draw(manoeuvre, **options):
        return synthetic_emg(0, trials=1, manoeuvres=[manoeuvre], **options)[0]

    usual = draw(MANOEUVRES["as recorded"])
    assert (draw(MANOEUVRES["passive swing"]) == 0).all()
    assert draw(MANOEUVRES["co-contraction"]).min() > usual.min() + 0.1
    assert draw(Manoeuvre(effort=2.0))[:, 0].min() > usual[:, 0].min() + 0.1
    speed = {name: np.abs(np.diff(draw(m), axis=0)).mean() for name, m in MANOEUVRES.items()}
    assert speed["slower"] < speed["as recorded"] < speed["faster"]


def test_any_list_of_channels_can_be_drawn():
    emg = synthetic_emg(0, sides=(FLEXOR, FLEXOR, EXTENSOR))
    assert emg.shape == (5, 500, 3)
    assert not np.allclose(emg[..., 0], emg[..., 1])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"hidden_effect": {"magic": {"c": 1.0}}}, r"case.hidden_effect: no effect \['magic'\]; the catalogue has"),
        ({"hidden_effect": {"joint_damping": {"b": 1.0}}}, r"no parameter \['joint_damping.b'\]; there are"),
        ({"hidden_effect": {"joint_damping": {"c": -1.0}}}, "joint_damping.c is -1.0 N m s/rad; expected 0"),
        ({"conditions": {"2": {"load": 8.0}}}, "case, trial 2: in .* draws the elbow angle always left 0.1 to 1.7 rad"),
    ],
)
def test_what_cannot_be_simulated_says_why(base, changes, message):
    with pytest.raises(ValueError, match=message):
        simulate_trials("case", dataset(samples=200, **changes), base, catalogue())
