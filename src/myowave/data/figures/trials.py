"""Pictures of trials: what goes into everything else (Taneja et al. 2023, Figs. 7 and 9), and their scales."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from myowave.data.trials import Trials
from myowave.plotting import CYCLE, MEASURED, canvas, title


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
