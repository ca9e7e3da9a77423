"""One trial in the form that all trials have, before they are stacked."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from myowave.data.trials import TORQUE


@dataclass(frozen=True, eq=False)
class Recording:
    """EMG and motion of one trial.

    Args:
        origin: the file it was read from, or the trial's name, as messages begin.
        dt: time between samples [s].
        channels: column name of each EMG channel, length C.
        emg: as a fraction of maximum voluntary contraction [-], (N, C).
        angle: elbow angle [rad], (N,).
        torque: of the muscles, as a dynamometer measured it [N m], (N,); None where none did.
    """

    origin: str
    dt: float
    channels: tuple[str, ...]
    emg: NDArray[np.float64]
    angle: NDArray[np.float64]
    torque: NDArray[np.float64] | None = None


def torques_of(recordings: Iterable[Recording]) -> dict[str, list[NDArray[np.float64]]]:
    """The torque of each trial by the name of the signal, NaN where none was measured; nothing where that is so in
    all."""
    pairs = [(recording.torque, len(recording.angle)) for recording in recordings]
    if all(torque is None for torque, _ in pairs):
        return {}
    return {TORQUE: [np.full(samples, np.nan) if torque is None else torque for torque, samples in pairs]}
