"""The section `data`: datasets, simulated or measured, and their scales."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from myowave.settings.diagnosis import Scatter
from myowave.settings.physics import Arm
from myowave.settings.recording import (
    TRIAL,
    ChannelName,
    EmgChannel,
    EmgStartOffset,
    ExtraAngle,
    ExtraName,
    Processing,
    RawAngle,
    RawKeep,
    RawMotor,
    RawSignal,
    RawTorque,
    RecordingName,
    TextLayout,
    TurnedAngle,
)
from myowave.settings.section import FilePath, Name, Once, Real, Section, TrialName, Whole, setting


class Identify(Section):
    """A physical constant to identify, and where its search starts."""

    start_spread: Real = setting("starts up to this fraction of the model's value away", "-", 0.2, ge=0, lt=1)
    low: Real | None = setting("lower bound where one is known, SI units", "SI", None)
    high: Real | None = setting("upper bound where one is known, SI units", "SI", None)
    literature: tuple[Real, ...] = setting(
        "values of the literature; the parameter is then a mean of them times sigmoids, Eq. 41 as printed", "SI", ()
    )

    @model_validator(mode="after")
    def _ordered(self) -> "Identify":
        if self.low is not None and self.high is not None and self.low >= self.high:
            raise ValueError(f"low {self.low} must be below high {self.high}")
        if (self.low is None) != (self.high is None):
            raise ValueError("low and high are given together, or neither")
        if self.literature and self.low is not None:
            raise ValueError("literature (Eq. 41 as printed) and low/high (true bounds) exclude each other; keep one")
        if any(value <= 0 for value in self.literature):
            raise ValueError(f"literature {self.literature} must be positive: Eq. 41 reaches from 0 to their mean")
        return self


def force_and_length(arm: Arm | None = None) -> dict[str, Identify]:
    """What is usually identified of an arm, by default the paper's: strength and length of each group, f0 and l0 of a
    muscle without one."""
    # ASSUME: fibres and tendons of a person are within 15 % of the model's, as where CEINMS calibrates a model to one
    # (Pizzolato et al. 2015, J. Biomech. 48, 3929-3936).
    of_group = {"strength": Identify(start_spread=0.2), "length": Identify(start_spread=0.05, low=0.85, high=1.15)}
    of_muscle = {"f0": Identify(start_spread=0.2), "l0": Identify(start_spread=0.1)}
    groups = arm.groups if arm else ()
    single = [name for name, muscle in arm.muscles.items() if muscle.group is None] if arm else ["Bi", "Tri"]
    return {
        f"{kind}_{owner}": choice
        for owners, kinds in ((groups, of_group), (single, of_muscle))
        for owner in owners
        for kind, choice in kinds.items()
    }


class Changed(Section):
    """Two groups of trials to be compared: before and after, with and without."""

    reference: Annotated[tuple[TrialName, ...], Once] = setting(
        "trials of the first group; two or more, or there is no control", min_length=1
    )
    against: Annotated[tuple[TrialName, ...], Once] = setting("trials of the second group", min_length=1)
    electrodes_stayed: bool = setting("whether the electrodes stayed on from the first group to the second", "", False)

    @model_validator(mode="after")
    def _groups_differ(self) -> "Changed":
        if both := sorted({*self.reference} & {*self.against}):
            raise ValueError(f"{', '.join(both)} is in both groups; keep it in one")
        return self


class _Dataset(Section):
    """What simulated and measured datasets have in common."""

    about: str = setting("what it is, in a few words for the pages", default="", max_length=80)
    arm: Name = setting("whose arm it is, one of physics.arms", default="paper")
    test: Annotated[tuple[TrialName, ...], Once] = setting("trials kept for testing; the others train", min_length=1)
    constants: dict[str, Real] = setting("known physical constants of the subject, {name: value}", "SI", dict)
    scatter: dict[str, Scatter] = setting(
        "constants that nobody measured on this subject, as in diagnosis.scatter and before it", default=dict
    )
    conditions: dict[TrialName, dict[str, Real]] = setting(
        "known constants that differ between trials, such as the load, {trial: {load: 2}}", "SI", dict, each="trial"
    )
    identify: dict[str, Identify] = setting(
        "physical constants to identify; where none are named, strength and length of each group of muscles, f0 and "
        "l0 of a muscle without one",
        default=force_and_length,
        each="constant",
    )
    changed: Changed | None = setting("what changed between these trials, to be found out; null asks nothing", "", None)


def role_problems(trials: Sequence[str], dataset: _Dataset, **others: Iterable[str]) -> Iterator[str]:
    """Trials that are named and not there, by key of the dataset, and that none is left to train on."""
    changed = (*dataset.changed.reference, *dataset.changed.against) if dataset.changed else ()
    named = {"test": dataset.test, "conditions": dataset.conditions, "changed": changed, **others}
    for key, names in named.items():
        if unknown := [name for name in names if name not in trials]:
            yield f"{key}: no trial named {', '.join(unknown)}; the trials are {', '.join(trials)}."
    if not set(trials) - set(dataset.test):
        yield f"test: every trial ({', '.join(trials)}) is a test trial; leave some to train on, or add recordings."


def _refuse(problems: Iterable[str]) -> None:
    if told := " ".join(problems):
        raise ValueError(told)


class SimulatedDataset(_Dataset):
    """Trials made by the physics with a random EMG; the truth is known."""

    kind: Literal["simulated"] = setting("simulated: made by the physics")
    trials: Whole = setting("number of trials, named 1, 2, ...", "-", 5, ge=2, le=1000)
    samples: Whole = setting("samples in a trial", "-", 500, ge=50, le=100_000)
    dt_s: Real = setting("time between samples; the paper's beta = dt^2/I = 1e-3", "s", 0.0316227766, gt=0, le=0.1)
    start_rad: Real = setting("elbow angle at the start, at rest", "rad", math.pi / 6, ge=0.1, le=1.7)
    emg_noise: Real = setting("standard deviation of the noise on the driving EMG", "-", 0.1, ge=0, le=1)
    angle_noise_deg: Real = setting("standard deviation of the noise on the measured angle", "deg", 0.0, ge=0, le=30)
    seed: Whole = setting("seed of EMG and noise", "-", 1, ge=0)
    hidden_effect: dict[str, dict[str, Real]] = setting(
        "effects that only simulation and scoring may know, {effect: {parameter: value}}", "SI", dict, each="effect"
    )
    hidden_constants: dict[str, Real] = setting(
        "constants of the arm that made the data, where they differ from the model's and nobody knows it", "SI", dict
    )
    recorder_noise: Real = setting("noise on the recorded EMG that did not drive the arm, 1 SD", "-", 0.0, ge=0, le=1)

    @model_validator(mode="after")
    def _test_exists(self) -> "SimulatedDataset":
        _refuse(role_problems([str(i + 1) for i in range(self.trials)], self))
        return self


class _RealDataset(_Dataset):
    """What all recordings have in common."""

    ignore_columns: tuple[str, ...] = setting(
        "columns of the files that are not needed; * stands for anything, and any other unused column is refused",
        default=(),
    )
    envelope_low_pass_hz: Real | None = setting(
        "corner of the low-pass that another program made EMG with which comes as envelope or fraction: no noise is in "
        "it above. null: not known, its noise counts as white",
        "Hz",
        None,
        gt=0,
        le=50,
    )


class MeasuredDataset(_RealDataset):
    """Trials from files, one file per trial, named after the file without its ending."""

    kind: Literal["measured"] = setting("measured: read from files")
    files: tuple[FilePath, ...] = setting(
        "CSV or Parquet files, or patterns such as data/me/*.csv, with columns time_s, emg_MUSCLE, angle_rad (or "
        "angle_deg) and, where it was measured, torque_Nm: of the muscles, without weight and inertia of the limb",
        min_length=1,
    )
    angle: TurnedAngle = setting("how the files count the elbow angle", default=TurnedAngle)
    # A recording like any other, whose EMG is an envelope on the angle's grid: no step of the processing is left to do.
    processing: ClassVar[Processing] = Processing()
    emg_start_offset_s: ClassVar[dict[str, float]] = {}
    mvc: ClassVar[tuple[str, ...]] = ()
    signals: ClassVar[dict[str, ExtraAngle]] = {}
    motor: ClassVar[RawMotor | None] = None


BY_TRIAL = ("cut_s", "recordings", "emg_start_offset_s")  # keys whose values are of a trial or a maximum, by name


class RecordedDataset(_RealDataset):
    """Trials from raw files as a recorder exports them: EMG in volts, angles, each with a clock of its own."""

    kind: Literal["recorded"] = setting("recorded: raw EMG and angles, processed here")
    trials: Annotated[tuple[TrialName, ...], Once] = setting("names, which stand for {trial} in files", min_length=2)
    mvc: Annotated[tuple[TrialName, ...], Once] = setting(
        "maximum contractions, recordings or trials that train: EMG of 1 is the largest envelope of a channel in them; "
        "where none are named, in the training trials",
        default=(),
    )
    recordings: dict[TrialName, RecordingName] = setting(
        "recording that a trial, or one in mvc, is or is a part of, where called otherwise, {trial: what stands for "
        "{trial} in files}",
        default=dict,
        each="trial",
    )
    emg: dict[ChannelName, EmgChannel] = setting("EMG channels; none where no muscles are", "", dict, each="channel")
    angle: RawAngle = setting("elbow angle; 0 hangs straight down, positive in flexion")
    signals: dict[ExtraName, ExtraAngle] = setting(
        "further angles over time, such as tilt_rad, the tilt of the upper arm", default=dict, each="signal"
    )
    torque: RawTorque | None = setting(
        "torque of the muscles about the elbow as a dynamometer measured it, flexing positive, weight and inertia of "
        "the limb taken out; null where none did",
        default=None,
    )
    motor: RawMotor | None = setting("known torque of a motor on the joint; null: none", default=None)
    keep: RawKeep | None = setting("part of all trials to keep, by a column's value; null: all", default=None)
    cut_s: dict[TrialName, tuple[Real, Real]] = setting(
        "part to keep of a trial, also of one in mvc, {trial: [from, to]} on the angle's clock: times as its file and "
        "all messages and pictures have them",
        "s",
        dict,
        each="trial",
    )
    emg_start_offset_s: dict[TrialName, EmgStartOffset] = setting(
        "the same as in `processing`, of trials in which it is another, also of one in mvc, {trial: time}",
        "s",
        dict,
        each="trial",
    )
    layout: TextLayout = setting("how CSV files are written", default=TextLayout)
    processing: Processing = setting("from raw EMG to excitation", default=Processing)

    @property
    def files(self) -> tuple[str, ...]:
        """Paths or patterns of all files that are named, each once."""
        each: list[RawSignal | None] = [*self.emg.values(), self.angle, *self.signals.values(), self.motor, self.keep]
        named = [(name, signal) for name in self.trials for signal in each]
        named += [(name, self.torque) for name in self.torque_trials]
        named += [(name, channel) for name in self.mvc for channel in self.emg.values()]
        files = (signal.file.replace(TRIAL, self.recordings.get(name, name)) for name, signal in named if signal)
        return tuple(dict.fromkeys(files))

    @property
    def torque_trials(self) -> tuple[str, ...]:
        """Names of the trials in which torque was measured."""
        if self.torque is None:
            return ()
        return self.trials if self.torque.trials is None else self.torque.trials

    def _overlap(self, one: str, other: str) -> bool:
        """Whether two recordings or trials hold EMG of one file and time."""
        channels, name = self.emg.values(), self.recordings.get
        files, others = ({c.file.replace(TRIAL, name(n, n)) for c in channels} for n in (one, other))
        (start, end), (first, last) = (self.cut_s.get(n, (-math.inf, math.inf)) for n in (one, other))
        return not files.isdisjoint(others) and start < last and first < end

    @model_validator(mode="after")
    def _roles_fit(self) -> "RecordedDataset":
        by_trial = {key: [name for name in getattr(self, key) if name not in self.mvc] for key in BY_TRIAL}
        _refuse(role_problems(self.trials, self, **by_trial, **{"torque.trials": self.torque_trials}))
        if wrong := [name for name, (start, end) in self.cut_s.items() if not start < end]:
            raise ValueError(f"cut_s of {', '.join(wrong)}: expected [from, to] in seconds, from before to")
        if leaks := [(one, test) for one in self.mvc for test in self.test if self._overlap(one, test)]:
            named = ", ".join(one if one == test else f"{one} with {test} in it" for one, test in leaks)
            raise ValueError(
                f"mvc names {named}, which tests: what counts as 1 would know it. Record maximum contractions of their "
                "own, name trials that train, or cut them apart by cut_s"
            )
        given = {signal.condition for signal in self.signals.values() if signal.condition}
        given |= {"motor"} if self.motor else set()
        if both := given & {name for values in self.conditions.values() for name in values}:
            raise ValueError(f"{', '.join(both)} is in conditions and also the condition of a signal; keep one")
        return self


Dataset = Annotated[SimulatedDataset | MeasuredDataset | RecordedDataset, Field(discriminator="kind")]


_WAVELETS = r"^(haar|db([1-9]|[12]\d|3[0-8])|sym([2-9]|1\d|20)|coif([1-9]|1[0-7]))$"


class Wavelet(Section):
    """The projection of the trials on coarser scales."""

    name: Annotated[str, Field(pattern=_WAVELETS)] = setting("orthogonal wavelet", "", "db2")
    levels: Whole = setting("how often the samples are coarsened: scales 0, -1, ..., -levels", "-", 4, ge=0, le=8)


class Data(Section):
    """Where trials come from, and how they are seen at coarser scales."""

    wavelet: Wavelet = setting("multi-resolution", default=Wavelet)
    datasets: dict[Name, Dataset] = setting("all datasets, by name", each="dataset", min_length=1)
    subjects: FilePath | None = setting(
        "CSV table of subjects, each row a measured dataset; `subjects` in targets stands for all", default=None
    )


HIDDEN = {"hidden_effect", "hidden_constants", "recorder_noise"}


def public(dataset: SimulatedDataset | MeasuredDataset | RecordedDataset) -> dict[str, Any]:
    """A dataset as plain data without what is hidden in it: all that a rule may know but simulation and scoring."""
    return dataset.model_dump(mode="json", exclude=HIDDEN)


def real_dataset(values: dict[str, Any]) -> MeasuredDataset | RecordedDataset:
    """A dataset of recordings from plain data, as a rule hands it to its script."""
    return (MeasuredDataset if values["kind"] == "measured" else RecordedDataset).model_validate(values)


def late_by(trial: str, settings: MeasuredDataset | RecordedDataset) -> float:
    """By how much the clock of a trial's EMG started after the angle's [s]."""
    return settings.emg_start_offset_s.get(trial, settings.processing.emg_start_offset_s)
