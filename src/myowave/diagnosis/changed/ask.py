"""The question itself: candidates, what each would explain in the second group, and the control."""

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from myowave.data.trials import Trials
from myowave.diagnosis.causes import CAUSE_TITLES, SILENT
from myowave.diagnosis.changed.weigh import Weighing
from myowave.diagnosis.changed.windows import Groups, electrodes
from myowave.diagnosis.likelihood.algebra import COST, fewest
from myowave.identification.record import make_record
from myowave.physics.constants import MUSCLE_CONSTANTS
from myowave.physics.effect import Effect, Parameter
from myowave.physics.model import Model
from myowave.settings import Scatter

SURE = 0.98  # of what is said
USUAL = 3.0  # ASSUME: changes are about as large as this many times a strength of practical interest
FIRST = (0.25, 1.0)  # strengths of practical interest, of either sign, that are tried first
HOPELESS = 1.0  # nats: what explains less with all else as it was is not looked at more closely
FALLEN = 8.0  # nats below the best value, where nothing is left of a posterior
MOST = 12  # values of a change that are tried from its best one on
UNCHANGING = (
    "path",
    "muscle",
    "inertia",
)  # ASSUME: bones and fibres stay as they are, and what inertia is added weighs
# What EMG says of how a muscle is excited, which placing electrodes anew changes. A contraction that no electrode
# records is crosstalk with its sign turned.
OF_ELECTRODES = ("emg_gain", "emg_offset", "emg_crosstalk", "co_contraction", "activation_shape")


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
    nats: float = -math.inf  # log evidence less that of no change
    probability: float = 0.0  # among all candidates and no change


Seen = tuple[Change, dict[float, float]]
"""A candidate with log likelihoods over that of no change, by its value."""


@dataclass(frozen=True)
class Family:
    """What candidates say: all, the likeliest first, and the probability that none is right and nothing has changed."""

    changes: tuple[Change, ...]
    unchanged: float

    @property
    def names(self) -> tuple[str, ...]:
        """The fewest effects that hold what changed with probability `SURE`; none where nothing may have changed."""
        if not self.changes or self.unchanged > 1 - SURE:
            return ()
        share: dict[str, float] = defaultdict(float)
        for change in self.changes:
            share[change.effect] += change.probability
        return fewest(share, SURE * (1 - self.unchanged))


@dataclass(frozen=True)
class Answered:
    """The answer, and that to the same question where nothing has changed.

    A muscle that gives more torque for the same EMG, a lighter load and an electrode that reports less are alike as far
    as torque says, so what electrodes report is weighed apart from the rest, and stands beside it where both explain.
    """

    reference: tuple[str, ...]
    against: tuple[str, ...]
    arm: Family  # changes of the arm, its load and its sensors
    electrodes: Family | None  # changes of what electrodes report; None where they stayed on
    control: Family | None  # of the arm in the first group, split in two; None where it has but one trial
    scale: float  # what log likelihoods were divided by, as the control asks for it
    silent: tuple[Change, ...]  # at most one: electrodes that report nothing in a group; the rest is weighed without
    left_out: tuple[str, ...]  # effects that were not weighed

    @property
    def names(self) -> tuple[str, ...]:
        """What changed, or the class of effects that may be it; none where nothing did."""
        of_electrodes = () if self.electrodes is None else self.electrodes.names[:1]
        return tuple(c.effect for c in self.silent) + self.arm.names + of_electrodes

    def of(self, name: str) -> Change:
        """The likeliest change by an effect."""
        changes = self.silent + self.arm.changes + (() if self.electrodes is None else self.electrodes.changes)
        return max((c for c in changes if c.effect == name), key=lambda c: c.probability)


def what_changed(
    trials: Trials,
    base: Model,
    effects: Iterable[Effect],
    reference: Sequence[str],
    against: Sequence[str],
    scatter: Mapping[str, Scatter],
    *,
    electrodes_stayed: bool = False,
    report: Callable[[str], None] = lambda line: None,
) -> Answered:
    """Ask what changed between two groups of trials.

    Args:
        base: the model of the arm; of its muscles only delay, shape and electrodes count.
        reference, against: names of the trials of the first and the second group.
        scatter: standard deviations of what nobody measured.
        electrodes_stayed: whether gains, offsets and crosstalk of the EMG are known to be the same.

    Raises:
        ValueError: if a trial is not there or too short, or a muscle's channel was not recorded or reports nothing in
            one group, and so no muscle is left.
    """
    both = replace(trials.select((*reference, *against)), test=())
    second = np.array([name in against for name in both.names])
    silent = [c for c in electrodes(base) if _silent(both, c, second) or _silent(both, c, ~second)]
    base = replace(base, muscles=tuple(m for m in base.muscles if m.channel not in silent))
    if not base.muscles:
        raise ValueError(
            f"{', '.join(silent)}: found no EMG in one of the groups; expected a muscle that both recorded."
        )
    groups = Groups(make_record(both, base), second)
    effects = list(effects)
    left_out = tuple(e.name for e in effects if not _weighable(base, e))
    families: dict[bool, list[Effect]] = {False: [], True: []}
    for effect in effects:
        if _weighable(base, effect) and not (electrodes_stayed and effect.name in OF_ELECTRODES):
            families[effect.name in OF_ELECTRODES].append(effect)
    found = {which: _ask(groups, base, family, scatter, report) for which, family in families.items()}
    control: list[Seen] = []
    if len(reference) > 1:
        report("control: the first group, split in two")
        first = range(len(reference))
        control = _ask(groups.take(first, first[1::2]), base, families[False], scatter, report)
    # ASSUME: where nothing has changed no candidate gains more than a cause costs; what one gains nevertheless says how
    # much too sure the model of what trials share is, and all is scaled by it.
    scale = max([1.0, *(_posterior(change, seen, 1.0).nats / COST for change, seen in control)])
    return Answered(
        reference=tuple(reference),
        against=tuple(against),
        arm=_answer(found[False], scale),
        electrodes=None if electrodes_stayed else _answer(found[True], scale),
        control=_answer(control, scale) if len(reference) > 1 else None,
        scale=scale,
        silent=(_lost(silent),) if silent else (),
        left_out=left_out,
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
    return Change(SILENT, title, names, ", ".join(channels), "-", -1.0, 0.0, 1.0, -1.0, (-1.0, -1.0), 0.0, 1.0)


def _weighable(model: Model, effect: Effect) -> bool:
    """Whether windows of torque show an effect of a model: it acts on the joint, on what drives the muscles or on the
    sensor, has no states, and asks nothing of how strong the muscles are, which both groups share."""
    of_drive = {"delay", "shape", "excitation", "side"}
    of_muscles = (set(MUSCLE_CONSTANTS) | {"torque", "activation", "curves"}) - of_drive
    shown = not effect.stateful and effect.acts_on not in UNCHANGING and not effect.asks & of_muscles
    return shown and not model.refuses(effect)


def _candidates(model: Model, effect: Effect) -> list[Change]:
    """The changes that an effect of a model stands for: each of its parameters, those of muscles for each electrode
    and for all alike."""
    found = []
    for short, parameter in effect.parameters.items():
        names = tuple(model.names(effect, short))
        if parameter.per_muscle:
            for channel in electrodes(model):
                own = tuple(n for n, m in zip(names, model.muscles, strict=True) if m.channel == channel)
                found.append(_change(effect, own, channel, parameter))
        if not parameter.per_muscle or len(electrodes(model)) > 1:
            found.append(_change(effect, names, "", parameter))
    return found


def _change(effect: Effect, names: tuple[str, ...], electrode: str, p: Parameter) -> Change:
    # ASSUME: an effect that is there or not may be there in the first group alone as well.
    low = p.low if p.low < 0 else -p.high
    title = effect.title or effect.name.replace("_", " ")
    return Change(effect.name, title, names, electrode, p.unit, low, p.high if p.high > 0 else -p.low, abs(p.typical))


def _ask(
    groups: Groups,
    base: Model,
    effects: Sequence[Effect],
    scatter: Mapping[str, Scatter],
    report: Callable[[str], None],
) -> list[Seen]:
    errors = {name: scatter[name].absolute for name in ("shape", "delay") if name in scatter}
    plain = groups.windows(base, {}, errors)
    weighing = Weighing(plain.by_drive)
    nothing, sizes = weighing.weigh(plain, {})
    report(f"nothing changed: {nothing:.1f} nats, " + ", ".join(f"{k} {v:.3g}" for k, v in sizes.items()))
    found = []
    for effect in effects:
        model = base.with_effects([effect])
        for candidate in _candidates(model, effect):
            seen = _weigh(groups, model, candidate, weighing, nothing, sizes)
            found.append((candidate, seen))
            change = _posterior(candidate, seen, 1.0)
            low, high = change.interval
            report(
                f"{effect.name} {change.electrode}: {change.nats:.1f} nats, "
                f"{change.value:.3g} ({low:.3g} to {high:.3g}) {change.unit}"
            )
    return found


def _answer(found: Sequence[Seen], scale: float) -> Family:
    """Probabilities: nothing changed is as likely beforehand as that something did, and each effect as the next.

    Args:
        scale: what log likelihoods are divided by.
    """
    changes = [_posterior(change, seen, scale) for change, seen in found]
    count = Counter(c.effect for c in changes)
    beforehand = [math.log(0.5 / len(count) / count[c.effect]) for c in changes]
    weights = np.array([math.log(0.5), *(c.nats + p for c, p in zip(changes, beforehand, strict=True))])
    probability = np.exp(weights - weights.max())
    probability /= probability.sum()
    judged = (replace(c, probability=float(p)) for c, p in zip(changes, probability[1:], strict=True))
    return Family(tuple(sorted(judged, key=lambda c: -c.probability)), float(probability[0]))


def _weigh(
    groups: Groups, model: Model, change: Change, weighing: Weighing, nothing: float, sizes: Mapping[str, float]
) -> dict[float, float]:
    """Log likelihoods of a change over that of none: values are tried about the best until nothing is left beyond."""
    seen: dict[float, float] = {0.0: 0.0}

    def nats(value: float, *, tune: bool = True) -> float:
        windowed = groups.windows(model, dict.fromkeys(change.parameters, value))
        return weighing.weigh(windowed, sizes, tune=tune)[0] - nothing

    step = change.typical
    tried = [sign * strength * step for strength in FIRST for sign in (1.0, -1.0)]
    tried = [value for value in tried if change.low <= value <= change.high]
    first = {value: nats(value, tune=False) for value in tried}
    best = max(first, key=lambda v: first[v])
    if first[best] < HOPELESS:
        seen |= first
    else:
        seen[best] = nats(best)
        for _ in range(MOST):
            value = _next(seen, change)
            if value is None:
                break
            seen[value] = nats(value)
    return seen


def _next(seen: Mapping[float, float], change: Change) -> float | None:
    """The value to try next: beyond the best as far as it pays, then where the curve about the best is coarse."""
    values = sorted(seen)
    top = max(seen.values())
    at = max(range(len(values)), key=lambda i: seen[values[i]])
    for sign, end in ((1, values[-1]), (-1, values[0])):
        limit = change.high if sign > 0 else change.low
        if seen[end] > top - FALLEN and abs(end - limit) > 1e-9 * change.typical:
            further = end + sign * max(abs(end - values[-2 if sign > 0 else 1]), 0.25 * change.typical)
            return min(further, limit) if sign > 0 else max(further, limit)
    gaps = [
        (abs(seen[a] - seen[b]) + 1) * (b - a)
        for a, b in zip(values[:-1], values[1:], strict=True)
        if max(seen[a], seen[b]) > top - FALLEN
    ]
    near = [(a, b) for a, b in zip(values[:-1], values[1:], strict=True) if max(seen[a], seen[b]) > top - FALLEN]
    a, b = near[int(np.argmax(gaps))]
    if max(gaps) < 0.3 * (values[min(at + 1, len(values) - 1)] - values[max(at - 1, 0)]):
        return None
    return (a + b) / 2


def _posterior(change: Change, seen: Mapping[float, float], scale: float) -> Change:
    """Evidence and interval of a change whose log likelihood is known at some values, N(0, `USUAL` typical) before."""
    values = np.array(sorted(seen))
    curve = PchipInterpolator(values, [seen[v] / scale for v in values])
    grid = np.linspace(values[0], values[-1], 2001)
    deviation = USUAL * change.typical
    log = curve(grid) - 0.5 * (grid / deviation) ** 2 - math.log(deviation * math.sqrt(2 * math.pi))
    density = np.exp(log - log.max())
    mass = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(grid))])
    low, high = np.interp([0.025, 0.975], mass / mass[-1], grid)
    return replace(
        change,
        value=float(grid[int(np.argmax(log))]),
        interval=(float(low), float(high)),
        nats=float(log.max() + math.log(mass[-1])),
    )
