"""The joint's motion behind a sensor that reports it otherwise than it was."""

from dataclasses import replace

import numpy as np
import pytest

from myowave.identification.along import Along
from myowave.identification.record import make_record

DT_S = 0.01


@pytest.fixture(scope="module")
def moved(clean, base):
    """A record of a motion of 0.5 Hz with a tremor, as a sensor reports it: (name, response, tremor in Hz) -> (record,
    joint's angle); the response is that of the sensor at a frequency [rad/s]."""

    def make(response, tremor_hz):
        record = make_record(clean, base, 0.05)
        time = np.arange(record.angle.shape[1]) * DT_S
        parts = [(0.3, np.pi), (0.05, 2 * np.pi * tremor_hz)]
        joint = 1 + sum(a * np.sin(w * time) for a, w in parts)
        reported = response(0) + sum(a * np.imag(response(w) * np.exp(1j * w * time)) for a, w in parts)
        angle = np.broadcast_to(np.real(reported), record.angle.shape).copy()
        return replace(record, angle=angle, dt=DT_S, window=7, valid=np.ones_like(record.valid)), joint

    return make


@pytest.mark.parametrize("tremor_hz", [2.0, 4.0, 6.0])
@pytest.mark.parametrize(
    ("name", "response", "worst_deg"),
    [
        ("elastic_mount.s", lambda w: 1 + 0.001 * w**2, 0.1),
        ("elastic_mount.s", lambda w: 1 + 0.004 * w**2, 0.6),  # of 17 deg more that such a mount reports at 6 Hz
        ("observation_lag.tau", lambda w: 1 / (1 + 0.05j * w), 0.1),
        ("angle_scale.s", lambda w: 1.05, 0.02),
    ],
    ids=["mount", "soft mount", "lag", "gain"],
)
def test_fast_motion_behind_a_sensor_is_found(moved, base, effects, name, response, worst_deg, tremor_hz):
    values = {"elastic_mount.s": 1 - response(1.0), "observation_lag.tau": 0.05, "angle_scale.s": 0.05}
    record, joint = moved(response, tremor_hz)
    model = base.with_effects([effects[name.partition(".")[0]]])
    _, found, _ = Along(model, record, {name: values[name].real}).motion
    off = np.degrees(found - joint)[:, 50:-50]  # what the joint did outside a trial nobody knows
    assert np.sqrt((off**2).mean()) < worst_deg


def test_a_longer_trial_beside_them_changes_no_others(moved, base, effects):
    """Behind the end of a shorter trial nothing was measured, though a late sensor would have reported it."""
    record, _ = moved(lambda w: 1 / (1 + 0.05j * w), 2.0)
    values, model = {"observation_lag.tau": 0.05}, base.with_effects([effects["observation_lag"]])
    end = record.angle.shape[1] - 5
    valid = record.valid & ((np.arange(end + 5) < end) | (np.arange(len(record.valid)) == 0)[:, None])
    held = np.where(valid, record.angle, record.angle[:, end - 1 : end])
    apart = Along(model, record.take([1]), values).motion[2][0, : end - 50]
    beside = Along(model, replace(record, angle=held, valid=valid), values).motion[2][1, : end - 50]
    assert np.abs(beside - apart).max() < 0.05
