"""The quality report: each fault of a recording is found where it is, and none where there is none."""

import re
import types
from contextlib import chdir
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import savgol_filter
from sessions import burst, curl, session_section, write_session

from myowave.data.checks import cause, emg, motion
from myowave.data.checks.finding import Finding, report
from myowave.data.importing import _emg_problems, import_trials
from myowave.data.processing.sampled import Sampled
from myowave.data.recording import RawTrial
from myowave.data.trials import Trials
from myowave.settings import Processing, RecordedDataset, read_settings

ROOT = Path(__file__).parents[2]
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


OF_RAW = (emg.DEAD_CHANNEL, *emg.LIVE_CHECKS, *emg.RAW_CHECKS)


def found(name, values, **about):
    """What a check of a channel finds."""
    sampled = channel(values)
    about = {"envelope": sampled, "typical": 20.0, "resting": 1.0, "typical_peak": 20.0, "notch_hz": None, **about}
    what = emg.Channel(sampled, largest=1.0, angle=sampled, **about)
    return [finding.found for check in OF_RAW if check.name == name for finding in check.of(what)]


@pytest.mark.parametrize("check", [check.name for check in OF_RAW])
@pytest.mark.parametrize("seed", range(4))
def test_a_good_channel_raises_no_doubt(check, seed):
    envelope = channel(1 + 0.9 * np.sin(TIME))
    assert found(check, recorded(seed=seed), envelope=envelope) == []


def test_a_block_that_is_there_again_much_later_is_found():
    assert "at 9.00 s" in found("repeated block", drop(recorded(), 9000, 100, recorded()[1000:1100]))[0]


def test_a_line_that_the_processing_takes_out_is_no_doubt():
    hum = recorded() + 15 * np.sin(2 * np.pi * 50 * TIME)
    assert found("mains hum", hum, notch_hz=50.0) == [] != found("mains hum", hum, notch_hz=60.0)


def test_an_envelope_that_hardly_changes_shows_no_contraction():
    assert found("no contraction", recorded(), envelope=channel(1 + 0.05 * np.sin(TIME)))


def test_a_contraction_that_is_held_all_the_time_is_no_rest():
    held = channel(1 + 0.05 * np.sin(TIME))
    assert found("no contraction", recorded(), envelope=held, resting=0.2) == []


@pytest.mark.parametrize(("share", "found"), [(0.0, 0), (0.3, 0), (1.5, 1), (-1.5, 1)])
def test_channels_that_share_a_signal_are_suspected(share, found):
    one = burst(1)
    two = burst(2) + share * np.roll(one, 3)  # 3 ms later
    assert len(list(emg.CROSS_TALK.of({"emg_a": channel(one), "emg_b": channel(two)}))) == found
    slow = {"emg_a": channel(one[::25], RATE / 25), "emg_b": channel(two[::25], RATE / 25)}
    assert not list(emg.CROSS_TALK.of(slow)), "too slow for the band in which channels are compared"


@pytest.mark.parametrize("rate", [30.0, 100.0, 200.0])
def test_an_angle_that_leaps_is_found_and_one_that_moves_is_not(rate):
    smooth = np.radians(curl(rate=rate, period=1.5))  # brisk
    angle = Sampled(smooth, rate, 0.0, "rad")
    assert list(motion.JUMP.of(angle)) == []
    leap = smooth + np.radians(40.0) * (np.arange(len(smooth)) > len(smooth) // 2)
    told = list(motion.JUMP.of(replace(angle, values=leap)))
    assert len(told) == 1 and f"at {(len(smooth) // 2 + 1) / rate:.2f} s (1 such" in told[0].found
    spike = smooth + np.radians(40.0) * (np.arange(len(smooth)) == 50)
    assert len(list(motion.JUMP.of(replace(angle, values=spike)))) == 1


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


def trial_with(shift=0.1, seconds=24.0):
    """A trial in which the elbow follows an envelope by `shift` seconds."""
    random = np.random.default_rng(5)
    knots = np.cumsum(random.uniform(0.8, 1.6, 40))
    heights = random.random(40)
    time = np.arange(0, seconds, 0.01)
    envelope = Sampled(np.interp(time, knots, heights), 100.0, 0.0, "uV")
    angle = Sampled(0.2 + 1.5 * np.interp(time - shift, knots, heights), 100.0, 0.0, "rad")
    return session_of({"1": (envelope, angle)})


def session_of(signals, **loads):
    """Trials of an envelope and an angle each, with the load of some."""
    recordings = {
        name: types.SimpleNamespace(raw=RawTrial({"emg_a": envelope}, angle), envelopes={"emg_a": envelope})
        for name, (envelope, angle) in signals.items()
    }
    trials = types.SimpleNamespace(conditions={name: {"load": load} for name, load in loads.items()})
    return types.SimpleNamespace(recordings=recordings, trials=trials)


def told_of_clocks(of):
    return [finding.check for check in cause.CAUSE if check.name == "synchronisation" for finding in check.of(of)]


@pytest.mark.parametrize(("shift", "checks"), [(0.1, []), (0.5, ["synchronisation"]), (-0.3, ["synchronisation"])])
def test_clocks_that_differ_are_told(shift, checks):
    assert told_of_clocks(cause.Cause(trial_with(shift), {})) == checks


@pytest.mark.parametrize(("late", "checks"), [(0.0, []), (0.4, ["synchronisation"])])
def test_clocks_that_differ_are_told_where_most_emg_is_for_loads(late, checks):
    signals, loads = {}, {"a": 0.0, "b": 1.5, "c": 3.0}
    time = np.arange(0, 12, 0.01)
    for trial, (name, load) in enumerate(loads.items()):
        random = np.random.default_rng(trial)
        knots = np.cumsum(random.uniform(1.0, 2.5, 20))
        angle = savgol_filter(np.interp(time, knots, random.uniform(0.3, 2.0, 20)), 61, 3)
        needed = (1.5 * 0.19 + load * 0.35) * 9.81 * np.sin(angle)
        needed += (0.07 + load * 0.35**2) * np.gradient(np.gradient(angle, 0.01), 0.01)
        noise = 0.2 * savgol_filter(random.standard_normal(1200), 25, 2)
        emg = np.interp(time - late, time - 0.1, needed) * (1 + noise)
        signals[name] = Sampled(emg, 100.0, 0.0, "uV"), Sampled(angle, 100.0, 0.0, "rad")
    assert told_of_clocks(cause.Cause(session_of(signals, **loads), {})) == checks


def test_a_session_reports_each_doubt_with_its_trial_and_channel(tmp_path):
    def change(trial, key, values):
        if (trial, key) == ("b", "triceps"):
            return values + 20 * np.sin(2 * np.pi * 50 * TIME)
        return values + 60.0 * (np.arange(len(values)) > 600) if (trial, key) == ("a", "angle") else values

    write_session(tmp_path, change=change)
    with chdir(tmp_path):
        _, quality = import_trials("me", RecordedDataset(**session_section()))
    warnings = {(f["trial"], f["signal"], f["check"]) for f in quality["findings"] if f["severity"] == "warning"}
    assert warnings >= {("b", "emg_triceps", "mains hum"), ("a", "angle", "jump of the angle")}
    assert {trial for trial, _, _ in warnings} <= {"a", "b", ""}
    assert all(f["do"] for f in quality["findings"])
    assert "mains hum" in quality["summary"]


def test_a_report_without_findings_says_so():
    assert report("me", [], {})["summary"] == "no warnings"


def test_a_number_found_in_one_of_several_trials_is_not_said_of_all():
    found = [Finding("mains hum", f"{power} uV", "Move cables.", trial) for trial, power in (("a", 7), ("b", 9))]
    both, one = (report("me", some, {})["lines"][0] for some in (found, found[:1]))
    assert both["found"] == "in the first, 7 uV" and one["found"] == "7 uV"


@pytest.fixture(scope="module")
def curls():
    """What was recorded of the person that ships, prepared, and the sides of its channels."""
    with chdir(ROOT):
        settings = read_settings([Path("config.yaml")])
        prepared, _ = import_trials("human_curls", settings.dataset("human_curls"))
    return prepared, settings.physics_of("human_curls").sides


@pytest.mark.parametrize("flexor", ["emg_biceps", "emg_brachioradialis"])
def test_a_trial_of_a_person_with_swapped_channels_or_the_angle_turned_is_found_and_no_other(curls, flexor):
    """Weak contractions of a trial are no reason: what the channels have to do with angle and speed tells, too."""
    prepared, sides = curls

    def told(*names, turned=None):
        recordings = dict(prepared.recordings)
        for name in names:
            emg = recordings[name].emg
            swapped = {flexor: emg["emg_triceps"], "emg_triceps": emg[flexor]}
            recordings[name] = replace(recordings[name], emg={**emg, **swapped})
        if turned:
            recordings[turned] = replace(recordings[turned], angle=np.pi - recordings[turned].angle)
        found = [f.found for f in cause.CAUSE[-1].of(cause.Cause(replace(prepared, recordings=recordings), sides))]
        return re.findall(f"{flexor} and emg_triceps goes .*? in trial (.*?) and no other", "".join(found))

    assert told() == []
    for some in (*combinations(prepared.recordings, 1), *combinations(prepared.recordings, 2)):
        assert told(*some) == [", ".join(some)]
    for name in prepared.recordings:
        assert told(turned=name) == [name]


def lifted(tilt, seed):
    """A forearm that muscles on one side or the other hold against its weight and move, the upper arm at a lean."""
    random, time = np.random.default_rng(seed), np.arange(2000) / 100
    turns = zip((0.5, 0.2, 0.1), random.uniform(0.25, 0.6, 3), random.uniform(0, 6, 3), strict=True)
    angle = 1 + sum(size * np.sin(2 * np.pi * rate * time + phase) for size, rate, phase in turns)
    needed = 0.06 * np.gradient(np.gradient(angle, 0.01), 0.01) + 3.4 * np.sin(angle + tilt)
    sides = (
        np.clip(side * np.roll(needed, -8), 0, None) / 12 + 0.01 * random.standard_normal(2000) for side in (1, -1)
    )
    return types.SimpleNamespace(
        emg=dict(zip(("emg_flexor", "emg_extensor"), sides, strict=True)), angle=angle, dt=0.01
    )


@pytest.mark.parametrize(("known", "told"), [(True, 0), (False, 1)])
def test_a_trial_with_the_arm_overhead_is_no_swap_where_its_lean_is_known(known, told):
    tilts = {"a": 0.0, "b": 0.0, "c": 0.0, "d": np.pi}
    recordings = {name: lifted(tilt, seed) for seed, (name, tilt) in enumerate(tilts.items())}
    trials = Trials.from_sequences(
        dataset="arm",
        names=tuple(tilts),
        channels=("emg_flexor", "emg_extensor"),
        dt=0.01,
        emg=[np.stack([*one.emg.values()], -1) for one in recordings.values()],
        angle=[one.angle for one in recordings.values()],
        conditions={"d": {"tilt": np.pi}} if known else {},
    )
    prepared = types.SimpleNamespace(trials=trials, recordings=recordings)
    found = cause.CAUSE[-1].of(cause.Cause(prepared, {"emg_flexor": 1.0, "emg_extensor": -1.0}))
    assert ["in trial d and no other" in one.found for one in found] == [True] * told


def test_what_goes_below_0_is_no_envelope():
    """Of any trial, be the first one an envelope; a filter's undershoot is none of it."""
    swing = 1 + 0.9 * np.sin(TIME)
    trials = {"a": swing, "b": burst(1), "c": burst(2), "d": swing - 0.15}
    raw = {name: {"emg_x": channel(values)} for name, values in trials.items()}
    told = list(_emg_problems(raw, {"emg_x": "envelope"}, Processing()))
    assert len(told) == 1 and re.search(
        "emg_x: form is envelope, .* 50 % of the samples of trial b, c are.*raw", told[0]
    )
    assert not list(_emg_problems(raw, {"emg_x": "raw"}, Processing()))
