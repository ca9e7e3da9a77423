"""The question itself: candidates, what each would explain in the second group, and the control."""

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import torch
from joblib import Parallel, cpu_count, delayed, parallel_config
from numpy.typing import NDArray
from scipy.special import softmax

from myowave.data.trials import Array, Trials
from myowave.diagnosis.causes import CAUSE_TITLES, LIKELY, NAMED, SILENT
from myowave.diagnosis.changed.by_trial import ByTrial, Point
from myowave.diagnosis.changed.weigh import likeliest
from myowave.diagnosis.changed.windows import Groups, Windowed
from myowave.diagnosis.likelihood.algebra import fewest
from myowave.identification.record import make_record
from myowave.physics.constants import MUSCLE_CONSTANTS
from myowave.physics.effect import Acting, Effect, Parameter
from myowave.physics.model import Model
from myowave.settings import Scatter
from myowave.settings.data import Changed

SIDE_BY_SIDE = 4  # processes: the slowest effect takes a fourth of all, and each has half a gigabyte of libraries
# ASSUME: bones and fibres stay as they are, and what inertia is added weighs
UNCHANGING = ("path", "muscle", "inertia")
# What EMG says of how a muscle is excited, which placing electrodes anew changes. A contraction that no electrode
# records is crosstalk with its sign turned.
OF_ELECTRODES = ("emg_gain", "emg_offset", "emg_crosstalk", "co_contraction", "activation_shape")

# adequate (nothing changed), effect (this did), class (one of these did), undecidable (something may have)
Verdict = Literal["adequate", "effect", "class", "undecidable"]


@dataclass(frozen=True)
class Change:
    """A candidate: one number that is 0 in the first group."""

    effect: str  # its name, and `title` for people
    title: str
    parameters: tuple[str, ...]  # of the effect, which all take the value
    electrode: str  # whose muscles they are of; empty for all
    unit: str
    # low, high: bounds of the value
    low: float
    high: float
    typical: float
    value: float = 0.0  # most likely, and the bounds of an interval that holds it with probability .95
    interval: tuple[float, float] = (0.0, 0.0)
    # changed, anyway: log evidence that the groups differ, and that trials do whatever their group, over that of no
    # difference
    changed: float = -math.inf
    anyway: float = -math.inf
    probability: float = 0.0  # among all candidates and no change


@dataclass(frozen=True)
class Family:
    """What candidates say: all, the likeliest first, and the probability that none is right and nothing has changed."""

    changes: tuple[Change, ...]
    unchanged: float

    @classmethod
    def of(cls, found: Sequence[Change]) -> "Family":
        """Beforehand that nothing changed is as likely as that something did, and each effect as the next; where
        nothing changed, that trials differ nevertheless is as likely as that they do not."""
        count = Counter(c.effect for c in found)
        share = np.log([1 / len(count) / count[c.effect] for c in found])
        anyway, changed = (share + [getattr(c, name) for c in found] for name in ("anyway", "changed"))
        probability = softmax(np.concatenate([[0.0], anyway, changed + math.log(2)]))
        unchanged, of_changes = np.split(probability, [1 + len(found)])
        judged = (replace(c, probability=float(p)) for c, p in zip(found, of_changes, strict=True))
        return cls(tuple(sorted(judged, key=lambda c: -c.probability)), float(unchanged.sum()))

    @property
    def names(self) -> tuple[str, ...]:
        """The fewest effects that hold what changed with probability `NAMED`; none where nothing may have changed."""
        if not self.changes or self.unchanged > 1 - NAMED:
            return ()
        share: dict[str, float] = defaultdict(float)
        for change in self.changes:
            share[change.effect] += change.probability
        return fewest(share, NAMED * (1 - self.unchanged))

    @property
    def likeliest(self) -> tuple[str, ...]:
        """The likeliest change where something may have changed; none where most likely nothing has."""
        return () if self.unchanged > LIKELY else (self.changes[0].effect,)

    @property
    def verdict(self) -> Verdict:
        return _verdict(self.names, self.likeliest)


@dataclass(frozen=True)
class Answered:
    """The answer, and that to the same question where nothing has changed.

    A muscle that gives more torque for the same EMG, a lighter load and an electrode that reports less are alike as far
    as torque says, so what electrodes report is weighed apart from the rest, and stands beside it where both explain.
    """

    groups: Changed
    arm: Family  # changes of the arm, its load and its sensors
    electrodes: Family | None  # changes of what electrodes report; None where they stayed on
    control: Family | None  # of the arm in the first group, split in two; None where it has but one trial
    silent: tuple[Change, ...]  # at most one: electrodes that report nothing in a group; the rest is weighed without
    left_out: Mapping[str, str]  # effects that were not weighed, {name: title}
    known: tuple[str, ...]  # conditions that are known and differ: what a model says of these may be wrong, too

    @property
    def families(self) -> tuple[Family, ...]:
        return (self.arm,) if self.electrodes is None else (self.arm, self.electrodes)

    @property
    def names(self) -> tuple[str, ...]:
        """What changed, or the class of effects that may be it; none where nothing did, or nobody can tell. Where the
        arm seems to have changed and the electrodes may have, or the other way round, either may be it."""
        weighed = [family.names for family in self.families]
        if any(weighed):
            weighed = [names or family.likeliest for names, family in zip(weighed, self.families, strict=True)]
        of_arm, *of_electrodes = weighed
        return (*(c.effect for c in self.silent), *of_arm, *(names[0] for names in of_electrodes if names))

    @property
    def verdict(self) -> Verdict:
        return _verdict(self.names, [name for family in self.families for name in family.likeliest])

    @property
    def changes(self) -> tuple[Change, ...]:
        """All that were weighed, the likeliest first."""
        weighed = (change for family in self.families for change in family.changes)
        return self.silent + tuple(sorted(weighed, key=lambda c: -c.probability))

    def of(self, name: str) -> Change:
        """The likeliest change by an effect."""
        return next(c for c in self.changes if c.effect == name)


def _verdict(names: Sequence[str], likely: Sequence[str]) -> Verdict:
    if names:
        return "effect" if len(names) == 1 else "class"
    return "undecidable" if likely else "adequate"


def what_changed(
    trials: Trials,
    base: Model,
    effects: Iterable[Effect],
    groups: Changed,
    scatter: Mapping[str, Scatter],
    report: Callable[[str], None] = lambda line: None,
    workers: int = 1,
) -> Answered:
    """Ask what changed between two groups of trials.

    Args:
        base: the model of the arm; of its muscles only delay, shape and electrodes count.
        groups: names of their trials, and whether gains, offsets and crosstalk of the EMG are known to be the same.
        scatter: standard deviations of what nobody measured.
        workers: processes that weigh effects side by side, at most one for each core.

    Raises:
        ValueError: if a trial is not there or too short, or a muscle's channel was not recorded or reports nothing in
            one group, and so no muscle is left.
    """
    both = replace(trials.select((*groups.reference, *groups.against)), test=())
    second = np.array([name in groups.against for name in both.names])
    silent = [c for c in base.channels if _silent(both, c, second) or _silent(both, c, ~second)]
    base = replace(base, muscles=tuple(m for m in base.muscles if m.channel not in silent))
    if not base.muscles:
        raise ValueError(
            f"{', '.join(silent)}: found no EMG in one of the groups; expected a muscle that both recorded."
            if silent
            else "an arm without muscles: found no EMG; expected a muscle. Diagnose each group as a dataset of its own."
        )
    recorded = Groups(make_record(both, base), second, base, scatter)
    effects = list(effects)
    weighable = [e for e in effects if _weighable(base, e)]
    of_arm = [e for e in weighable if e.name not in OF_ELECTRODES]
    asked = of_arm if groups.electrodes_stayed else weighable
    found = _ask(recorded, asked, report, workers)
    control = None
    if len(groups.reference) > 1:
        report("control: the first group, split in two")
        first = range(len(groups.reference))
        control = Family.of(_ask(recorded.take(first, first[1::2]), of_arm, report, workers))
    of_electrodes = [c for c in found if c.effect in OF_ELECTRODES]
    return Answered(
        groups=groups,
        arm=Family.of([c for c in found if c.effect not in OF_ELECTRODES]),
        electrodes=None if groups.electrodes_stayed else Family.of(of_electrodes),
        control=control,
        silent=(_lost(silent),) if silent else (),
        left_out={e.name: e.title for e in effects if e not in asked},
        known=tuple(recorded.known),
    )


def _silent(trials: Trials, channel: str, group: NDArray[np.bool_]) -> bool:
    """Whether an electrode reports nothing in a group: its EMG varies by less there than in the lower half of what each
    trial of the others has."""
    # ASSUME: movements are alike, so no muscle rests through all trials of one group alone.
    emg = trials.emg[..., trials.channels.index(channel)]
    whole = [float(np.ptp(e[:n])) for e, n in zip(emg, trials.lengths, strict=True)]
    lower = [float(np.median(e[:n]) - e[:n].min()) for e, n in zip(emg, trials.lengths, strict=True)]
    return max(np.compress(group, whole)) < min(np.compress(~group, lower))


def _lost(channels: Sequence[str]) -> Change:
    """Electrodes that report nothing: their gains are less by all of it."""
    title = f"{CAUSE_TITLES[SILENT]}: {', '.join(channels)}"
    names = tuple(f"{SILENT}.{channel}" for channel in channels)
    return Change(SILENT, title, names, ", ".join(channels), "-", -1.0, 0.0, 1.0, -1.0, (-1.0, -1.0), probability=1.0)


def _weighable(model: Model, effect: Effect) -> bool:
    """Whether windows of torque show an effect of a model: it acts on the joint, on what drives the muscles or on the
    sensor, has no states, and asks nothing of how strong the muscles are, which both groups share."""
    of_drive = {"delay", "shape", "excitation", "side"}
    of_muscles = (set(MUSCLE_CONSTANTS) | {"torque", "activation", "curves"}) - of_drive
    shown = not effect.stateful and effect.acts_on not in UNCHANGING and not effect.asks & of_muscles
    return shown and not model.refuses(effect) and (effect.acts_on != "observation" or _reports_all_alike(effect))


def _reports_all_alike(effect: Effect) -> bool:
    """Whether a sensor reports fast motions as it does slow ones, but for when, and late ones as early ones. What
    others do to the errors between windows, fast or slow, nobody knows, and an evidence hangs on it; and what grows
    along a trial is no difference between trials."""
    time, sizes, early, late = torch.arange(400, dtype=torch.float64) / 100, [], slice(20, 180), slice(220, 380)
    values = {name: torch.tensor(p.typical, dtype=torch.float64) for name, p in effect.parameters.items()}
    acting = Acting(effect, values)
    for turning in (math.pi, 4 * math.pi):  # rad/s: 0.5 and 2 Hz, as elbows move
        q, qdot = torch.sin(turning * time), turning * torch.cos(turning * time)
        reported = acting({"q": q, "qdot": qdot, "dt": 0.01, "begin": time[:1]})
        if not torch.allclose(reported[early], reported[late], atol=1e-3):  # a period apart, or four
            return False
        sizes.append(float(reported.std()))
    return math.isclose(*sizes, rel_tol=0.01)


def _candidates(model: Model, effect: Effect) -> list[Change]:
    """The changes that an effect of a model stands for: each of its parameters that acts alone, those of muscles for
    each electrode and for all alike."""
    found = []
    for short, parameter in effect.parameters.items():
        if not parameter.alone:
            continue
        names = model.names(effect, short)
        if parameter.each:
            for channel in model.channels:
                own = [n for n, m in zip(names, model.muscles, strict=True) if m.channel == channel]
                found.append(_change(effect, own, channel, parameter))
        if not parameter.each or len(model.channels) > 1:
            found.append(_change(effect, names, "", parameter))
    return found


def _change(effect: Effect, names: Sequence[str], electrode: str, p: Parameter) -> Change:
    # ASSUME: an effect that is there or not may be there in the first group alone as well.
    low = p.low if p.low < 0 else -p.high
    high = p.high if p.high > 0 else -p.low
    return Change(effect.name, effect.title, tuple(dict.fromkeys(names)), electrode, p.unit, low, high, abs(p.typical))


def _ask(groups: Groups, effects: Sequence[Effect], report: Callable[[str], None], workers: int) -> list[Change]:
    """The candidates of some effects, with what they explain."""
    nothing = Point(np.zeros(len(groups.second)), groups.plain, likeliest(groups.plain, {}))
    sizes = ", ".join(f"{name} {size:.3g}" for name, size in nothing.state.sizes.items())
    report(f"nothing changed: {nothing.state.value:.1f} nats, {sizes}")
    found = []
    weighed = (delayed(_weighed)(groups, nothing, effect) for effect in effects)
    with parallel_config("loky", inner_max_num_threads=1):  # a job of Snakemake else gives each process all its cores
        for changes in Parallel(min(workers, cpu_count()), return_as="generator")(weighed):
            for change, values in changes:
                low, high = change.interval
                report(
                    f"{change.effect} {change.electrode}: changed {change.changed:.1f} nats, trials differ "
                    f"{change.anyway:.1f}; {change.value:.3g} ({low:.3g} to {high:.3g}) {change.unit}; {values}"
                )
                found.append(change)
    return found


def _weighed(groups: Groups, nothing: Point, effect: Effect) -> list[tuple[Change, Array]]:
    """The candidates of an effect with what they explain, and their values in each trial."""
    second, found = groups.second.astype(float), []
    known = np.reshape([*groups.known.values()], (-1, len(second))).T
    for c in _candidates(groups.base.with_effects([effect]), effect):

        def windows(values: Array, c: Change = c) -> Windowed:
            return groups.windows(effect, c.parameters, values * c.typical)

        by_trial = ByTrial(windows, c.low / c.typical, c.high / c.typical, nothing)
        differing = by_trial.differing(second, known)
        value, low, high = (share * c.typical for share in differing.change)
        change = replace(c, value=value, interval=(low, high), changed=differing.changed, anyway=differing.anyway)
        found.append((change, np.round(differing.values * c.typical, 3)))
    return found
