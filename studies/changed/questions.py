"""Questions whose answers are known: of a person, whose dumbbell and electrodes are known, and of simulated arms.

What was done stands here, and only grades read it; the diagnosis gets trials, groups and a model.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from myowave.data.simulate import simulate_trials
from myowave.data.trials import Trials
from myowave.physics.curves import DEGROOTE, MILLARD, Curves
from myowave.physics.model import Model
from myowave.settings import SimulatedDataset
from myowave.settings.data import Changed
from studies.shared import low_pass, put_in

PERSON = "a person"
LIGHT = ("load2.75_1", "load2.75_2", "load2.75_3")  # trials of `human_curls`
HEAVY = ("load5.5_1", "load5.5_2", "load5.5_3")
LESS, MORE = 1.25, 2.5  # kg in the hand
FEW = "1.25 kg more, one trial on a side"
LOAD, LEAN, GAIN = frozenset({"hand_load"}), frozenset({"gravity_tilt"}), frozenset({"emg_gain"})
LATE = frozenset({"extra_delay", "clock_shift"})  # torque says the same of both
FIRST, SECOND = ("1", "2", "3"), ("4", "5", "6")  # trials of an arm
DT_S = 10**-1.5


@dataclass(frozen=True)
class Arm:
    """A simulated arm and its recorder."""

    curves: Curves | None = None  # those of the model where it has none of its own
    noise: float = 0.0  # of the EMG
    edge_hz: float | None = None  # of a filter of the angle


ARMS = {  # with Thelen's curves no draw keeps this arm within its range
    "as the model": Arm(),
    "EMG with noise of 0.02": Arm(noise=0.02),
    "angle behind a filter of 6 Hz": Arm(edge_hz=6.0),
    "Millard's muscle curves": Arm(MILLARD),
    "De Groote's muscle curves": Arm(DEGROOTE),
    "Millard's curves, noisy EMG and the filter": Arm(MILLARD, noise=0.02, edge_hz=6.0),
}


@dataclass(frozen=True)
class Question:
    """Groups of trials, and what was done to the second."""

    of: str  # a person, or one of `ARMS`
    done: str
    groups: Changed
    truth: frozenset[str] = frozenset()  # effects of which each says it; none where nothing changed
    size: float | None = None  # how much more there is in the second group, in the unit of the effect
    told_kg: float | None = None  # load that is told of all trials instead of the true one
    # factor on the EMG of the second group, how much later it comes [s], and channels of that, all where none is named
    gain: float = 1.0
    late_s: float = 0.0
    channels: tuple[str, ...] = ()
    seed: int = 0  # of an arm


def of_person() -> Iterator[Question]:
    """Every question that three trials of each load allow."""
    four = [*product(combinations(LIGHT, 2), combinations(HEAVY, 2)), (LIGHT, HEAVY)]
    for light, heavy in four:
        yield Question(PERSON, "1.25 kg more", _groups(light, heavy), LOAD, MORE - LESS, told_kg=LESS)
        yield Question(PERSON, "1.25 kg less", _groups(heavy, light), LOAD, LESS - MORE, told_kg=MORE)
    for few, many in ((1, 1), (1, 2), (1, 3), (2, 1), (3, 1)):
        yield Question(PERSON, FEW, _groups(LIGHT[:few], HEAVY[:many]), LOAD, MORE - LESS, told_kg=LESS)
    for group in (LIGHT, HEAVY):
        for one in group:
            yield Question(PERSON, "nothing", _groups([t for t in group if t != one], [one]))
    for one, other in combinations(product(LIGHT, HEAVY), 2):
        if one[0] != other[0] and one[1] != other[1]:
            yield Question(PERSON, "nothing", _groups(one, other))
    (light, heavy), alike = four[0], ((LIGHT[0], HEAVY[0]), (LIGHT[1], HEAVY[1]))
    for gain, (first, second) in product((1.2, 1.5), ((LIGHT[::2], LIGHT[1:2]), alike)):
        yield Question(PERSON, f"EMG times {gain}", _groups(first, second, stayed=False), GAIN, gain=gain)
    for late, (first, second) in product((0.04, 0.1), (alike, (light, heavy), (LIGHT, HEAVY))):
        yield Question(PERSON, f"EMG {1000 * late:.0f} ms late", _groups(first, second), LATE, -late, late_s=late)
    for channel in ("emg_biceps", "emg_triceps", "emg_brachioradialis"):
        groups, truth = _groups(light, heavy, stayed=False), frozenset({"silent_electrode"})
        yield Question(PERSON, "EMG of one electrode put to 0", groups, truth, gain=0.0, channels=(channel,))


def of_arms(seed: int, draws: int) -> Iterator[Question]:
    """Every change of every arm, in draws from a seed on."""
    stayed, anew, late = _groups(FIRST, SECOND), _groups(FIRST, SECOND, stayed=False), 2 * DT_S
    for arm, draw in product(ARMS, range(seed, seed + draws)):
        yield Question(arm, "0.4 kg more", stayed, LOAD, 0.4, seed=draw)
        yield Question(arm, "0.3 rad more lean", stayed, LEAN, 0.3, seed=draw)
        yield Question(arm, "nothing", stayed, seed=draw)
        yield Question(arm, "EMG 63 ms late", stayed, LATE, -late, late_s=late, seed=draw)
        yield Question(
            arm, "EMG of the biceps times 1.4", anew, GAIN, 1 / 1.4 - 1, gain=1.4, channels=("emg_biceps",), seed=draw
        )


def _groups(first: Iterable[str], second: Iterable[str], stayed: bool = True) -> Changed:
    return Changed.model_validate({"reference": [*first], "against": [*second], "electrodes_stayed": stayed})


def trials_of(question: Question, person: Trials, base: Model) -> Trials:
    """What the diagnosis gets: the person's trials, or those of an arm that is built on a base model."""
    trials = person if question.of == PERSON else _of_arm(question, base)
    if question.told_kg is not None:
        told = {name: {**trials.conditions.get(name, {}), "load": question.told_kg} for name in trials.names}
        trials = replace(trials, conditions=told)
    return put_in(trials, question.groups.against, question.channels, question.gain, question.late_s)


def _of_arm(question: Question, base: Model) -> Trials:
    """Trials of an arm, simulated and recorded, without a word of what differs in the second group."""
    arm, random = ARMS[question.of], np.random.default_rng(question.seed)
    hidden = {LOAD: "load", LEAN: "tilt"}.get(question.truth)
    settings = SimulatedDataset(
        kind="simulated",
        trials=len(FIRST + SECOND),
        samples=600,
        test=SECOND[-1:],
        seed=question.seed,
        dt_s=DT_S,
        angle_noise_deg=0.3,
        conditions={} if hidden is None else dict.fromkeys(SECOND, {hidden: question.size}),
    )
    model = base if arm.curves is None else replace(base, curves=arm.curves)
    trials = simulate_trials("arm", settings, model, {})[0]
    emg = trials.emg + arm.noise * random.standard_normal(trials.emg.shape)
    angle = trials.angle if arm.edge_hz is None else low_pass(trials.angle, arm.edge_hz, trials.dt)
    return replace(trials, emg=emg.clip(0.0), angle=angle, conditions={})
