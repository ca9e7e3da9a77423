"""The quality report: each fault of a recording is found where it is, and none where there is none."""

import types

import numpy as np
import pytest
from sessions import burst, curl, session_section, write_session

from myowave.data.checks import clocks, emg, motion
from myowave.data.checks.finding import report
from myowave.data.importing import import_trials
from myowave.data.processing.sampled import Sampled
from myowave.data.recording import RawTrial
from myowave.settings import RecordedDataset

RATE = 1000.0
TIME = np.arange(0, 12, 1 / RATE)


def channel(values, rate=RATE):
    return Sampled(np.asarray(values, dtype=float), rate, 0.0, "uV")


def recorded(scale=0.3, seed=1):
    """EMG as a recorder writes it, in steps of its resolution."""
    return np.round(burst(seed) / scale) * scale


def drop(values, start, length, fill):
    spoiled = values.copy()
    spoiled[start : start + length] = fill
    return spoiled


CHECKS = {check.name: check for check in (emg.DEAD_CHANNEL, *emg.CHECKS, *emg.RAW_CHECKS, *motion.ELBOW)}


def found(check, values, **about):
    """What a check of a channel finds."""
    sampled = channel(values)
    about = {"envelope": sampled, "typical": 20.0, **about}
    return [finding.found for finding in CHECKS[check].of(emg.Channel(sampled, **about))]


FAULTS = {
    "constant": (np.full(len(TIME), 3.0), "dead channel"),
    "hardly any": (0.001 * recorded(), "dead channel"),
    "as in another unit": (1000 * recorded(), "EMG of another size"),
    "a spike": (drop(recorded(), 5000, 1, 1e5), "spike"),
    "a small range": (np.clip(recorded(), -40, 40), "clipping"),
    "a range small on one side": (np.minimum(recorded(), 40), "clipping"),
    "hum of 50 Hz": (recorded() + 15 * np.sin(2 * np.pi * 50 * TIME), "mains hum"),
    "hum of 60 Hz": (recorded() + 15 * np.sin(2 * np.pi * 60 * TIME), "mains hum"),
    "a swinging cable": (recorded() + 25 * np.sin(2 * np.pi * 3 * TIME), "power below 20 Hz"),
    "rectified": (np.abs(recorded()), "not raw EMG"),
    "an envelope": (np.maximum(np.sin(2 * np.pi * TIME / 4), 0.0) - 0.5, "not raw EMG"),
    "one value held": (drop(recorded(), 5000, 80, recorded()[5000]), "gap"),
    "zeros instead": (drop(recorded(), 5000, 80, 0.0), "gap"),
    "a block again": (drop(recorded(), 5000, 60, recorded()[4940:5000]), "repeated block"),
    "a block again much later": (drop(recorded(), 9000, 100, recorded()[1000:1100]), "repeated block"),
}


OF_RAW = [check.name for check in (emg.DEAD_CHANNEL, *emg.CHECKS, *emg.RAW_CHECKS)]


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_a_channel_is_found(fault):
    values, check = FAULTS[fault]
    assert found(check, values) and CHECKS[check].do.endswith(".")


@pytest.mark.parametrize("check", OF_RAW)
@pytest.mark.parametrize("seed", range(4))
def test_a_good_channel_raises_no_doubt(check, seed):
    envelope = channel(1 + 0.9 * np.sin(TIME))
    assert found(check, recorded(seed=seed), envelope=envelope) == []


def test_where_a_copy_or_gap_begins_is_told_in_seconds():
    assert "at 5.00 s" in found("repeated block", FAULTS["a block again"][0])[0]
    assert "at 5.00 s" in found("gap", FAULTS["zeros instead"][0])[0]
    assert "at 5.00 s" in found("spike", FAULTS["a spike"][0])[0]


def test_a_line_that_the_processing_takes_out_is_no_doubt():
    hum = FAULTS["hum of 50 Hz"][0]
    assert found("mains hum", hum, notch_hz=50.0) == [] != found("mains hum", hum, notch_hz=60.0)


def test_an_envelope_that_hardly_changes_shows_no_contraction():
    assert found("no contraction", recorded(), envelope=channel(1 + 0.05 * np.sin(TIME)))


@pytest.mark.parametrize(("share", "found"), [(0.0, 0), (0.3, 0), (1.5, 1), (-1.5, 1)])
def test_channels_that_share_a_signal_are_suspected(share, found):
    one = burst(1)
    two = burst(2) + share * np.roll(one, 3)  # 3 ms later
    assert len(list(emg.CROSS_TALK.of({"emg_a": channel(one), "emg_b": channel(two)}))) == found


@pytest.mark.parametrize("rate", [30.0, 100.0, 200.0])
def test_an_angle_that_leaps_is_found_and_one_that_moves_is_not(rate):
    smooth = np.radians(curl(rate=rate, period=1.5))  # brisk
    angle = Sampled(smooth, rate, 0.0, "rad")
    assert list(motion.JUMP.of(angle)) == []
    leap = smooth + np.radians(40.0) * (np.arange(len(smooth)) > len(smooth) // 2)
    told = list(motion.JUMP.of(angle.with_values(leap)))
    assert len(told) == 1 and f"at {(len(smooth) // 2 + 1) / rate:.2f} s (1 such" in told[0].found
    spike = smooth + np.radians(40.0) * (np.arange(len(smooth)) == 50)
    assert len(list(motion.JUMP.of(angle.with_values(spike)))) == 1


@pytest.mark.parametrize(
    ("change", "check"),
    [
        (lambda deg: deg, None),
        (lambda deg: deg - 40, "range of the angle"),
        (lambda deg: -deg, "sign of the angle"),
        (lambda deg: 180 - deg, "range of the angle"),
        (lambda deg: 0.05 * deg, "little motion"),
    ],
)
def test_an_elbow_that_goes_where_none_goes_is_found(change, check):
    angle = Sampled(np.radians(change(curl())), 100.0, 0.0, "rad")
    assert [f.check for each in motion.ELBOW for f in each.of(angle)] == ([check] if check else [])


def trial_with(shift=0.1, stretch=1.0, seconds=24.0):
    """A trial in which the elbow follows an envelope by `shift` seconds, on an angle's clock that is `stretch` slow."""
    random = np.random.default_rng(5)
    knots = np.cumsum(random.uniform(0.8, 1.6, 40))
    heights = random.random(40)
    time = np.arange(0, seconds, 0.01)
    envelope = Sampled(np.interp(time, knots, heights), 100.0, 0.0, "uV")
    angle = Sampled(0.2 + 1.5 * np.interp(time * stretch - shift, knots, heights), 100.0, 0.0, "rad")
    return RawTrial({"emg_a": envelope}, angle, {}), {"emg_a": envelope}


@pytest.mark.parametrize(
    ("shift", "stretch", "checks"),
    [
        (0.1, 1.0, []),
        (0.5, 1.0, ["offset of clocks"]),
        (-0.3, 1.0, ["offset of clocks"]),
        (0.1, 1.02, ["drift of clocks"]),
    ],
)
def test_clocks_that_differ_are_told(shift, stretch, checks):
    raw, envelopes = trial_with(shift, stretch)
    told = [finding.check for finding in clocks.offset_and_drift({"1": raw}, {"1": envelopes})]
    assert set(checks) <= set(told) and (checks or not told)


def test_durations_that_differ_are_told():
    angle = Sampled(curl(), 100.0, 0.0, "rad")
    assert list(clocks.DURATIONS.of((channel(TIME), angle))) == []
    assert [finding.check for finding in clocks.DURATIONS.of((channel(TIME[:-100]), angle))] == ["durations"]


def test_a_session_reports_each_doubt_with_its_trial_and_channel(tmp_path):
    def change(trial, key, values):
        if (trial, key) == ("b", "triceps"):
            return values + 20 * np.sin(2 * np.pi * 50 * TIME)
        return values + 60.0 * (np.arange(len(values)) > 600) if (trial, key) == ("a", "angle") else values

    write_session(tmp_path, change=change)
    _, quality = import_trials("me", RecordedDataset(**session_section()), tmp_path)
    warnings = {(f["trial"], f["signal"], f["check"]) for f in quality["findings"] if f["severity"] == "warning"}
    assert warnings >= {("b", "emg_triceps", "mains hum"), ("a", "angle", "jump of the angle")}
    assert {trial for trial, _, _ in warnings} <= {"a", "b", ""}
    assert all(f["do"] for f in quality["findings"])
    assert "mains hum" in quality["summary"]


def test_a_report_without_findings_says_so():
    assert report("me", [], {})["summary"] == "no warnings"


def test_a_change_as_large_as_what_is_let_pass_is_let_pass(monkeypatch):
    """Times are on a grid, so one of 0.2 s is as likely as one of 0.18 s, and rounding must not decide."""
    for ahead_s, told in ((0.10, False), (0.12, True)):
        first, last = (np.exp(-(((clocks._LAGS_S - at) / 0.05) ** 2)) for at in (ahead_s, -0.10))
        monkeypatch.setattr(clocks, "_explained", lambda *_, parts=(first, first, last): np.stack(parts))
        raw = types.SimpleNamespace(angle=None)
        checks = [finding.check for finding in clocks.offset_and_drift({"1": raw}, {"1": {"emg_biceps": None}})]
        assert ("drift of clocks" in checks) == told
