"""Trials: what the whole project calls data, whether it was simulated or measured.

Shapes: T trials, N samples of the longest trial, C EMG channels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

EMG_PREFIX = "emg_"
TIME, ANGLES = "time_s", {"angle_rad": "rad", "angle_deg": "deg"}  # columns of files with a trial each
TORQUE = "torque_Nm"
"""Torque of the muscles about the elbow as measured, flexing positive, one of the `signals`; NaN in trials without."""
MOTOR = "motor_Nm"  # known torque of a motor on the joint at rest, one of the `signals`


@dataclass(frozen=True, eq=False)
class Trials:
    """EMG and joint angle of several trials, sampled at one rate.

    Trials may differ in length. The arrays are as long as the longest; a shorter one is padded by holding its
    last value, and `valid` tells measured samples from padding.
    """

    dataset: str  # name of the dataset, used in messages
    dt: float  # time between samples [s]
    names: tuple[str, ...]  # label of each trial, length T
    channels: tuple[str, ...]  # column name of each EMG channel (`emg_biceps`, ...), length C
    emg: Array  # EMG as a fraction of maximum voluntary contraction [-], (T, N, C)
    angle: Array  # elbow angle [rad], (T, N); 0 hangs straight down, positive in flexion
    lengths: tuple[int, ...]  # samples really recorded in each trial, length T
    test: tuple[str, ...] = ()  # names of the trials that are kept for testing; the others train
    # known physical parameters that differ between trials, {trial: {parameter: value in SI units}}
    conditions: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    # known physical parameters of the subject, {parameter: value in SI units}
    constants: Mapping[str, float] = field(default_factory=dict)
    # where the numbers come from; JSON-able, read by people only
    provenance: Mapping[str, Any] = field(default_factory=dict)
    # how raw EMG of these channels becomes EMG (`processing.excitation.RealTime` as plain data); empty where none was
    real_time: Mapping[str, Any] = field(default_factory=dict)
    emg_low_pass_hz: float | None = None  # corner of the low-pass that made this EMG; None where nobody told
    # further angles over time [rad], {name such as tilt_rad: (T, N)}, padded as the others are; and torques (`TORQUE`,
    # `MOTOR`) [N m]
    signals: Mapping[str, Array] = field(default_factory=dict)
    # {physical parameter: the signal that is its value over time, of which a condition is the median}
    over_time: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("emg", "angle"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
        for name in ("names", "channels", "test", "lengths"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        if problem := next(self._problems(), None):
            raise ValueError(f"dataset {self.dataset!r}{problem}")

    @classmethod
    def from_sequences(
        cls,
        *,
        emg: Sequence[Any],
        angle: Sequence[Any],
        signals: Mapping[str, Sequence[ArrayLike]] | None = None,
        **fields: Any,
    ) -> Trials:
        """Stack trials of different lengths, padding the shorter ones by holding their last value.

        Args:
            emg: one (N_i, C) array per trial [-].
            angle: one (N_i,) array per trial [rad].
            signals: {name: one (N_i,) array per trial [rad]}.
            **fields: the other fields of `Trials`, without `lengths`.
        """
        lengths, of_emg = tuple(map(len, angle)), tuple(map(len, emg))
        if min(lengths, default=0) == 0 or of_emg != lengths:
            raise ValueError(
                f"dataset {fields.get('dataset')!r}: {len(emg)} EMG and {len(angle)} angle sequences with lengths "
                f"{list(of_emg)} and {list(lengths)}; each trial needs one of both, equally long."
            )
        n = max(lengths)
        stacked = {name: _stack(values, n) for name, values in (signals or {}).items()}
        return cls(emg=_stack(emg, n), angle=_stack(angle, n), signals=stacked, lengths=lengths, **fields)

    @property
    def valid(self) -> NDArray[np.bool_]:
        """True where a sample was recorded, False where it pads a shorter trial, (T, N)."""
        return np.arange(self.angle.shape[1]) < np.asarray(self.lengths)[:, None]

    @property
    def train(self) -> tuple[str, ...]:
        """Names of the trials that are not kept for testing."""
        return tuple(name for name in self.names if name not in self.test)

    @property
    def time(self) -> Array:
        """Time of each sample since the first [s], (N,)."""
        return np.arange(self.angle.shape[1], dtype=np.float64) * self.dt

    def index(self, names: Iterable[str]) -> list[int]:
        """Positions of trials on the trial axis, in the order asked for."""
        positions = {name: i for i, name in enumerate(self.names)}
        names = list(names)
        if unknown := [name for name in names if name not in positions]:
            raise ValueError(f"dataset {self.dataset!r}: no trial named {unknown}; the trials are {list(self.names)}.")
        return [positions[name] for name in names]

    def select(self, names: Iterable[str]) -> Trials:
        """The named trials, in the order asked for, cut to the longest of them; a ValueError for none."""
        if not (names := tuple(names)):
            raise ValueError(f"dataset {self.dataset!r}: no trial is left to train or fit; name fewer of them as test.")
        index = self.index(names)
        lengths = tuple(self.lengths[i] for i in index)
        samples = slice(max(lengths))
        return replace(
            self,
            names=names,
            emg=self.emg[index, samples],
            angle=self.angle[index, samples],
            lengths=lengths,
            test=tuple(name for name in self.test if name in names),
            conditions={name: values for name, values in self.conditions.items() if name in names},
            signals={name: values[index, samples] for name, values in self.signals.items()},
        )

    def changed(self, change: Callable[[Array], Array], **fields: Any) -> Trials:
        """The same trials with every signal changed, trial by trial without padding - angles and further signals are
        (N_i,), the EMG (N_i, C) - and other fields that differ, by name."""
        arrays = {"emg": self.emg, "angle": self.angle, **self.signals}
        each = {name: [change(a[:n]) for a, n in zip(of, self.lengths, strict=True)] for name, of in arrays.items()}
        same = {name: value for name, value in vars(self).items() if name != "lengths"}
        own = {"emg": each.pop("emg"), "angle": each.pop("angle"), "signals": each}
        return Trials.from_sequences(**{**same, **own, **fields})

    def thinned(self, rate_hz: float | None) -> Trials:
        """The trials with about as many samples a second, beginning with the first of each; None keeps all.

        ASSUME: EMG and motion hold nothing above half of the rate, as envelopes of 4 Hz and the motion of an arm at
        25 Hz. Kept are samples as they were recorded, so that a stream is thinned in the same way, with no lag. A
        ValueError where fewer than 2 samples of a trial are left.
        """
        every = 1 if rate_hz is None else max(1, round(1 / (self.dt * rate_hz)))
        if every == 1:
            return self
        length, name = min(zip(self.lengths, self.names, strict=True))
        if length <= every:
            raise ValueError(
                f"dataset {self.dataset!r}, trial {name!r}: of {length} samples {1 / self.dt:g} a second, {rate_hz:g} "
                "a second leave one. Use longer trials, or raise the recipe's rate_hz."
            )
        return self.changed(lambda values: values[::every], dt=self.dt * every)

    def condition(self, parameter: str, default: float) -> Array:
        """Value of a known parameter in each trial, (T,): its condition, else the constant, else `default`."""
        constant = self.constants.get(parameter, default)
        return np.array([self.conditions.get(name, {}).get(parameter, constant) for name in self.names])

    def change_over_time(self, parameter: str) -> Array | None:
        """How far a known parameter is from its condition over time, (T, N); None where that was not measured."""
        signal = self.over_time.get(parameter)
        return None if signal is None else self.signals[signal] - self.condition(parameter, 0.0)[:, None]

    def known(self, defaults: Mapping[str, float]) -> dict[str, Array]:
        """Every constant that is known of the subject or of a trial: its value in each trial, {parameter: (T,)}."""
        names = sorted(set(self.constants).union(*self.conditions.values()))
        return {name: self.condition(name, defaults[name]) for name in names}

    def _problems(self) -> Iterator[str]:
        """What is inconsistent, or not finite."""
        trials, channels, samples = len(self.names), len(self.channels), max(self.lengths, default=0)
        for name, array in {"emg": self.emg, "angle": self.angle, **self.signals}.items():
            shape = (trials, samples, channels) if name == "emg" else (trials, samples)
            if array.shape != shape or len(self.lengths) != trials or min(shape[:2]) < 1:
                yield (
                    f": {name} has shape {array.shape}, expected {shape} for {trials} trials, at least one, with "
                    f"lengths {self.lengths} and {channels} channels."
                )
        if min(self.lengths, default=0) < 1:
            yield f": lengths {self.lengths}; every trial needs a sample."
        for what, labels in (("trial", self.names), ("channel", self.channels), ("test trial", self.test)):
            if repeated := sorted({label for label in labels if labels.count(label) > 1}):
                yield f": {what} {repeated} is named more than once; rename one."
        if foreign := [name for name in self.channels if not name.startswith(EMG_PREFIX)]:
            yield f": channels {foreign} do not begin with {EMG_PREFIX!r}; call them emg_<muscle>."
        if missing := sorted(set(self.over_time.values()) - set(self.signals)):
            yield f": over_time names {missing}; the signals are {sorted(self.signals)}."
        for where, named in (("test", self.test), ("conditions", self.conditions)):
            if unknown := [name for name in named if name not in self.names]:
                yield f", {where}: no trial named {unknown}; the trials are {list(self.names)}."
        if not (np.isfinite(self.dt) and self.dt > 0):
            yield f": dt is {self.dt}; expected a positive number of seconds."
        for name, length, emg, angle in zip(self.names, self.lengths, self.emg, self.angle, strict=True):
            if not (np.isfinite(emg).all() and np.isfinite(angle).all()):
                yield (
                    f", trial {name!r}: EMG or angle is not finite; a simulation that diverged or a gap in a recording "
                    "must be removed before it becomes a trial."
                )
            if (emg[length:] != emg[length - 1]).any() or (angle[length:] != angle[length - 1]).any():
                yield (
                    f", trial {name!r}: samples after the {length} recorded ones do not hold the last value; build the "
                    "trials with Trials.from_sequences."
                )


def _stack(sequences: Sequence[ArrayLike], samples: int) -> Array:
    """Sequences of different lengths as rows of one array, the last value held up to `samples`."""
    rows = [np.asarray(values, dtype=np.float64) for values in sequences]
    return np.stack([row[np.minimum(np.arange(samples), len(row) - 1)] for row in rows])
