"""Recordings of an arm without muscles: a motor, a part that a column chooses, several trials of one file."""

from contextlib import chdir

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from myowave.data.checks.finding import in_sentences
from myowave.data.importing import import_trials
from myowave.data.store import read_trials, write_trials
from myowave.settings import MeasuredDataset, RecordedDataset

KT, OHM = 0.4, 2.0


@pytest.fixture
def make(tmp_path):
    """Two recordings with uneven times, imported: (changes of the block) -> trials; `told` is what was doubtful."""
    told: list[str] = []
    random = np.random.default_rng(0)
    for name in ("one", "two"):
        time = np.cumsum(random.uniform(0.008, 0.012, 600))
        columns = {"time_s": time, "angle_rad": np.sin(time), "duty": 0.1 * np.cos(2 * time), "volts": 5 + 0 * time}
        pd.DataFrame({**columns, "on": (time < 2.5).astype(int)}).to_csv(tmp_path / f"{name}.csv", index=False)

    def imported(**changes):
        where = {"file": "{trial}.csv"}
        block = {
            "kind": "recorded",
            "trials": ["one", "two"],
            "test": ["two"],
            "angle": {**where, "column": "angle_rad", "unit": "rad"},
            "layout": {"resample_hz": 100},
            "ignore_columns": ["duty", "volts", "on"],
            "identify": {},
            **changes,
        }
        with chdir(tmp_path):
            prepared, quality = import_trials("machine", RecordedDataset.model_validate(block))
        told[:] = in_sentences(quality)
        write_trials(prepared.trials, tmp_path / "trials.parquet")
        return read_trials(tmp_path / "trials.parquet")

    imported.told = told
    return imported


def motor(**changes):
    of = {"file": "{trial}.csv", "column": "duty", "volts": "volts", "kt_Nm_A": KT, "resistance_ohm": OHM}
    return {**of, **changes}


def test_uneven_times_are_brought_to_one_rate_and_refused_otherwise(make, tmp_path):
    trials = make()
    assert trials.dt == pytest.approx(0.01) and trials.emg.shape[-1] == 0
    time = np.arange(100) * 0.01
    start = np.arcsin(trials.angle[0, 0])
    np.testing.assert_allclose(trials.angle[0, :100], np.sin(start + time), atol=1e-4)
    with pytest.raises(ValueError, match="Resample the file"):
        make(layout={})
    for path in tmp_path.glob("*.csv"):
        rows = path.read_text().splitlines()
        path.write_text("\n".join([*rows[:300], *rows[320:]]))
    with pytest.raises(ValueError, match=r"one.csv: nothing was sampled for 0.2\d* s after .* Cut the file there.*two"):
        make()


def test_a_motors_torque_is_known_over_time_and_falls_with_speed(make):
    trials = make(motor=motor(sign=-1))
    assert trials.constants == {"braking": pytest.approx(KT**2 / OHM)} and trials.over_time == {"motor": "motor_Nm"}
    start = np.arcsin(trials.angle[0, 0])
    expected = -KT / OHM * 5 * 0.1 * np.cos(2 * (start + np.arange(100) * 0.01))
    np.testing.assert_allclose(trials.signals["motor_Nm"][0, :100], expected, atol=1e-3)
    recorded = make(motor={"file": "{trial}.csv", "column": "duty", "unit": "Ncm"})
    np.testing.assert_allclose(-0.01 / (KT / OHM * 5) * trials.signals["motor_Nm"], recorded.signals["motor_Nm"])
    assert recorded.constants == {"braking": 0.0}
    known = trials.condition("motor", 0.0)[:, None] + trials.change_over_time("motor")
    np.testing.assert_allclose(known, trials.signals["motor_Nm"])
    with pytest.raises(ValueError, match="give volts, kt_Nm_A and resistance_ohm together"):
        make(motor=motor(kt_Nm_A=None))


def test_the_voltage_of_a_motor_may_have_a_clock_of_its_own(make, tmp_path):
    for n, name in enumerate(("one", "two")):
        time = np.arange(0, 5, 0.005)
        duty = {"duty": 0.5 + 0 * time, "time_duty": time, "angle": np.sin(time + n)}
        volts = {"volts": 5 + time[100:900:2], "time_volts": time[100:900:2]}
        savemat(tmp_path / f"{name}.mat", {**duty, "time_angle": time, **volts})
    where = {"file": "{trial}.mat"}
    trials = make(motor=motor(**where), angle={**where, "column": "angle", "unit": "rad"}, ignore_columns=["*"])
    expected = KT / OHM * 0.5 * (5 + np.clip(trials.time, 0.5, 4.49))
    np.testing.assert_allclose(trials.signals["motor_Nm"], [expected, expected], atol=1e-9)


def test_a_duty_in_percent_is_told_from_a_share(make, tmp_path):
    share = make(motor=motor()).signals["motor_Nm"]
    for path in tmp_path.glob("*.csv"):
        pd.read_csv(path).assign(duty=lambda table: 100 * table["duty"]).to_csv(path, index=False)
    np.testing.assert_allclose(make(motor=motor(unit="%")).signals["motor_Nm"], share, atol=1e-12)
    with pytest.raises(ValueError, match="motor: duty reaches 10 in trial one; expected the share of the voltage"):
        make(motor=motor())


def test_only_what_is_uneven_is_brought_to_another_rate_and_never_to_one_that_folds_it(make, tmp_path):
    time = np.arange(3000) / 500
    for name in ("one", "two"):
        pd.DataFrame({"time_s": time, "angle_rad": np.sin(time)}).to_csv(tmp_path / f"{name}-even.csv", index=False)
    even = make(angle={"file": "{trial}-even.csv", "unit": "rad"}, motor=motor(), ignore_columns=["angle_rad", "on"])
    assert even.dt == pytest.approx(1 / 500)
    with pytest.raises(ValueError, match=r"one.csv: angle_rad is sampled unevenly, .* resample_hz is 40, which would"):
        make(layout={"resample_hz": 40})


def test_a_machine_may_turn_over_and_an_angle_that_leaps_by_a_turn_is_told(make, tmp_path):
    make()
    assert not make.told
    for path in tmp_path.glob("*.csv"):
        table = pd.read_csv(path)
        table["angle_rad"] = 3 * table["time_s"] + np.sin(table["time_s"])
        table.to_csv(path, index=False)
    trials = make()
    assert np.degrees(trials.angle).max() > 900
    (told,) = make.told
    assert "trial one, angle; trial two, angle: more than half a turn: in the first, goes from " in told
    assert "If the machine did not turn over, correct unit" in told
    for path in tmp_path.glob("*.csv"):
        table = pd.read_csv(path)
        table["angle_rad"] = (table["angle_rad"] + np.pi) % (2 * np.pi) - np.pi
        table.to_csv(path, index=False)
    make()
    (told,) = make.told
    assert "trial one, angle; trial two, angle: jump of the angle: in the first, goes by -" in told


def test_the_part_in_which_a_column_has_a_value_is_kept(make):
    keep = {"file": "{trial}.csv", "column": "on", "equals": 0}
    whole, part = make(), make(keep=keep)
    assert whole.lengths[0] - part.lengths[0] == pytest.approx(250, abs=3)
    np.testing.assert_allclose(part.angle[0, -100:], whole.angle[0, -100:], atol=1e-9)
    early = make(keep={**keep, "equals": 1}, cut_s={"one": [1.0, 9.0]})
    assert abs(early.lengths[0] * early.dt - 1.5) < 0.05 and abs(early.lengths[1] * early.dt - 2.5) < 0.05
    with pytest.raises(ValueError, match="trial one: on is never 7.*Likewise in 1 more: trial two"):
        make(keep={**keep, "equals": 7})
    with pytest.raises(ValueError, match="column 'off' is not there") as caught:
        make(keep={**keep, "column": "off", "equals": 7})
    assert "is never" not in str(caught.value)


def test_trials_may_be_parts_of_one_recording(make):
    whole = make()
    parts = make(
        trials=["begin", "end", "two"],
        recordings={"begin": "one", "end": "one"},
        cut_s={"begin": [0, 2], "end": [2, 5]},
    )
    begin = parts.lengths[0]
    assert parts.names == ("begin", "end", "two") and begin in (199, 200)  # 2 s in a file that begins at 8 to 12 ms
    np.testing.assert_allclose(parts.angle[0, :begin], whole.angle[0, :begin], atol=1e-9)
    np.testing.assert_allclose(parts.angle[1, :200], whole.angle[0, begin : begin + 200], atol=1e-9)


def test_tidy_files_of_an_arm_without_muscles_need_no_emg(tmp_path):
    time = np.arange(300) * 0.01
    for name in ("one", "two"):
        pd.DataFrame({"time_s": time, "angle_rad": np.cos(time * (1 + len(name[1:])))}).to_csv(
            tmp_path / f"{name}.csv", index=False
        )
        time = time + 0.5
    block = {"kind": "measured", "files": ["*.csv"], "test": ["two"], "identify": {}}
    settings = MeasuredDataset.model_validate(block)
    with chdir(tmp_path):
        prepared, _ = import_trials("machine", settings, channels={})
    assert prepared.trials.emg.shape == (2, 300, 0)
    with chdir(tmp_path), pytest.raises(ValueError, match="no EMG column"):
        import_trials("machine", settings)
