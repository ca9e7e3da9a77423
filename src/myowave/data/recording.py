"""What recordings are on their way to `Trials`: read, brought onto one grid, processed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from myowave.data.processing.sampled import Sampled
from myowave.data.trials import Trials


@dataclass(frozen=True, eq=False)
class RawTrial:
    """One trial as recorded.

    Args:
        emg: {channel: [uV], or any unit where it is arbitrary or a fraction}.
        angle: elbow angle [rad], with the sign and offset of the settings.
        signals: further angles [rad].
        torque: of the muscles, flexing positive [N m]; None where it was not measured.
        angle_unit: in which the angle was written.
        file: that holds all of the trial, with its first row of samples; None where there are several.
        motor: known torque of a motor on the joint at rest [N m]; None where there is none.
        cut: from and to [s] after the start of the angle: what is kept; None for all.
    """

    emg: Mapping[str, Sampled]
    angle: Sampled
    signals: Mapping[str, Sampled] = field(default_factory=dict)
    torque: Sampled | None = None
    angle_unit: str = "rad"
    file: tuple[Path, int] | None = None
    motor: Sampled | None = None
    cut: tuple[float, float] | None = None

    @property
    def all(self) -> list[Sampled]:
        """Every signal."""
        further = [signal for signal in (self.torque, self.motor) if signal is not None]
        return [*self.emg.values(), self.angle, *self.signals.values(), *further]


@dataclass(frozen=True, eq=False)
class Session:
    """All recordings of a dataset.

    Args:
        trials: those without a problem, by name.
        forms: {channel: raw, envelope or fraction}.
        mvc: EMG of maximum contractions, by name.
        sha256: of each signal's file, by trial and signal.
        problems: of the others.
    """

    trials: Mapping[str, RawTrial]
    forms: Mapping[str, str]
    mvc: Mapping[str, Mapping[str, Sampled]] = field(default_factory=dict)
    sha256: Mapping[str, str] = field(default_factory=dict)
    problems: Sequence[str] = ()


@dataclass(frozen=True, eq=False)
class Recording:
    """EMG and motion of one trial.

    Args:
        origin: the file it was read from, or the trial's name, as messages begin.
        dt: time between samples [s].
        channels: name of each EMG channel, length C.
        emg: as a fraction of what counts as 1 [-], (N, C).
        angle: elbow angle [rad], (N,).
        torque: of the muscles, as a dynamometer measured it [N m], (N,); None where none did.
        angle_unit: in which the angle was written.
        first_row: row of the file that its first sample is in; None where its samples are not those of a file.
    """

    origin: str
    dt: float
    channels: tuple[str, ...]
    emg: NDArray[np.float64]
    angle: NDArray[np.float64]
    torque: NDArray[np.float64] | None = None
    angle_unit: str = "rad"
    first_row: int | None = None

    def at(self, sample: int) -> str:
        """Where a sample stands, as messages begin: `trial2.csv, row 118`, or `trial b, 3.2 s after its start`."""
        where = (
            f"{sample * self.dt:.1f} s after its start" if self.first_row is None else f"row {sample + self.first_row}"
        )
        return f"{self.origin}, {where}"


@dataclass(frozen=True, eq=False)
class Prepared:
    """A session, processed.

    Args:
        trials: like any others.
        raw: {trial: as recorded, on one clock}.
        envelopes: {trial: {channel: in the unit of its EMG}}.
        gains: {channel: the envelope that counts as 1, in the unit of its EMG}.
        grids: {trial: times of its samples [s], (N,)}.
        forms: {channel: raw, envelope or fraction}.
    """

    trials: Trials
    raw: Mapping[str, RawTrial]
    envelopes: Mapping[str, Mapping[str, Sampled]]
    gains: Mapping[str, float]
    grids: Mapping[str, NDArray[np.float64]]
    forms: Mapping[str, str]
