"""Pictures of the data: trials and their scales (Taneja et al. 2023, Figs. 7 and 9), and raw recordings."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from myowave.data.recording import Prepared
from myowave.data.trials import Trials
from myowave.plotting import CYCLE, GREY, MEASURED, canvas, title


def draw_trials(trials: Trials) -> Figure:
    """EMG of every channel and the joint angle, one column per trial."""
    rows = len(trials.channels) + 1
    size = {"width": max(7.0, 2.6 * len(trials.names)), "height": 1.7 * rows + 0.9}
    figure, axes = canvas(rows, len(trials.names), **size, sharex=True, sharey="row")
    degrees = np.rad2deg(trials.angle)
    for column, (name, length) in enumerate(zip(trials.names, trials.lengths, strict=True)):
        time = trials.time[:length]
        for row in range(len(trials.channels)):
            axes[row, column].plot(time, trials.emg[column, :length, row], color=CYCLE[row % len(CYCLE)], linewidth=0.9)
        axes[-1, column].plot(time, degrees[column, :length], color=MEASURED)
        axes[-1, column].set_xlabel("time [s]")
        role = "test" if name in trials.test else "training"
        axes[0, column].set_title(f"trial {name.removeprefix('trial')}, {role}")
    for row, channel in enumerate(trials.channels):
        axes[row, 0].set_ylabel(f"{channel.removeprefix('emg_')}\nEMG [-]")
    axes[-1, 0].set_ylabel("elbow\nangle [deg]")
    valid = degrees[trials.valid]
    seconds = sorted({f"{length * trials.dt:.1f}" for length in (min(trials.lengths), max(trials.lengths))}, key=float)
    title(
        figure,
        f"{trials.dataset}: {len(trials.names)} trials of {' to '.join(seconds)} s, "
        f"the elbow moves between {valid.min():.0f} and {valid.max():.0f} deg",
    )
    return figure


def draw_scales(scales: Mapping[int, Trials]) -> Figure:
    """The first training trial at each scale: EMG of the first channel, if there is one, and the angle."""
    finest, coarsest = scales[0], max(scales)
    index = finest.index(finest.train)[0]
    time = finest.time[: finest.lengths[index]]
    angles = {level: np.rad2deg(trials.angle[index, : len(time)]) for level, trials in scales.items()}
    columns = [("elbow angle [deg]", "motion's", MEASURED, angles)]
    for channel in finest.channels[:1]:
        emg = {level: trials.emg[index, : len(time), 0] for level, trials in scales.items()}
        columns.insert(0, (f"{channel.removeprefix('emg_')} EMG [-]", "EMG's variance", CYCLE[0], emg))
    size = {"width": 10, "height": 1.5 * len(scales) + 1.0}
    figure, axes = canvas(len(scales), len(columns), **size, sharex=True, sharey="col")
    parts = []
    for column, (name, of, color, signals) in enumerate(columns):
        for row, level in enumerate(sorted(scales)):
            if level:
                axes[row, column].plot(time, signals[0], color="#c4c4c4", linewidth=0.8)
            axes[row, column].plot(time, signals[level], color=color, linewidth=1.1)
            axes[row, 0].set_ylabel(f"scale {-level}")
        axes[0, column].set_title(name)
        axes[-1, column].set_xlabel("time [s]")
        parts.append(f"{100 * np.var(signals[0] - signals[coarsest]) / np.var(signals[0]):.2g} % of the {of}")
    label = finest.names[index].removeprefix("trial")
    title(figure, f"{finest.dataset}, trial {label}: scale {-coarsest} leaves out {' and '.join(parts)}")
    return figure


def draw_recording(prepared: Prepared, quality: Mapping[str, Any], trial: str) -> Figure:
    """Raw EMG of each channel with its envelope, and the angles of one trial; what is not kept of it lies on grey."""
    recording = prepared.recordings[trial]
    raw, grid = recording.raw, recording.time
    rows = len(raw.emg) + 1
    figure, axes = canvas(rows, 1, width=11, height=1.8 * rows + 1.2, sharex=True)
    for row, (channel, emg) in enumerate(raw.emg.items()):
        axis, envelope = axes[row, 0], recording.envelopes[channel]
        axis.plot(emg.time, emg.values, color="#c4c4c4", linewidth=0.4, label="raw", rasterized=True)
        axis.plot(envelope.time, envelope.values, color=CYCLE[row % len(CYCLE)], label="envelope")
        axis.axhline(prepared.gains[channel], color=GREY, linestyle=":", linewidth=1.4, label="counts as 1")
        axis.set_ylabel(f"{channel.removeprefix('emg_')}\nEMG [{emg.unit}]")
    last = axes[-1, 0]
    last.plot(raw.angle.time, np.rad2deg(raw.angle.values), color=MEASURED, label="elbow")
    leans = {name: signal for name, signal in raw.signals.items() if signal.unit == "rad"}
    for color, (name, angle) in zip(CYCLE, leans.items(), strict=False):
        last.plot(angle.time, np.rad2deg(angle.values), color=color, linestyle="--", label=name.removesuffix("_rad"))
    last.set_ylabel("angle [deg]")
    last.set_xlabel("time on the angle's clock [s]")
    start, end = min(signal.start for signal in raw.all), max(signal.end for signal in raw.all)
    for axis in axes[:, 0]:
        axis.set_xlim(start, end)
        axis.axvspan(start, grid[0], color="#e3e3e3", zorder=0)
        axis.axvspan(grid[-1], end, color="#e3e3e3", zorder=0)
        axis.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=3, borderaxespad=0.0, handlelength=1.5)
    title(figure, _sentence(prepared, quality, trial))
    return figure


def _sentence(prepared: Prepared, quality: Mapping[str, Any], trial: str) -> str:
    """What was found in a trial, in a sentence."""
    grid = prepared.recordings[trial].time
    warnings = [f for f in quality["findings"] if f["trial"] == trial and f["severity"] == "warning"]
    found = [": ".join(filter(None, (f["signal"].removeprefix("emg_"), f["found"]))) for f in warnings]
    role = "test" if trial in prepared.trials.test else "training"
    kept = f"{trial}, {role}, {grid[-1] - grid[0]:.1f} s"
    return f"{kept}; " + ("; ".join(found) if found else "no warnings")
