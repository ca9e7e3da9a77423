"""Pictures of raw recordings beside what was made of them."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from myowave.data.recording import Prepared
from myowave.plotting import CYCLE, GREY, MEASURED, canvas, title


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
    title(figure, _told(prepared, quality, trial))
    return figure


def _told(prepared: Prepared, quality: Mapping[str, Any], trial: str) -> str:
    """What was found in a trial, in a sentence."""
    grid = prepared.recordings[trial].time
    warnings = [f for f in quality["findings"] if f["trial"] == trial and f["severity"] == "warning"]
    found = [": ".join(filter(None, (f["signal"].removeprefix("emg_"), f["found"]))) for f in warnings]
    role = "test" if trial in prepared.trials.test else "training"
    kept = f"{trial}, {role}, {grid[-1] - grid[0]:.1f} s"
    return f"{kept}; " + ("; ".join(found) if found else "no warnings")
