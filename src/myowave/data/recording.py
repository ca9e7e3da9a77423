"""What recordings are on their way to `Trials`: read, processed, brought onto one grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from myowave.data.processing.sampled import Sampled
from myowave.data.trials import Array, Trials


@dataclass(frozen=True, eq=False)
class RawTrial:
    """One trial as recorded."""

    emg: Mapping[str, Sampled]  # {channel: [uV], or any unit where it is arbitrary or a fraction}
    angle: Sampled  # elbow angle [rad], with the sign and offset of the settings
    signals: Mapping[str, Sampled] = field(default_factory=dict)  # further angles [rad], and `TORQUE`, `MOTOR` [N m]
    file: tuple[Path, int] | None = None  # that holds all of it, with its first row of samples
    cut: tuple[float, float] | None = None  # from and to on the angle's clock [s]: what is kept; None for all

    @property
    def all(self) -> list[Sampled]:
        return [*self.emg.values(), self.angle, *self.signals.values()]


@dataclass(frozen=True, eq=False)
class Session:
    """All recordings of a dataset."""

    trials: Mapping[str, RawTrial]  # those without a problem, by name
    forms: Mapping[str, str]  # {channel: raw, envelope or fraction}
    mvc: Mapping[str, Mapping[str, Sampled]] = field(default_factory=dict)  # EMG of maxima that are no trials, by name
    sha256: Mapping[str, str] = field(default_factory=dict)  # of each signal's file, by trial and signal
    problems: Sequence[str] = ()  # of the others


@dataclass(frozen=True, eq=False)
class Recording:
    """One trial, processed."""

    name: str  # of the trial
    raw: RawTrial  # as recorded, EMG and angle on one clock
    envelopes: Mapping[str, Sampled]  # {channel: in the unit of its EMG}
    time: Array  # of its samples on the angle's clock [s], (N,)
    emg: Mapping[str, Array]  # {channel: as a fraction of what counts as 1 [-], (N,)}
    angle: Array  # elbow angle [rad], (N,)
    signals: Mapping[str, Array]  # as in `raw`, (N,) each

    @property
    def dt(self) -> float:
        """Time between samples [s]."""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)

    @property
    def kept(self) -> Recording:
        """With no more of what was recorded than a cut keeps."""
        if self.raw.cut is None:
            return self
        start, end = self.raw.cut  # and no less: what was not recorded at the same time shows that clocks differ

        def part(signals: Mapping[str, Sampled]) -> dict[str, Sampled]:
            return {name: one.between(start, end) for name, one in signals.items()}

        emg, angle, signals = part(self.raw.emg), self.raw.angle.between(start, end), part(self.raw.signals)
        raw = replace(self.raw, emg=emg, angle=angle, signals=signals)
        return replace(self, raw=raw, envelopes=part(self.envelopes))

    @property
    def origin(self) -> str:
        """The file it was read from, or the trial's name, as messages begin."""
        return f"trial {self.name}" if self.raw.file is None else str(self.raw.file[0])

    def at(self, sample: int) -> str:
        """Where a sample stands, as messages begin: `trial2.csv, row 118`, or `trial b, at 3.20 s`."""
        if self.raw.file is None:
            return f"{self.origin}, at {self.time[sample]:.2f} s"
        return f"{self.origin}, row {sample + self.raw.file[1]}"


@dataclass(frozen=True, eq=False)
class Prepared:
    """A session, processed."""

    trials: Trials  # like any others
    recordings: Mapping[str, Recording]  # what they were made of, by name
    gains: Mapping[str, float]  # {channel: the envelope that counts as 1, in the unit of its EMG}
    forms: Mapping[str, str]  # {channel: raw, envelope or fraction}
    # EMG of maximum contractions that are no trials, and its envelope, {name: {channel: both}}
    mvc: Mapping[str, Mapping[str, tuple[Sampled, Sampled]]]
