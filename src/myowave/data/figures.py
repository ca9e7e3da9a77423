"""Pictures of trials: what goes into everything else (Taneja et al. 2023, Figs. 7 and 9), and their scales."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from myowave.data.preparing import Prepared
from myowave.data.trials import Trials
from myowave.plotting import CYCLE, GREY, MEASURED, canvas, title


def draw_trials(trials: Trials) -> Figure:
    """EMG of every channel and the joint angle, one column per trial."""
    rows = len(trials.channels) + 1
    figure, axes = canvas(
        rows,
        len(trials.names),
        width=max(7.0, 2.6 * len(trials.names)),
        height=1.7 * rows + 0.9,
        sharex=True,
        sharey="row",
    )
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
    """The first training trial at each scale: EMG of the first channel and the angle."""
    finest = scales[0]
    index = finest.index(finest.train)[0]
    length = finest.lengths[index]
    figure, axes = canvas(len(scales), 2, width=10, height=1.5 * len(scales) + 1.0, sharex=True, sharey="col")
    for row, level in enumerate(sorted(scales)):
        trials = scales[level]
        time = trials.time[:length]
        for column, signal in enumerate((trials.emg[index, :length, 0], np.rad2deg(trials.angle[index, :length]))):
            if level:
                original = (finest.emg[index, :length, 0], np.rad2deg(finest.angle[index, :length]))[column]
                axes[row, column].plot(time, original, color="#c4c4c4", linewidth=0.8)
            axes[row, column].plot(time, signal, color=(CYCLE[0], MEASURED)[column], linewidth=1.1)
        axes[row, 0].set_ylabel(f"scale {-level}\n[-]")
        axes[row, 1].set_ylabel("[deg]")
    axes[0, 0].set_title(f"{finest.channels[0].removeprefix('emg_')} EMG")
    axes[0, 1].set_title("elbow angle")
    for column in (0, 1):
        axes[-1, column].set_xlabel("time [s]")
    coarsest = scales[max(scales)]
    left_out = [
        _share_left_out(finest.emg[index, :length, 0], coarsest.emg[index, :length, 0]),
        _share_left_out(finest.angle[index, :length], coarsest.angle[index, :length]),
    ]
    title(
        figure,
        f"{finest.dataset}, trial {finest.names[index].removeprefix('trial')}: scale {-max(scales)} leaves out "
        f"{left_out[0]:.2g} % of the EMG's variance and {left_out[1]:.2g} % of the motion's",
    )
    return figure


def _share_left_out(signal: np.ndarray, coarse: np.ndarray) -> float:
    return 100 * float(np.var(signal - coarse) / np.var(signal))


def draw_recording(prepared: Prepared, quality: Mapping[str, Any], trial: str) -> Figure:
    """Raw EMG of each channel with its envelope, and the angles of one trial; what is not kept of it lies on grey."""
    raw, grid = prepared.raw[trial], prepared.grids[trial]
    rows = len(raw.emg) + 1
    figure, axes = canvas(rows, 1, width=11, height=1.8 * rows + 1.2, sharex=True)
    for row, (channel, emg) in enumerate(raw.emg.items()):
        axis, envelope = axes[row, 0], prepared.envelopes[trial][channel]
        axis.plot(emg.time, emg.values, color="#c4c4c4", linewidth=0.4, label="raw", rasterized=True)
        axis.plot(envelope.time, envelope.values, color=CYCLE[row % len(CYCLE)], label="envelope")
        axis.axhline(prepared.gains[channel], color=GREY, linestyle=":", linewidth=1.4, label="counts as 1")
        axis.set_ylabel(f"{channel.removeprefix('emg_')}\nEMG [{emg.unit}]")
    last = axes[-1, 0]
    last.plot(raw.angle.time, np.rad2deg(raw.angle.values), color=MEASURED, label="elbow")
    for color, (name, angle) in zip(CYCLE, raw.signals.items(), strict=False):
        last.plot(angle.time, np.rad2deg(angle.values), color=color, linestyle="--", label=name.removesuffix("_rad"))
    last.set_ylabel("angle [deg]")
    last.set_xlabel("time on the angle's clock [s]")
    start, end = min(signal.start for signal in raw.all), max(signal.end for signal in raw.all)
    for axis in axes[:, 0]:
        axis.set_xlim(start, end)
        axis.axvspan(start, grid[0], color="#e3e3e3", zorder=0)
        axis.axvspan(grid[-1], end, color="#e3e3e3", zorder=0)
        axis.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=3, borderaxespad=0.0, handlelength=1.5)
    title(figure, _told(prepared, quality, trial))
    return figure


def _told(prepared: Prepared, quality: Mapping[str, Any], trial: str) -> str:
    """What was found in a trial, in a sentence."""
    grid = prepared.grids[trial]
    warnings = [f for f in quality["findings"] if f["trial"] == trial and f["severity"] == "warning"]
    found = [": ".join(filter(None, (f["signal"].removeprefix("emg_"), f["found"]))) for f in warnings]
    role = "test" if trial in prepared.trials.test else "training"
    kept = f"{trial}, {role}, {grid[-1] - grid[0]:.1f} s"
    return f"{kept}; " + ("; ".join(found) if found else "no warnings")
