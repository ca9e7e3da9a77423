"""The horizon comparison: prediction from measured states, and whole trials."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import torch

from myowave.data.trials import Trials
from myowave.diagnosis.comparison.baselines import EMG_ONLY, HOLD, POSTURE, SAME_SPEED
from myowave.diagnosis.comparison.horizons import HORIZONS_S, Restarts, baselines, compare_horizons, drive_features
from myowave.diagnosis.comparison.summary import summarize
from myowave.diagnosis.comparison.torque import compare_torque
from myowave.identification.along import Along
from myowave.identification.record import make_record
from myowave.physics.motion import simulate

NO_ERRORS = pd.DataFrame(columns=["model", "trial", "role", "rmse_deg", "horizon_s"])
HIDDEN = [
    {},
    {"extra_delay": {"d_emg_biceps": 0.013, "d_emg_triceps": 0.013}},
    {"activation_dynamics": {"rise": 0.1, "decay": 0.15}},
    {"angle_scale": {"s": 0.1}},
]


@pytest.fixture
def exact(make_trials, base, true_model):
    """A true model along its own motion, measured without error: (hidden effects) -> Along."""

    def make(hidden: dict, leaning: bool = False) -> Along:
        model, values = true_model(hidden)
        trials = make_trials(noise_deg=0.0)
        if leaning:
            tilt = 0.1 + 0.4 * np.sin(0.05 * np.arange(trials.angle.shape[1]) + np.arange(len(trials.names))[:, None])
            trials = replace(
                trials, signals={"tilt_rad": tilt}, over_time={"tilt": "tilt_rad"}, constants={"tilt": 0.1}
            )
        one = Along(model, make_record(trials, base, 0.05), values)
        start = torch.from_numpy(trials.angle[:, 0])
        motion = simulate(one.simulation, start)
        q, qdot = motion.q.numpy(), motion.qdot.numpy()
        made = Along(model, replace(one.record, angle=motion.angle.numpy()), values)
        vars(made)["motion"] = (q, q, qdot)  # a cached property keeps its value there
        return made

    return make


@pytest.mark.parametrize("hidden", HIDDEN, ids=lambda hidden: "+".join(hidden) or "none")
def test_the_true_model_from_true_states_makes_no_error_at_any_horizon(exact, hidden):
    table = compare_horizons([exact(hidden)], NO_ERRORS)
    rows = table[table["predictor"] == "+".join(("base", *hidden))]
    assert set(rows["horizon_s"]) == set(HORIZONS_S) and set(rows["held_out"]) == {False, True}
    assert rows["rmse_deg"].max() < 1e-7


def test_an_upper_arm_that_leans_over_time_is_known_at_every_restart_and_in_torque(exact):
    one = exact({}, leaning=True)
    assert (compare_horizons([one], NO_ERRORS).query("predictor == 'base'")["rmse_deg"] < 1e-7).all()
    assert (compare_torque([one]).query("model == 'base'")["r2"] > 0.999).all()
    still = Along(one.model, replace(one.record, course=None), one.params)
    vars(still)["motion"] = one.motion
    assert compare_horizons([still], NO_ERRORS).query("predictor == 'base'")["rmse_deg"].max() > 1
    assert (compare_torque([still]).query("model == 'base'")["r2"] < 0.99).all()


@pytest.mark.parametrize(
    "hidden",
    [
        {},
        {"activation_dynamics": {"rise": 0.1, "decay": 0.15}},
        {"clock_shift": {"d": 0.05}},
        {"clock_drift": {"d": 0.02}},
    ],
    ids="+".join,
)
def test_the_true_model_from_measured_states_misses_by_next_to_nothing(make_trials, along, hidden):
    table = compare_horizons([along(make_trials(hidden, noise_deg=0.0), hidden)], NO_ERRORS)
    errors = table[table["horizon_s"] == 0.5].groupby("predictor")["rmse_deg"].max()
    assert errors.iloc[errors.index.str.startswith("base")].item() < 0.1 < errors[EMG_ONLY]


def test_the_muscles_know_the_emg_before_the_restart_and_none_after_the_delay(exact):
    one = exact({})
    trial, start = np.array([0]), np.array([50])
    delay = int(np.ceil(0.08 / one.record.dt))

    def with_emg_changed(at: int) -> np.ndarray:
        emg = one.record.emg.clone()
        emg[0, at] += 0.3
        changed = Along(one.model, replace(one.record, emg=emg), one.params)
        vars(changed)["motion"] = one.motion
        return changed.predict(trial, start, 20)[0] - one.predict(trial, start, 20)[0]

    before, after = with_emg_changed(49), with_emg_changed(60)
    assert np.abs(before).max() > 1e-4, "what came before the restart still arrives"
    assert not after[: 10 + delay - 1].any() and np.abs(after).max() > 1e-4


def test_a_damper_that_is_missing_shows_more_the_longer_the_horizon(make_trials, along):
    trials = make_trials({"joint_damping": {"c": 1.5}}, noise_deg=0.0)
    table = compare_horizons([along(trials)], NO_ERRORS).query("predictor == 'base' and not held_out")
    errors = table.set_index("horizon_s")["rmse_deg"]
    assert errors[0.1] < errors[0.2] < errors[0.5] and errors[0.5] > 0.5


def moved_steadily(speed: float, lengths: tuple[int, ...] = (150, 120, 150)) -> Trials:
    random = np.random.default_rng(0)
    time = [np.arange(length) * 0.02 for length in lengths]
    return Trials.from_sequences(
        dataset="steady",
        dt=0.02,
        names=("1", "2", "3"),
        channels=("emg_biceps", "emg_triceps"),
        emg=[random.uniform(0.2, 0.4, (length, 2)) for length in lengths],
        angle=[0.3 + speed * t for t in time],
        test=("3",),
    )


def test_motion_at_one_speed_is_what_the_baseline_of_that_name_predicts(base):
    record = make_record(moved_steadily(0.2), base, 0.05)
    table = compare_horizons([Along(base, record, {})], NO_ERRORS)
    errors = table.pivot(index=["held_out", "horizon_s"], columns="predictor", values="rmse_deg")
    assert errors[SAME_SPEED].max() < 1e-9
    for held_out in (False, True):
        expected = np.degrees([0.2 * h for h in HORIZONS_S])
        np.testing.assert_allclose(errors[HOLD][held_out], expected, rtol=1e-9)


def test_nothing_is_scored_beyond_the_end_of_a_shorter_trial(base):
    trials = moved_steadily(0.2)
    record = make_record(trials, base, 0.05)
    restarts = Restarts.every(record, 0.25)
    assert (restarts.start < np.array(trials.lengths)[restarts.trial]).all()
    last = restarts.start[restarts.reach(record, 100) & (restarts.trial == 1)]
    assert last.max() + 100 < 120, "the second trial has 120 samples"


def test_trials_that_end_before_the_first_restart_have_no_horizon(base):
    """Parts that `cut_s` keeps may be as short."""
    record = make_record(moved_steadily(0.2, (13, 12, 13)), base, 0.05)
    table = compare_horizons([Along(base, record, {})], NO_ERRORS)
    assert table.empty and summarize(compare_torque([Along(base, record, {})]), table)["horizons"]["horizon_s"] is None


def test_a_motion_that_overflows_gives_an_infinite_row_and_stops_nothing(make_trials, base):
    record = make_record(make_trials(noise_deg=0.0), base, 0.05)
    models = [Along(base, record, values) for values in ({"l0_Bi": 1e-3}, {"f0_Bi": 1e200})]
    table = compare_horizons(models, NO_ERRORS)
    assert np.isinf(table[table["predictor"] == "base"]["rmse_deg"]).any()
    assert np.isfinite(table[table["predictor"] != "base"]["rmse_deg"]).all()


def test_a_change_of_the_held_out_trial_changes_no_baseline(make_trials, base):
    trials = make_trials(noise_deg=0.5)
    angle, emg = trials.angle.copy(), trials.emg.copy()
    angle[3], emg[3] = angle[3][::-1] + 0.1, 0.5 * emg[3][::-1]
    changed = replace(trials, angle=angle, emg=emg)
    found = []
    for one in (trials, changed):
        record = make_record(one, base, 0.5)
        restarts = Restarts.every(record, 0.25)
        found.append((baselines(record, restarts), restarts.trial == 3))
    (before, held_out), (after, _) = found
    for name in (POSTURE, EMG_ONLY):
        for horizon in HORIZONS_S:
            same = before[name][horizon] == after[name][horizon]
            assert same[~held_out].all() and not same[held_out].all()


def test_drive_features_are_the_means_of_four_windows_up_to_the_horizon(base):
    record = make_record(moved_steadily(0.2), base, 0.05)
    restarts = Restarts(np.array([0]), np.array([60]))
    found = drive_features(record, record.emg.numpy(), restarts, 30)[0, -8:].reshape(4, 2)
    emg = record.emg[0].numpy()
    expected = [emg[51 + 10 * i : 61 + 10 * i].mean(0) for i in range(4)]  # from 0.2 s before sample 60 to sample 90
    np.testing.assert_allclose(found, expected)


def test_the_last_horizon_is_the_error_of_whole_trials_by_their_samples(base):
    record = make_record(moved_steadily(0.2), base, 0.05)
    errors = pd.DataFrame(
        {
            "model": "base",
            "trial": ["1", "2", "3"],
            "role": ["train", "train", "test"],
            "rmse_deg": [1.0, 2.0, 7.0],
            "horizon_s": np.nan,
        }
    )
    table = compare_horizons([Along(base, record, {})], errors)
    whole = table[np.isinf(table["horizon_s"])].set_index("held_out")["rmse_deg"]
    assert whole[False] == pytest.approx(np.sqrt((150 * 1 + 120 * 4) / 270)) and whole[True] == pytest.approx(7.0)
