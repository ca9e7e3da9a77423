"""The torque comparison: needed and given torque, what is missing, and the predictors to beat."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.data.trials import Trials
from myowave.diagnosis.comparison.baselines import EMG_ONLY, NOISE, POSTURE, fit_linear, polynomial
from myowave.diagnosis.comparison.torque import compare_torque, score
from myowave.identification.along import Along
from myowave.identification.record import make_record
from myowave.identification.torque import TorqueBalance, windows_of
from myowave.physics.joint import STANDARD_GRAVITY

DAMPING = {"joint_damping": {"c": 0.6}}


@pytest.mark.parametrize(
    ("hidden", "least"),
    [
        ({}, 0.999),
        (DAMPING, 0.999),
        ({"forearm_inertia": {"r": 0.5}}, 0.999),
        ({"gravity_tilt": {"phi": 0.2}}, 0.999),
        ({"activation_dynamics": {"rise": 0.1, "decay": 0.15}}, 0.995),
        ({"fatigue": {"k": 0.8}}, 0.999),
        ({"compliant_tendon": {"strain": 0.04}}, 0.995),
        ({"angle_scale": {"s": 0.1}}, 0.999),
        ({"clock_shift": {"d": 0.05}}, 0.98),
        ({"clock_drift": {"d": 0.02}}, 0.98),
    ],
    ids=lambda value: "+".join(value) if isinstance(value, dict) else "",
)
def test_the_true_model_gives_the_torque_that_the_motion_needs(make_trials, along, hidden, least):
    table = compare_torque([along(make_trials(hidden, noise_deg=0.0), hidden)])
    assert (table[table["model"] == "+".join(("base", *hidden))]["r2"] > least).all()


def test_emg_explains_the_torque_whatever_gives_it(make_trials, along):
    """A function of angle and speed for each electrode holds muscles of any shape, and a damper beside them."""
    trials = make_trials({"joint_damping": {"c": 3.0}}, noise_deg=0.0)
    held_out = compare_torque([along(trials)]).query("held_out").set_index("model")["r2"]
    assert held_out[EMG_ONLY] > 0.98 > held_out["base"] and held_out[POSTURE] < 0.7, held_out


def test_what_the_base_model_lacks_is_the_torque_of_the_hidden_damper(make_trials, along):
    trials = make_trials(DAMPING, noise_deg=0.0)
    one = along(trials)
    balance, windows = TorqueBalance.along(one), windows_of(one.record)
    found = balance.torques({})
    missing = (found.needed - found.given)[balance.inside]
    # -c times the mean velocity of a window, by parts: int w qdot = -int w' q, on a fine straight-line path.
    expected = []
    half, dt = windows.half, trials.dt
    for angle, inside in zip(trials.angle, balance.inside, strict=True):
        for start in np.arange(len(inside))[inside] * windows.stride:
            s = np.linspace(-1, 1, 4001)
            q = np.interp(start + half * (1 + s), np.arange(len(angle)), angle)
            by_parts = np.trapezoid(6 * s * (1 - s**2) ** 2 * q, s) / (half * dt)
            expected.append(-0.6 * by_parts / np.trapezoid((1 - s**2) ** 3, s))
    assert np.std(expected) > 0.1
    assert np.sqrt(np.mean((missing - expected) ** 2)) < 0.1 * np.std(expected)
    assert np.polyfit(expected, missing, 1)[0] == pytest.approx(1, abs=0.03)


def test_a_known_motion_needs_inertia_times_acceleration_and_its_weight(base):
    dt, omega, size = 0.01, 3.0, 0.4
    time = np.arange(300) * dt
    angle = 0.8 + size * np.sin(omega * time)
    trials = Trials(
        dataset="swing",
        dt=dt,
        names=("1",),
        channels=("emg_biceps", "emg_triceps"),
        emg=np.full((1, 300, 2), 0.3),
        angle=angle[None],
        lengths=(300,),
        constants={"mass": 2.0, "length": 0.3, "load": 0.5},
    )
    one = Along(base, make_record(trials, base, 0.05), {})
    windows = windows_of(one.record)
    needed = TorqueBalance.along(one).torques({}).needed[0]
    middle = (np.arange(len(needed)) * windows.stride + windows.half) * dt
    s = np.linspace(-1, 1, 2001)
    at = middle[:, None] + windows.half * dt * s
    weight = 2.5 * STANDARD_GRAVITY * 0.3 * np.sin(0.8 + size * np.sin(omega * at))
    torque = 2.5 * 0.3**2 * -size * omega**2 * np.sin(omega * at) + weight
    test = (1 - s**2) ** 3
    np.testing.assert_allclose(needed, (torque @ test) / test.sum(), rtol=5e-4)


def test_r2_and_rmse_are_those_computed_by_hand(make_trials, along):
    one = along(make_trials(noise_deg=0.0))
    inside = np.zeros((4, 4), bool)
    inside[:, :3] = True
    inside[1] = False
    needed = np.tile([1.0, 2.0, 6.0, 50.0], (4, 1))
    given = needed + [1.0, -1.0, 2.0, 99.0]
    given[2, 0] = np.nan
    balance = TorqueBalance.along(one)
    windows = replace(balance.windows, inside=inside)
    rows = score("m", needed, given, replace(balance, windows=windows, moved=torch.from_numpy(needed)))
    # Squares left: 1 + 1 + 4 over 3; about the mean 3: 4 + 1 + 9 over 3. The fourth window is not inside.
    assert rows[0]["rmse_Nm"] == pytest.approx(np.sqrt(2)) and rows[0]["r2"] == pytest.approx(1 - 6 / 14)
    assert np.isnan(rows[1]["rmse_Nm"]) and np.isnan(rows[1]["r2"]), "a trial without a window"
    assert (rows[2]["rmse_Nm"], rows[2]["r2"]) == (np.inf, -np.inf), "a torque that overflows"
    assert [row["held_out"] for row in rows] == [False, False, False, True]


def test_of_a_torque_that_never_changes_nothing_is_explained(make_trials, base):
    """But for rounding of it."""
    trials = make_trials(noise_deg=0.0)
    angle = trials.angle.copy()
    angle[3] = 0.7
    table = compare_torque([Along(base, make_record(replace(trials, angle=angle), base, 0.05), {})])
    assert (table["r2"].isna() == (table["trial"] == "4")).all() and np.isfinite(table["rmse_Nm"]).all()


@pytest.mark.parametrize("value", [1e15, 1e308, np.inf, np.nan])
def test_a_model_whose_torque_overflows_has_an_infinite_row(make_trials, base, value):
    trials = make_trials(noise_deg=0.0)
    record = make_record(trials, base, 0.05)
    table = compare_torque([Along(base, record, {}), Along(base, record, {"f0_Bi": value})])
    per_trial = table.groupby(np.arange(len(table)) // 4)["rmse_Nm"].max()
    assert np.isfinite(per_trial[0]) and per_trial[1] == np.inf and np.isfinite(per_trial[2:]).all()


def test_a_change_of_the_held_out_trial_changes_no_baseline(make_trials, base):
    trials = make_trials(noise_deg=0.5)
    angle, emg = trials.angle.copy(), trials.emg.copy()
    angle[3], emg[3] = angle[3][::-1] + 0.1, 0.5 * emg[3][::-1]
    changed = replace(trials, angle=angle, emg=emg)
    before, after = (compare_torque([Along(base, make_record(t, base, 0.5), {})]) for t in (trials, changed))
    for name in (POSTURE, EMG_ONLY):
        one, other = (table[table["model"] == name].set_index("trial") for table in (before, after))
        assert (one["r2"][:3] == other["r2"][:3]).all() and one["r2"]["4"] != other["r2"]["4"]


def test_noise_of_the_angle_alone_leaves_what_its_row_says(make_trials, base):
    quiet = Along(base, make_record(make_trials(noise_deg=0.0), base, 0.05), {})
    balance = TorqueBalance.along(quiet)
    without = balance.torques({}).needed
    left = []
    for seed in range(12):
        noisy = Along(base, make_record(make_trials(noise_deg=0.5, seed=seed), base, 0.5), {})
        left.append((TorqueBalance.along(noisy).torques({}).needed - without)[balance.inside])
    told = compare_torque([noisy]).set_index("model").loc[NOISE, "rmse_Nm"]
    np.testing.assert_allclose(told, np.sqrt(np.mean(np.square(left))), rtol=0.1)


def test_least_squares_finds_a_polynomial_from_the_training_rows_only():
    random = np.random.default_rng(0)
    q, qdot = random.uniform(-1, 1, (2, 60))
    target = 1 + 2 * q * qdot**2 - 3 * q**3
    training = np.arange(60) < 40
    features = polynomial(q, qdot)
    found = fit_linear(features, np.where(training, target, 1e6), training)
    np.testing.assert_allclose(features @ found, target, atol=1e-9)
    assert not fit_linear(features, target, np.zeros(60, bool)).any()
