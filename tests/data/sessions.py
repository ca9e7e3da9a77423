"""Raw recordings made for tests: bursts of noise that lift a forearm, written as a recorder exports them."""

import numpy as np

EMG_HZ, ANGLE_HZ = 1000.0, 100.0


def noraxon(path, name, values, rate, unit, start=0.0):
    """Write a signal as Noraxon MR3 exports it."""
    time = start + np.arange(len(values)) / rate
    rows = [f"{t:.5f},{v:.10g}" for t, v in zip(time, values, strict=True)]
    head = [
        "\ufefftype,name,time_units,begin_time,frequency,count,units",
        f'signal,"{name}","s",{start:.5f},{rate:g},{len(values)},"{unit}"',
        "",
        "time,value",
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")


def burst(seed, seconds=12.0, rate=EMG_HZ, scale=50.0, period=4.0):
    """Raw EMG [uV]: noise that swells and fades."""
    time = np.arange(0, seconds, 1 / rate)
    noise = np.random.default_rng(seed).standard_normal(len(time))
    return scale * noise * (0.05 + np.maximum(np.sin(2 * np.pi * time / period), 0.0))


def curl(seconds=12.0, rate=ANGLE_HZ, period=4.0, late=0.1):
    """Elbow angle [deg] that follows."""
    time = np.arange(0, seconds, 1 / rate) - late
    return 60 - 50 * np.cos(2 * np.pi * time / period - 0.8)


def write_session(folder, trials=("a", "b", "c"), change=None, emg_start=0.0, angle_start=0.0):
    """A session of good recordings; `change(trial, key, values)` may spoil them."""
    change = change or (lambda trial, key, values: values)
    for seed, trial in enumerate(trials):
        for k, muscle in enumerate(("biceps", "triceps")):
            values = change(trial, muscle, burst(10 * seed + k, scale=50.0 + 5 * seed))
            noraxon(folder / trial / f"{muscle}.csv", f"Jane Doe {muscle}", values, EMG_HZ, "uV", emg_start)
        no_two_alike = 1e-7 * seed * np.sin(np.arange(1200))  # to the last digit
        angle = change(trial, "angle", curl() + no_two_alike)
        noraxon(folder / trial / "elbow.csv", "Elbow RT", angle, ANGLE_HZ, "deg", angle_start)
        tilt = change(trial, "tilt", np.full(1200, 5.0 + seed))
        noraxon(folder / trial / "tilt.csv", "Upper arm RT", tilt, ANGLE_HZ, "deg", angle_start)


def session_section(trials=("a", "b", "c"), **changes):
    """The block of config.yaml for it."""
    return {
        "kind": "recorded",
        "trials": list(trials),
        "test": [trials[-1]],
        "emg": {f"emg_{m}": {"file": f"{{trial}}/{m}.csv", "format": "noraxon"} for m in ("biceps", "triceps")},
        "angle": {"file": "{trial}/elbow.csv", "format": "noraxon"},
        "signals": {"tilt_rad": {"file": "{trial}/tilt.csv", "format": "noraxon", "condition": "tilt"}},
        **changes,
    }
