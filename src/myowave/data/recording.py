"""What recordings are on their way to `Trials`: read, processed, brought onto one grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from myowave.data.processing.sampled import Sampled
from myowave.data.trials import Array, Trials


@dataclass(frozen=True, eq=False)
class RawTrial:
    """One trial as recorded.

    Args:
        emg: {channel: [uV], or any unit where it is arbitrary or a fraction}.
        angle: elbow angle [rad], with the sign and offset of the settings.
        signals: further angles [rad], and torques [N m] where they were measured: `TORQUE`, `MOTOR`.
        angle_unit: in which the angle was written.
        file: that holds all of the trial, with its first row of samples; None where there are several.
        cut: from and to [s] after the start of the angle: what is kept; None for all.
    """

    emg: Mapping[str, Sampled]
    angle: Sampled
    signals: Mapping[str, Sampled] = field(default_factory=dict)
    angle_unit: str = "rad"
    file: tuple[Path, int] | None = None
    cut: tuple[float, float] | None = None

    @property
    def all(self) -> list[Sampled]:
        return [*self.emg.values(), self.angle, *self.signals.values()]

    def with_emg_later(self, offset: float) -> RawTrial:
        """The trial with times of the EMG moved by an offset [s]: those of the angle's clock."""
        return replace(self, emg={c: replace(emg, start=emg.start + offset) for c, emg in self.emg.items()})


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
    """One trial, processed.

    Args:
        name: of the trial.
        raw: as recorded, EMG and angle on one clock.
        envelopes: {channel: in the unit of its EMG}.
        time: of its samples on the angle's clock [s], (N,).
        emg: {channel: as a fraction of what counts as 1 [-], (N,)}.
        angle: elbow angle [rad], (N,).
        signals: as in `raw`, (N,) each.
    """

    name: str
    raw: RawTrial
    envelopes: Mapping[str, Sampled]
    time: Array
    emg: Mapping[str, Array]
    angle: Array
    signals: Mapping[str, Array]

    @property
    def dt(self) -> float:
        """Time between samples [s]."""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)

    @property
    def origin(self) -> str:
        """The file it was read from, or the trial's name, as messages begin."""
        return f"trial {self.name}" if self.raw.file is None else str(self.raw.file[0])

    def at(self, sample: int) -> str:
        """Where a sample stands, as messages begin: `trial2.csv, row 118`, or `trial b, 3.2 s after its start`."""
        if self.raw.file is None:
            return f"{self.origin}, {sample * self.dt:.1f} s after its start"
        return f"{self.origin}, row {sample + self.raw.file[1]}"


@dataclass(frozen=True, eq=False)
class Prepared:
    """A session, processed.

    Args:
        trials: like any others.
        recordings: what they were made of, by name.
        gains: {channel: the envelope that counts as 1, in the unit of its EMG}.
        forms: {channel: raw, envelope or fraction}.
    """

    trials: Trials
    recordings: Mapping[str, Recording]
    gains: Mapping[str, float]
    forms: Mapping[str, str]
