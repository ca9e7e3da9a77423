"""Recordings that are wrong: a session in memory, tidy files, and files of each format, each with one fault."""

import os
from collections.abc import Callable
from contextlib import chdir
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.io import savemat

from myowave.data.checks.finding import report
from myowave.data.checks.session import find_faults
from myowave.data.checks.signals import RAW, signal_problem
from myowave.data.files import all_files
from myowave.data.importing import import_trials, prepare
from myowave.data.processing.sampled import Sampled
from myowave.data.readers import read_raw
from myowave.data.recording import RawTrial, Session
from myowave.data.trials import TORQUE
from myowave.settings import MeasuredDataset, RecordedDataset

EMG_HZ, ANGLE_HZ, SECONDS = 1000.0, 100.0, 10.0
SIDES = {"emg_biceps": 1, "emg_triceps": -1, "emg_brachioradialis": 1}
CHANNELS = ("emg_biceps", "emg_triceps")
Signals = dict[str, np.ndarray]

# ------------------------------------------------------------------------------------------- a session in memory


@cache
def _good(first: int = 0) -> dict[str, Signals]:
    """Three trials of a forearm that two muscles move: raw EMG [uV], elbow and lean [deg]; others by a number."""
    trials = {}
    time = np.arange(0, SECONDS, 1 / EMG_HZ)
    for seed, name in enumerate("abc"):
        random = np.random.default_rng(first + seed)
        knots = np.arange(-1, SECONDS + 2, 0.7)
        drive = [np.interp(time, knots, random.uniform(0.05, 1.0, len(knots))) for _ in range(2)]
        for each in drive:  # every trial has a full contraction of each muscle
            each *= 1 / each.max()
        q, speed, angle = 0.5, 0.0, []
        late = [np.concatenate([np.full(80, d[0]), d[:-80]]) for d in drive]
        for flexor, extensor in zip(*late, strict=True):
            speed += (3 + 15 * flexor - 4 * extensor - 22 * np.sin(q) - 6 * speed) / EMG_HZ
            q += speed / EMG_HZ
            angle.append(q)
        emg = [np.round(60 * d * random.standard_normal(len(d)) / 0.3) * 0.3 for d in drive]
        elbow = np.degrees(angle)[:: round(EMG_HZ / ANGLE_HZ)]
        trials[name] = {"emg_biceps": emg[0], "emg_triceps": emg[1], "angle": elbow, "tilt_rad": 5 + 0 * elbow + seed}
    return trials


def in_memory(
    spoil: Callable[[dict[str, Signals]], object], form: str = "raw", unit: str = "uV", first: int = 0, **settings
) -> str:
    """What an import says of the session with a fault."""
    trials = {name: {key: values.copy() for key, values in trial.items()} for name, trial in _good(first).items()}
    spoil(trials)
    raw, mvc = {}, {}
    for name, trial in trials.items():
        emg = {c: Sampled(values, EMG_HZ, 0.0, unit) for c, values in trial.items() if c in SIDES}
        if name in settings.get("mvc", ()):
            mvc[name] = emg
            continue
        angles = {k: Sampled(np.radians(trial[k]), ANGLE_HZ, 0.0, "rad", "deg") for k in ("angle", "tilt_rad")}
        signals = {"tilt_rad": angles["tilt_rad"]}
        if "torque" in trial:
            signals[TORQUE] = Sampled(trial["torque"], ANGLE_HZ, 0.0, "Nm")
        raw[name] = RawTrial(emg, angles["angle"], signals, cut=settings.get("cut_s", {}).get(name))
    section = RecordedDataset(
        kind="recorded",
        trials=list("abc"),
        test=["c"],
        emg={c: {"file": "{trial}", "form": form} for c in emg},
        angle={"file": "x"},
        signals={"tilt_rad": {"file": "x", "condition": "tilt"}},
        **settings,
    )
    prepared = prepare("me", section, Session(raw, dict.fromkeys(emg, form), mvc))
    found = report("me", list(find_faults(prepared, section, SIDES)), prepared.gains)
    return "\n".join(f"{f['trial']} {f['signal']} {f['check']}: {f['found']}. {f['do']}" for f in found["findings"])


def scaled(factor: float, key: str | None = None, trial: str | None = None):
    """EMG, or one signal, of all trials or one, times a factor."""

    def spoil(trials):
        for name in trial or "abc":
            for each in (key,) if key else CHANNELS:
                trials[name][each] *= factor

    return spoil


def put(values, key="emg_biceps", trial="a", start=5000):
    """Values in place of others, from a sample on."""

    def spoil(trials):
        new = values(trials[trial][key]) if callable(values) else values
        trials[trial][key][start : start + np.size(new)] = new

    return spoil


def torque(values):
    def spoil(trials):
        trials["a"]["torque"] = values(np.radians(trials["a"]["angle"])) if callable(values) else values

    return spoil


def lifting(q):
    """Torque [N m] that lifts a forearm of 0.1 kg m2 and speeds it up."""
    return 0.1 * (np.gradient(np.gradient(q)) * ANGLE_HZ**2 + 22 * np.sin(q))


def made(change, key="angle", trials="abc"):
    """A signal of all trials made anew from itself."""

    def spoil(all_trials):
        for name in trials:
            all_trials[name][key] = change(all_trials[name][key])

    return spoil


def copied(key, to, of="a"):
    def spoil(trials):
        for name in to:
            trials[name][key] = trials[of][key].copy()

    return spoil


def overlapping(trials):
    """The last second of a trial is the first of the next."""
    for key, values in trials["b"].items():
        second = len(values) // 10
        values[:second] = trials["a"][key][-second:]


def a_part(trials):
    trials["b"] = {key: values[len(values) // 3 :].copy() for key, values in trials["a"].items()}


def swapped(trials, names="abc"):
    for name in names:
        one = trials[name]
        one["emg_biceps"], one["emg_triceps"] = one["emg_triceps"], one["emg_biceps"]


def swapped_in_the_longest(trials):
    for name in "ac":
        trials[name] = {key: values[: len(values) // 6] for key, values in trials[name].items()}
    swapped(trials, "b")


def beside_a_third(trials):
    """Biceps and triceps swapped; the brachioradialis is another flexor, and in its place."""
    for seed, one in enumerate(trials.values()):
        louder = 1 + 0.3 * np.random.default_rng(100 + seed).standard_normal(len(one["emg_biceps"]))
        one["emg_brachioradialis"] = one["emg_biceps"] * louder
    swapped(trials)


def both(sign=1.0, trials="abc"):
    def spoil(all_trials):
        for name in trials:
            all_trials[name]["emg_triceps"] = sign * all_trials[name]["emg_biceps"]

    return spoil


def smooth(values):
    return np.convolve(np.abs(values), np.ones(200) / 200, "same") + 0.1


def as_envelopes(then=lambda trials: None):
    def spoil(trials):
        for trial in trials.values():
            for channel in CHANNELS:
                trial[channel] = smooth(trial[channel])
        then(trials)

    return spoil


def tone(hz, size):
    return size * np.sin(2 * np.pi * hz * np.arange(0, SECONDS, 1 / EMG_HZ))


def noisy(angle, size=0.5):
    """With white noise [deg], as of a simple goniometer."""
    return angle + size * np.random.default_rng(7).standard_normal(len(angle))


def stepped(size):
    return lambda angle: angle + size * (np.arange(len(angle)) > 500)


def artefacts(trials):
    """Some in the second half of a trial."""
    for fault in (put(6e4), put(np.zeros(90), start=6000), put(0.0, "angle", start=700)):
        fault(trials)


TOLD_IN_MEMORY = {
    "uV called V": (scaled(1e6), r"unit of the EMG: .*emg_biceps reaches .* uV.*uV that is called V or mV"),
    "uV called mV": (scaled(1e3), "unit of the EMG: .*Correct the channel's unit under emg"),
    "V called mV": (scaled(1e-3), "unit of the EMG: .*surface EMG from 3 to 10000 uV"),
    "V called uV": (scaled(1e-6), "unit of the EMG"),
    "the biceps in mV": (scaled(1e-3, "emg_biceps"), "unit of the EMG: the envelope of emg_biceps reaches"),
    "the triceps in nV": (scaled(1e3, "emg_triceps"), "unit of the EMG: the envelope of emg_triceps reaches"),
    "one trial in mV": (scaled(1e3, trial="a"), "a emg_biceps EMG of another size: .*in another unit"),
    "one trial in V": (scaled(1e-6, trial="b"), "b emg_triceps dead channel"),
    "one channel of one trial in mV": (scaled(1e3, "emg_triceps", "a"), "a emg_triceps EMG of another size"),
    "a spike": (put(6e4), "a emg_biceps spike: reaches 6e.04 uV at 5.00 s.*cut_s"),
    "a spike downwards": (put(-6e4), "a emg_biceps spike"),
    "a spike at the start": (put(6e4, start=0), "spike: .* at 0.00 s"),
    "a spike at the end": (put(6e4, start=9999), "spike: .* at 10.00 s"),
    "a spike in a test trial": (put(6e4, trial="c"), "c emg_biceps spike"),
    "a spike of three samples": (put(np.array([3e4, 6e4, 3e4])), "spike"),
    "a burst of 100 ms": (
        put(3e3 * np.random.default_rng(1).standard_normal(100)),
        "a emg_biceps spike: its envelope reaches .* at 5.0. s, and usually .*cut_s",
    ),
    "two spikes": (put(np.array([6e4, *[0.0] * 4, 6e4])), "spike"),
    "a channel that is 0 in a trial": (put(np.zeros(10000), start=0), "a emg_biceps dead channel: .*leave the trial"),
    "a channel that is constant in a trial": (put(np.full(10000, 7.0), start=0), "a emg_biceps dead channel"),
    "a channel that is nearly constant": (scaled(1e-3, "emg_biceps", "a"), "a emg_biceps dead channel"),
    "both channels alike": (both(), "cross-talk: emg_biceps and emg_triceps have a correlation of 1.00"),
    "both channels alike in one trial": (both(trials="b"), "b  cross-talk"),
    "one channel the mirror of the other": (both(-1.0), "cross-talk: .* correlation of -1.00"),
    "one channel a part of the other": (both(0.3), "cross-talk"),
    "the same EMG in two trials": (copied("emg_biceps", "b"), "b emg_biceps same recording again: .* in trial a"),
    "the same EMG in all trials": (copied("emg_triceps", "bc"), "c emg_triceps same recording again"),
    "the same angle in two trials": (copied("angle", "b"), "b angle same recording again: .*file or column"),
    "the same angle in training and test": (copied("angle", "c", "b"), "c angle same recording again: .* trial b"),
    "the same angle in all trials": (copied("angle", "bc"), "c angle same recording again"),
    "trials that overlap by a second": (overlapping, "b emg_biceps same recording again: .* in trial a.*overlap"),
    "a trial that is a part of another": (a_part, "b angle same recording again: the same samples as in trial a"),
    "an angle that is negated": (made(np.negative), "a angle sign of the angle: goes from .*set sign: -1"),
    "an angle that is negated in one trial": (made(np.negative, trials="b"), "b angle sign of the angle"),
    "an angle that is negated, from 90 on": (made(lambda q: 110 - q), "EMG against the motion: .*sign: -1"),
    "180 for the straight arm": (made(lambda q: 180 - q), "EMG against the motion: .*sign: -1 and offset_deg: 180"),
    "180 for the straight arm, little motion": (
        made(lambda q: 180 - np.clip(q, 28, 77)),
        "never straight: from 1.. to 15. deg.*Is this 180 minus the angle",
    ),
    "an angle in tenths": (made(lambda q: q / 10), "unit of the angle: no trial leaves .*in tenths"),
    "an angle in hundredths of a turn": (made(lambda q: q / 3.6), "unit of the angle"),
    "an angle with an offset": (made(lambda q: q - 25), "range of the angle: .*offset_deg"),
    "an angle beyond an elbow": (made(lambda q: q + 135), "range of the angle: .*an elbow from -15"),
    "an angle that hardly moves": (made(lambda q: 40 + 0.1 * q, trials="a"), "a angle little motion"),
    "a leap by half a turn": (made(stepped(-180.0), trials="a"), "jump of the angle: goes by -1[78].* half a turn"),
    "a leap": (made(stepped(30.0), trials="a"), "a angle jump of the angle: .* at 5.01 s .1 such"),
    "a leap in noise": (made(lambda q: stepped(30.0)(noisy(q)), trials="a"), "jump of the angle: .* at 5.01 s .1 such"),
    "a marker that was lost": (put(0.0, "angle", start=300), "a angle jump of the angle"),
    "channels swapped": (swapped, "EMG against the motion: .*channels swapped"),
    "channels swapped in one trial": (
        lambda trials: swapped(trials, "b"),
        "EMG against the motion: .* the wrong way round in trial b and no other",
    ),
    "channels swapped in one trial that is longer than the others": (
        swapped_in_the_longest,
        "EMG against the motion: .* the wrong way round in trial b and no other",
    ),
    "channels swapped beside a third that is right": (
        beside_a_third,
        "EMG against the motion: EMG of emg_biceps and emg_triceps",
    ),
    "a torque of extension": (
        torque(lambda q: -lifting(q)),
        "torque against the motion: the torque falls .* in trial a",
    ),
    "a torque of a machine that turns the arm": (
        torque(lambda q: np.cumsum(np.random.default_rng(0).standard_normal(len(q))) / 10),
        "torque against the motion: weight and motion say little of the torque in trial a",
    ),
    "an arm over the head": (made(lambda t: t + 120, "tilt_rad"), "a tilt_rad tilt of the upper arm: .*unit"),
    "a lean in rad called deg": (
        made(lambda t: np.radians(t + 3 * np.sin(np.arange(len(t)) / 40)), "tilt_rad"),
        "c tilt_rad stillness of the upper arm: from .* to .* deg, while the elbow .*Is it in rad",
    ),
    "a lean that leaps": (made(stepped(30.0), "tilt_rad"), "a tilt_rad jump of the angle"),
    "clipping": (made(lambda x: np.clip(x, -40, 40), "emg_biceps"), "a emg_biceps clipping: stays at"),
    "clipping on one side": (made(lambda x: np.minimum(x, 40), "emg_biceps"), "a emg_biceps clipping"),
    "hum of 50 Hz": (made(lambda x: x + tone(50, 30), "emg_biceps"), "mains hum: a line at 50 Hz.*notch_hz"),
    "hum of 60 Hz": (made(lambda x: x + tone(60, 30), "emg_triceps"), "mains hum: a line at 60 Hz"),
    "a swinging cable": (made(lambda x: x + tone(3, 25), "emg_biceps"), "power below 20 Hz: .*Cables"),
    "rectified": (made(np.abs, "emg_biceps"), "not raw EMG: never below 0.*form: envelope"),
    "smoothed": (made(lambda x: smooth(x) - 20, "emg_biceps"), "not raw EMG: only"),
    "a gap of zeros": (put(np.zeros(90)), "a emg_biceps gap: does not change for .* at 5.00 s"),
    "a gap of one value": (put(np.full(90, 12.0)), "gap"),
    "a gap filled with a copy": (put(lambda x: x[4900:4960]), "repeated block: .* at 5.00 s"),
    "noise only": (
        made(lambda x: np.random.default_rng(9).standard_normal(len(x)), "emg_biceps", "b"),
        "b emg_biceps (no contraction|dead channel)",
    ),
    "a held-out trial of more effort": (scaled(3, trial="c"), "c emg_biceps EMG above 1: reaches .*of less effort"),
    "EMG that ends early": (made(lambda x: x[:9800], "emg_biceps"), "durations: EMG lasts 9.800 s.*rate_hz"),
    "EMG of another clock": (made(lambda x: np.roll(x, -500), "emg_biceps"), "synchronisation|against the motion"),
}  # fmt: skip
TOLD_OF_ENVELOPES = {
    "both channels alike": (as_envelopes(both()), "channels alike: .* correlation of 1.000 over all trials"),
    "one channel a thousand times the other": (
        as_envelopes(scaled(1e3, "emg_biceps")),
        "unit of the EMG: the largest envelopes are .*one channel in another unit",
    ),
    "the same in all trials": (as_envelopes(copied("emg_biceps", "bc")), "c emg_biceps same recording again"),
    "a spike": (as_envelopes(put(6e4)), "a emg_biceps spike"),
    "a trial in another unit": (as_envelopes(scaled(1e3, trial="a")), "a emg_triceps EMG of another size"),
    "channels swapped": (as_envelopes(swapped), "EMG against the motion"),
    "rectified and no more": (
        as_envelopes(made(lambda x: x * np.abs(np.random.default_rng(3).standard_normal(len(x))), "emg_biceps")),
        "a emg_biceps not smoothed: .* above 20 Hz.*form: raw and processing.band_pass_hz: null",
    ),
}  # fmt: skip


def of_maxima(spoil: Callable[[dict[str, Signals]], object], times: float = 4.0) -> str:
    """What an import says of the session with a maximum contraction, so many times that of the trials, with a fault."""
    held = times * (0.02 + (np.arange(0, SECONDS, 1 / EMG_HZ) % 5 > 2.5))

    def spoil_all(trials):
        random = np.random.default_rng(8)
        trials["max"] = {c: np.round(60 * held * random.standard_normal(len(held)) / 0.3) * 0.3 for c in CHANNELS}
        spoil(trials)

    return in_memory(spoil_all, mvc=["max"])


TOLD_OF_MAXIMA = {
    "an artefact of 30 ms": (
        put(2e4 * np.random.default_rng(1).standard_normal(30), trial="max"),
        "max emg_biceps spike: its envelope reaches .* at 5.0. s, and usually .* at most. .*cut it off with cut_s",
    ),
    "a spike": (put(6e4, trial="max"), "max emg_biceps spike: reaches 6e.04 uV at 5.00 s"),
    "clipping": (made(lambda x: np.clip(x, -80, 80), "emg_biceps", ["max"]), "max emg_biceps clipping: stays at"),
    "hum of 50 Hz": (made(lambda x: x + tone(50, 90), "emg_triceps", ["max"]), "max emg_triceps mains hum"),
    "a gap": (put(np.zeros(90), trial="max"), "max emg_biceps gap: does not change for .* at 5.00 s"),
    "a channel that is 0": (made(lambda x: 0 * x, "emg_biceps", ["max"]), "emg_biceps: the EMG never rises"),
    "in V called uV": (made(lambda x: 1e6 * x, "emg_biceps", ["max"]), "max emg_biceps EMG of another size"),
}  # fmt: skip
TOLD_OF_SETTINGS = {
    "FILL IN left at 0 kg": (
        {"conditions": {name: {"load": 0.0} for name in "abc"}},
        "load: said to be 0 kg in each of the 3 trials. Was the hand empty.*under conditions",
    ),
    "an offset of clocks that there is not": (
        {"processing": {"emg_start_offset_s": -0.5}},
        "synchronisation: EMG fits the motion best .*emg_start_offset_s",
    ),
}


REFUSED_IN_MEMORY = {
    "a channel that is 0 in all trials": (made(lambda x: 0 * x, "emg_biceps"), "emg_biceps: the EMG never rises"),
    "a channel that is constant in all": (made(lambda x: 0 * x + 7, "emg_biceps"), "emg_biceps: the EMG never rises"),
    "an angle that never moves": (made(lambda q: 0 * q + 30, trials="a"), "trial a: the angle stays at 30 deg"),
    "an angle in rad called deg": (made(np.radians), "trial a: the angle goes .*If it was written in rad"),
    "an angle in deg called rad": (made(np.degrees), "trial a, .* expected -180 to 180"),
    "an angle in tenths of a degree": (made(lambda q: 10 * q), "trial a, .* expected -180 to 180. Correct its unit"),
    "a leap by a turn": (made(stepped(360.0), trials="b"), r"trial b, at \d\.\d\d s: the angle is"),
    "180 for the straight arm, beyond it": (made(lambda q: 190 - q), "straight arm, sign: -1 and offset_deg: 180"),
    "a lean of 573 deg": (made(lambda t: t * 0 + 573, "tilt_rad"), "trial a, .*: tilt_rad is 573 deg .*-180 to 180"),
    "the same trial twice": (
        lambda trials: trials.update(b={key: values.copy() for key, values in trials["a"].items()}),
        "trial b: the same samples as trial a",
    ),
    "a torque in N mm": (torque(np.linspace(0, 9000, 1000)), "trial a, .* the torque is .*Correct its unit"),
    "a torque that never changes": (torque(np.ones(1000)), "trial a: the torque stays at 1 N m"),
    "EMG and angle that never meet": (made(lambda q: q[:20]), "trial a: 20 samples at which all .*record longer"),
}  # fmt: skip
REFUSED_OF_SETTINGS = {
    "a band that the EMG is too slow for": (
        {"processing": {"band_pass_hz": [600, 700]}},
        "emg_biceps: sampled at 1000 Hz; expected more than 1333 .*form: envelope",
    ),
}

# --------------------------------------------------------------------------------------------------- tidy files


def tidy(seed: int) -> pd.DataFrame:
    trial = _good()["abc"[seed]]
    envelopes = {c: smooth(trial[c])[::10] for c in CHANNELS}
    emg = {c: e / e.max() for c, e in envelopes.items()}
    return pd.DataFrame({"time_s": np.round(np.arange(1000) / ANGLE_HZ, 6), **emg, "angle_deg": trial["angle"]})


def of_tidy_files(folder: Path, spoil, only: str = "", **settings) -> str:
    """What an import says of three tidy files, with a fault in all of them or in one."""
    for seed, name in enumerate(("trial1", "trial2", "trial3")):
        frame = tidy(seed)
        frame = spoil(frame) if only in ("", name) else frame
        if isinstance(frame, str | bytes):
            (folder / f"{name}.csv").write_bytes(frame if isinstance(frame, bytes) else frame.encode())
        else:
            frame.to_csv(folder / f"{name}.csv", index=False)
    block = MeasuredDataset(kind="measured", files=("trial*.csv",), test=("trial3",), **settings)
    with chdir(folder):
        _, quality = import_trials("elbow", block, channels={c: SIDES[c] for c in CHANNELS})
    return "\n".join(f"{f['trial']} {f['signal']} {f['check']}: {f['found']}. {f['do']}" for f in quality["findings"])


def times(factor, *columns):
    return lambda f: f.assign(**{c: factor * f[c] for c in columns or CHANNELS})


def cell(column, row, value):
    """A value in a cell; rows as an editor counts them."""

    def spoil(frame):
        frame[column] = frame[column].astype(object)
        frame.loc[row - 2, column] = value
        return frame

    return spoil


def drifting(frame):
    return frame[:300].assign(time_s=frame.time_s * (1 + 3e-5 * frame.index))


REFUSED_TIDY = {
    "percent": (times(100), r"emg_biceps reaches \S+ of .* If it is in percent, .*, or write \[%\] behind its column"),
    "one channel in percent": (times(100, "emg_triceps"), "emg_triceps reaches 100 .* in most of the 3 trials"),
    "EMG in uV": (times(480), "emg_biceps reaches 480 .* expected 0 to 1.5. Rectify and smooth"),
    "little EMG in uV": (times(60), "emg_biceps reaches 60 .* in percent, .* not normalised: Rectify and smooth"),
    "one column misnamed in all files": (
        lambda f: f.rename(columns={"emg_biceps": "emg_bicep"}),
        r"imported, 1 problem:\ntrial1.csv: column 'emg_biceps' is not there.* Likewise in 2 more: trial2.csv; trial3",
    ),
    "EMG above its maximum": (times(1.8), "emg_biceps reaches 1.8 .* in percent, .* not normalised"),
}  # fmt: skip
REFUSED_ONE_TIDY = {
    "percent in one file": (times(100), "trial2.csv, row .*: emg_biceps is 100 of a maximum .*percent by 100"),
    "missing column": (lambda f: f.drop(columns="emg_triceps"), "trial2.csv: column 'emg_triceps' is not there"),
    "missing time": (lambda f: f.drop(columns="time_s"), "trial2.csv, header: no column 'time_s' of times among emg"),
    "no angle": (lambda f: f.drop(columns="angle_deg"), "header: found no angle among .*; expected either angle_rad"),
    "two angles": (lambda f: f.assign(angle_rad=f.angle_deg), "found angle_rad and angle_deg; expected either"),
    "extra column": (lambda f: f.assign(force=1.0), "trial2.csv: column force is not used. .*under ignore_columns"),
    "rows that are numbered": (lambda f: f.assign(**{"": f.index}), "trial2.csv: column '' is not used"),
    "a name in capitals": (
        lambda f: f.rename(columns={"emg_biceps": "EMG_biceps"}),
        "'emg_biceps' is not there; did you mean 'EMG_biceps'",
    ),
    "extra muscle": (lambda f: f.assign(emg_brachialis=0.1), "column emg_brachialis is not used.*a muscle of its arm"),
    "misspelt": (lambda f: f.rename(columns={"emg_biceps": "emg_bicep"}), "is not there; .* mean 'emg_bicep'"),
    "German": (
        lambda f: f.set_axis(["Zeit", "Bizeps", "Trizeps", "Winkel"], axis=1),
        "header: found no angle among Bizeps, Trizeps, Winkel; expected",
    ),
    "NaN": (cell("angle_deg", 40, np.nan), "trial2.csv, row 40: angle_deg is '' .1 such rows.*finite number"),
    "a column that ends early": (
        lambda f: f.assign(angle_deg=f.angle_deg[:100]),
        "row 102: angle_deg is '' .900 such rows.* Cut the file there. .* another needs times of its own: time_angle",
    ),
    "text": (cell("emg_biceps", 17, "n/a"), "trial2.csv, row 17: emg_biceps is 'n/a'"),
    "infinity": (cell("emg_biceps", 17, "inf"), "trial2.csv, row 17: emg_biceps is 'inf'"),
    "minus infinity": (cell("angle_deg", 17, "-inf"), "trial2.csv, row 17: angle_deg is '-inf'"),
    "decimal comma in a cell": (cell("angle_deg", 9, "0,5"), "row 9: angle_deg is '0,5'.*with a point"),
    "NaN in the first time": (cell("time_s", 2, np.nan), "row 2: the time is no finite number"),
    "NaN in a time": (cell("time_s", 60, np.nan), "row 60: the time is no finite number .1 such rows"),
    "hours and minutes": (lambda f: f.assign(time_s="12:30:00"), "row 2: the time is no .*1000 such rows.*seconds as"),
    "NaN in the last time": (cell("time_s", 1001, np.nan), "row 1001: the time is no finite number"),
    "text in a time": (cell("time_s", 60, "n/a"), "row 60: the time is no finite number"),
    "infinite time": (cell("time_s", 60, "inf"), "row 60: the time is no finite number"),
    "a clock time": (cell("time_s", 60, "00:00:01"), "row 60: the time is no finite number"),
    "time goes back": (cell("time_s", 60, 0.1), r"row 60: time goes back from 0.57 to 0.1.*cut it at row 60"),
    "time stays": (cell("time_s", 60, 0.57), r"row 60: time stays at 0.57"),
    "missing sample": (lambda f: f.drop(index=30), r"row 32: time goes from 0.29 to 0.31, a step of 0.02 s"),
    "jitter": (lambda f: f.assign(time_s=f.time_s + 0.002 * (f.index % 7 == 3)), "row 5: time goes from 0.02 to 0.032"),
    "growing steps": (lambda f: f.assign(time_s=f.time_s * (1 + 4e-4 * f.index)), "a step of 0.01"),
    "drifting rate": (drifting, "more than half a step off even sampling .*: the rate drifts"),
    "deg as rad": (lambda f: f.rename(columns={"angle_deg": "angle_rad"}), "deg .*call the column angle_deg"),
    "rad as deg": (lambda f: f.assign(angle_deg=np.radians(f.angle_deg)), "call the column angle_rad"),
    "more than a turn": (lambda f: f.assign(angle_deg=400.0 + f.angle_deg), "-180 to 180"),
    "negative EMG": (cell("emg_triceps", 25, -0.2), "row 25: emg_triceps is -0.2 .*expected 0 to 1.5.*Rectify"),
    "EMG in uV in one file": (times(300, "emg_biceps"), "emg_biceps is .*divide it by its value"),
    "too short": (lambda f: f[:30], "trial2.csv: 30 samples in 0.3 s; expected at least 0.4 s"),
    "one sample": (lambda f: f[:1], "trial2.csv: 1 samples; expected at least"),
    "no samples": (lambda f: f[:0], "trial2.csv: 1 rows; expected names of columns in row 1 and samples below"),
    "other rate": (lambda f: f.assign(time_s=2 * f.time_s), "trial2.csv: sampled every 0.02 s; expected 0.01 s"),
    "time in milliseconds": (
        lambda f: f.assign(time_s=1000 * f.time_s),
        "trial2.csv: 0.1 Hz by its times; expected 10 to 2500. If its times are in ms",
    ),
    "time in minutes": (lambda f: f.assign(time_s=f.time_s / 60), "6000 Hz by its times.*minutes, convert them"),
    "over at once": (lambda f: f[:100].assign(time_s=f.time_s / 20), "100 samples in 0.05 s; expected at least 0.4 s"),
    "an angle that never moves": (
        lambda f: f.assign(angle_deg=28.65),
        "trial2.csv: the angle stays at 28.65 deg in all 1000 samples. The sensor was off",
    ),
    "the same trial again": (lambda f: tidy(0), "trial2.csv: the same samples as .*trial1.csv.*remove one"),
    "a torque in N mm": (lambda f: f.assign(torque_Nm=np.linspace(0, 9000, 1000)), "row .*: the torque is .*Correct"),
    "a torque that is 0": (lambda f: f.assign(torque_Nm=0.0), "trial2.csv: the torque stays at 0 N m"),
    "EMG in uV by its header": (
        lambda f: f.rename(columns={"emg_biceps": "emg_biceps [uV]"}),
        "trial2.csv: emg_biceps is in 'uV'; expected au, %",
    ),
    "empty": (lambda f: "", "trial2.csv: 0 rows; expected names of columns in row 1"),
    "blank": (lambda f: "\n\n", "trial2.csv: 2 rows; expected names of columns in row 1"),
    "no header": (lambda f: f.to_csv(index=False, header=False), "numbers already in row 1; expected a row with names"),
    "decimal commas": (
        lambda f: "time_s,emg_biceps,emg_triceps,angle_deg\n0,0,0,1,0,1,0,5\n",
        "4 names .*, but 8 columns .* need a point",
    ),
    "a column twice": (
        lambda f: "time_s,emg_biceps,emg_biceps,emg_triceps,angle_deg\n0,0,0,0,0\n",
        "column 'emg_biceps' is there 2 times",
    ),
    "a row cut off": (lambda f: f[:80].to_csv(index=False)[:-20], "trial2.csv.*(finite number|columns)"),
    "binary": (lambda f: b"\xff\xfe\x00time", "trial2.csv: this is not UTF-8 text"),
    "zero bytes": (lambda f: b"\x00" * 500, "trial2.csv: (this file is damaged|.*expected)"),
    "a picture": (lambda f: b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 4, "trial2.csv: .*(not UTF-8|damaged|expected)"),
    "times with too few digits": (
        lambda f: f.assign(time_s=1.7e9 + f.time_s.round(1)),
        "row 3: time stays at 1700000000 .899 such rows.*written with all digits",
    ),
    "a web page": (lambda f: "<!DOCTYPE html>\n<html>Sign in</html>\n", "header: no column .time_s. of times"),
}  # fmt: skip
TOLD_TIDY = {
    "EMG that is 0": (lambda f: f.assign(emg_biceps=0.0), "", "trial1 emg_biceps dead channel"),
    "EMG that is constant": (lambda f: f.assign(emg_biceps=0.4), "trial2", "trial2 emg_biceps dead channel"),
    "EMG of a thousandth": (times(1e-3, "emg_biceps"), "", "unit of the EMG: emg_biceps reaches 0.001"),
    "both channels alike": (lambda f: f.assign(emg_triceps=f.emg_biceps), "", "channels alike"),
    "the same EMG in all files": (lambda f: f.assign(emg_biceps=tidy(0).emg_biceps), "", "same recording again"),
    "the same angle in all files": (lambda f: f.assign(angle_deg=tidy(0).angle_deg), "", "trial3 angle same recording"),
    "channels swapped": (
        lambda f: f.rename(columns={"emg_biceps": "emg_triceps", "emg_triceps": "emg_biceps"}),
        "",
        "EMG against the motion",
    ),
    "channels swapped in one file": (
        lambda f: f.rename(columns={"emg_biceps": "emg_triceps", "emg_triceps": "emg_biceps"}),
        "trial2",
        "EMG against the motion: .* in trial trial2 and no other.*channels swapped",
    ),
    "an angle that is negated": (times(-1, "angle_deg"), "", "sign of the angle"),
    "180 for the straight arm": (lambda f: f.assign(angle_deg=180 - f.angle_deg), "", "against the motion: .*180 the"),
    "an angle in tenths": (times(0.1, "angle_deg"), "", "unit of the angle"),
    "a leap by half a turn": (
        lambda f: f.assign(angle_deg=f.angle_deg - 180.0 * (f.index > 500)),
        "trial2",
        "trial2 angle jump of the angle: .*half a turn",
    ),
    "a heavy trial held out": (times(2.0), "trial3", "trial3 emg_biceps EMG above 1: reaches 2.00"),
}  # fmt: skip


def _fifo(path: Path) -> None:
    os.mkfifo(path)


def _dated(path: Path) -> None:
    tidy(0).to_csv(path, index=False)
    os.utime(path, (4e9, 4e9))


def _huge(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(3_000_000_000)  # takes no room on the disk


FILES = {
    "a pipe": (_fifo, "odd.csv: this is a pipe or a device; expected a file"),
    "a link to a device": (lambda p: p.symlink_to("/dev/zero"), "odd.csv: this is a pipe or a device"),
    "a link to nothing": (lambda p: p.symlink_to("/nowhere/odd.csv"), "odd.csv: a link to /nowhere/odd.csv"),
    "a folder": (lambda p: p.mkdir(), r"odd.csv: no such file; looked for"),
    "a date in the future": (_dated, "odd.csv: its date is in the future .*touch .*odd.csv"),
    "3 GB": (_huge, "odd.csv: 3 GB; expected at most 1 GB. Split or thin it"),
    "nothing": (lambda p: None, "odd.csv: no such file; looked for .*The folder"),
}  # fmt: skip


def of_a_file(folder: Path, make: Callable[[Path], object]) -> str:
    """What is said of an odd file among the recordings."""
    make(folder / "odd.csv")
    with chdir(folder):
        for path in all_files("data.datasets.me.files", ["odd.csv"]):
            read_raw(path)
    return ""


# ---------------------------------------------------------------------------------------- files of other formats

RISE = np.arange(3000) / 1000


def edf(change: Callable[[dict[str, str]], object] = lambda h: None, cut: int = 0, magic: bytes = b"0       ") -> bytes:
    """Two channels of 1000 Hz, four records of 1 s."""
    head = {
        "records": "4",
        "seconds": "1",
        "kind": "",
        "low": "-500",
        "high": "500",
        "d_low": "-32768",
        "d_high": "32767",
    }
    head["samples"] = "1000"
    change(head)
    fixed = magic + b" " * 184 + head["kind"].ljust(44).encode() + head["records"].ljust(8).encode()
    fixed += head["seconds"].ljust(8).encode() + b"2   "
    fields = [("biceps", 16), ("", 80), ("uV", 8), (head["low"], 8), (head["high"], 8), (head["d_low"], 8)]
    fields += [(head["d_high"], 8), ("", 80), (head["samples"], 8), ("", 32)]
    signals = b"".join(text.ljust(width).encode() * 2 for text, width in fields)
    data = np.random.default_rng(0).integers(-9000, 9000, 8000).astype("<i2").tobytes()
    whole = fixed + signals + data
    return whole[: len(whole) - cut]


def noraxon(change=lambda rows: None, **head: str) -> bytes:
    about = {"time_units": "s", "begin": "0.0", "rate": "1000", "count": "3000", "unit": "uV", **head}
    rows = [f"{t:.5f},{np.sin(9 * t):.6f}" for t in RISE]
    change(rows)
    first = "type,name,time_units,begin_time,frequency,count,units"
    second = f'signal,"x","{about["time_units"]}",{about["begin"]},{about["rate"]},{about["count"]},"{about["unit"]}"'
    return "\n".join([first, second, "", "time,value", *rows, ""]).encode()


def row(n, text):
    def spoil(rows):
        rows[n] = text

    return spoil


def mot(change=lambda rows: None, head="inDegrees=yes\nendheader\ntime\tr_elbow_flex\n") -> bytes:
    rows = [f"{t:.3f}\t{30 + 9 * t:.4f}" for t in RISE]
    change(rows)
    return (head + "\n".join(rows) + "\n").encode()


def delsys(change=lambda rows: None) -> bytes:
    rows = [f"{t:.4f},{np.sin(9 * t):.6f}" for t in RISE]
    change(rows)
    return ("X [s],Avanti sensor 1: EMG 1 [uV]\n" + "\n".join(rows) + "\n").encode()


def vicon(change=lambda rows: None, rate="1000") -> bytes:
    rows = [f"{n + 1},0,{np.sin(9 * t):.6f}" for n, t in enumerate(RISE)]
    change(rows)
    head = ["Devices", rate, ",,EMG - Voltage", "Frame,Sub Frame,Voltage.BIC", ",,V"]
    return "\n".join([*head, *rows, ""]).encode()


def mat(folder: Path, **content) -> bytes:
    savemat(folder / "made.mat", content)
    return (folder / "made.mat").read_bytes()


def table(separator: str, columns, thousands: str | None = None) -> bytes:
    head = separator.join(columns)
    rows = zip(*columns.values(), strict=True)
    as_text = [[f"{x:,.0f}".replace(",", thousands) if thousands else f"{x:.6f}" for x in row] for row in rows]
    return "\n".join([head, *map(separator.join, as_text), ""]).encode()


def parquet(folder: Path, **columns) -> bytes:
    pd.DataFrame(columns).to_parquet(folder / "made.parquet")
    return (folder / "made.parquet").read_bytes()


def without(values, n, value=np.nan):
    values = np.array(values, dtype=float)
    values[n] = value
    return values


WAVE = np.sin(9 * RISE)
FORMATS = {
    "EDF cut by a record": (".edf", edf(cut=4000), "3 records of 1 s, but its header says 4; the file was cut short"),
    "EDF cut by three records": (".edf", edf(cut=12000), "1 records of 1 s, but its header says 4"),
    "EDF cut within a record": (".edf", edf(cut=777), "no whole number of records of 4000; the file was cut short"),
    "EDF without samples": (".edf", edf(cut=16000), "0 bytes of samples are no whole number"),
    "EDF with more records than it says": (".edf", edf(lambda h: h.update(records="2")), "its header says 2"),
    "EDF of an infinite range": (".edf", edf(lambda h: h.update(high="inf")), "ends of a range that are no finite"),
    "EDF of a range that is no number": (".edf", edf(lambda h: h.update(low="nan")), "no finite numbers"),
    "EDF of no range": (".edf", edf(lambda h: h.update(low="500")), "ends of a range that are equal"),
    "EDF of no digital range": (".edf", edf(lambda h: h.update(d_low="32767")), "ends of a range that are equal"),
    "EDF of records of no length": (".edf", edf(lambda h: h.update(seconds="0")), "records of no length"),
    "EDF of endless records": (".edf", edf(lambda h: h.update(seconds="inf")), "records of no length"),
    "EDF of records that last nan": (".edf", edf(lambda h: h.update(seconds="nan")), "records of no length"),
    "EDF of text for numbers": (".edf", edf(lambda h: h.update(samples="many")), "header of this EDF cannot be read"),
    "EDF that was interrupted": (".edf", edf(lambda h: h.update(kind="EDF+D")), "interrupted"),
    "EDF of another format": (".edf", edf(magic=b"RIFFWAVE"), "not an EDF or BDF file"),
    "an empty EDF": (".edf", b"", "not an EDF or BDF file"),
    "Noraxon: NaN in a time": ("noraxon", noraxon(row(50, "nan,1")), "row 55: the time is no finite number"),
    "Noraxon: NaN in the first time": ("noraxon", noraxon(row(0, ",1")), "row 5: the time is no finite number"),
    "Noraxon: text in the last time": ("noraxon", noraxon(row(-1, "end,1")), "row 3004: the time is no finite"),
    "Noraxon: text in a value": ("noraxon", noraxon(row(50, "0.05,lost")), "row 55: x is 'lost'"),
    "Noraxon: an infinite value": ("noraxon", noraxon(row(50, "0.05,inf")), "row 55: x is 'inf'"),
    "Noraxon: a row missing": ("noraxon", noraxon(lambda r: r.pop(50)), "2999 samples, but its header says 3000"),
    "Noraxon: cut short": ("noraxon", noraxon()[:-9000], "the file was cut short|rows differ"),
    "Noraxon: another rate than its times": ("noraxon", noraxon(rate="2000"), "2000 Hz by the file.*expected one rate"),
    "Noraxon: no rate": ("noraxon", noraxon(rate="0"), "0 Hz by the file; expected 10 to 50000"),
    "Noraxon: rate is NaN": ("noraxon", noraxon(rate="nan"), "nan Hz by the file; expected 10 to 50000"),
    "Noraxon: rate is infinite": ("noraxon", noraxon(rate="inf"), "inf Hz by the file; expected 10 to 50000"),
    "Noraxon: rate is text": ("noraxon", noraxon(rate="fast"), "damaged, or of another format .*could not convert"),
    "Noraxon: times in minutes": ("noraxon", noraxon(time_units="min"), "times are in 'min'; expected s"),
    "OpenSim: NaN in a time": (".mot", mot(row(9, "nan\t3")), "row 13: the time is no finite number"),
    "OpenSim: text in a time": (".mot", mot(row(9, "x\t3")), "row 13: the time is no finite number"),
    "OpenSim: a gap in its angle": (".mot", mot(row(9, "0.009\t")), "row 13: r_elbow_flex is ''"),
    "OpenSim: cut short": (
        ".sto", mot(head="nRows=4000\nendheader\ntime\tq\n"), "3000 rows, but its header says 4000; the file was cut"),
    "CSV: commas in thousands": (".csv", table(";", {"x": 950 + RISE * 90}, thousands=","), "as if thousands"),
    "CSV: points in thousands": (".csv", table(";", {"x": 950 + RISE * 90}, thousands="."), "as if thousands"),
    "CSV: two clocks": (
        ".csv", table(",", {"t EMG [s]": RISE, "x": WAVE, "t angle [s]": 2 * RISE}), "each may hold the times; name"),
    "OpenSim: no endheader": (".mot", mot(head="time\tq\n"), "no row with endheader"),
    "OpenSim: no times": (".mot", mot(head="endheader\nt0\tq\n"), "no column time among t0, q"),
    "Delsys: NaN in a time": ("delsys", delsys(row(9, "nan,3")), "row 11: the time is no finite number"),
    "Delsys: text in a time": ("delsys", delsys(row(9, "late,3")), "row 11: the time is no finite number"),
    "Delsys: text in a value": ("delsys", delsys(row(9, "0.009,x")), "row 11: .*EMG 1 is 'x'"),
    "Delsys: of another format": ("delsys", noraxon(), r"no row begins with X \[s\]"),
    "Vicon: text in a frame": ("vicon", vicon(row(9, "x,0,3")), "row 15: the time is no finite number"),
    "Vicon: text in a sub-frame": ("vicon", vicon(row(9, "10,x,3")), "the time is no finite number"),
    "Vicon: a frame missing": ("vicon", vicon(lambda r: r.pop(9)), "row 15: time goes from"),
    "Vicon: a rate of text": ("vicon", vicon(rate="fast"), "row 4: expected above it a row with the kind of data"),
    "Vicon: no rate": ("vicon", vicon(rate="0"), "(damaged|no finite number|expected 10)"),
    "MATLAB: NaN in a time": (".mat", lambda f: mat(f, time=without(RISE, 9), emg=WAVE), "row 10: the time is no"),
    "MATLAB: NaN in a value": (".mat", lambda f: mat(f, time=RISE, emg=without(WAVE, 9)), "row 10: emg is nan"),
    "MATLAB: no time and no rate": (".mat", lambda f: mat(f, emg=WAVE), "emg has neither times nor a rate"),
    "MATLAB: a rate that its times are not of": (
        ".mat", lambda f: mat(f, time=RISE, fs=50.0, emg=WAVE), "emg has 50 Hz by the file, 1000 Hz by its times"),
    "MATLAB: no samples": (".mat", lambda f: mat(f, note="hello"), "no vector or matrix of numbers"),
    "MATLAB: of another format": (".mat", b"hello " * 50, "not a MATLAB file"),
    "Parquet: NaN in a time": (
        ".parquet", lambda f: parquet(f, time=without(RISE, 9), emg=WAVE), "row 10: the time is no finite number"),
    "Parquet: text for numbers": (
        ".parquet", lambda f: parquet(f, time=RISE, emg=["x"] * 3000), "row 1: emg is 'x' .3000 such rows"),
    "Parquet: cut short": (".parquet", lambda f: parquet(f, time=RISE, emg=WAVE)[:900], "not a Parquet file, or it is"),
    "Parquet: empty": (".parquet", b"", "not a Parquet file, or it is damaged"),
    "an unknown ending": (".xyz", b"hello", "'.xyz' says nothing of the format"),
    "C3D of another format": (".c3d", b"hello", "(need the package ezc3d|not a C3D file|damaged)"),
    "a gz that is none": (".csv.gz", b"time,emg\n0,1\n", "not UTF-8 text|damaged"),
}  # fmt: skip


def of_a_format(folder: Path, ending: str, content: bytes | Callable[[Path], bytes]) -> str:
    """What reading a file of a format says, and the checks of each of its signals."""
    form = None if ending.startswith(".") else ending
    path = folder / f"file{ending if form is None else '.csv'}"
    path.write_bytes(content(folder) if callable(content) else content)
    raw = read_raw(path, form)
    return "\n".join(filter(None, (signal_problem(raw, signal, None, RAW) for signal in raw.signals)))
