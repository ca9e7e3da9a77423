"""Cases of the study: which effect is hidden in which world, of which strength, and the trials that come of it.

A case is one dataset. What was hidden is known here and to `make_trials` only.
"""

import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch

from myowave.data.simulate import simulate_trials
from myowave.data.trials import Trials
from myowave.physics.effect import Effect
from myowave.physics.model import Model
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation, channels_of
from myowave.settings import SimulatedDataset
from studies.verdicts import mujoco_arm, simulator
from studies.verdicts.worlds import FINER, NOISES, World, record, sample_and_hold

SETS = {  # of each world in a draw: with a hidden effect, and without any
    "as_assumed": (4, 3),
    "other_curves": (4, 3),
    "other_constants": (3, 2),
    "other_sensors": (4, 9),  # one of each sensor
    "other_solver": (2, 1),
    "outside": (5, 0),
    "all_at_once": (4, 3),
    "other_simulator": (5, 5),
    "mujoco": (5, 3),
}
SIMULATORS = {"other_simulator": simulator, "mujoco": mujoco_arm}
STRENGTHS = (0.5, 1.0)  # see `hidden_values`
NOISE_DEG, NOISES_DEG = 1.0, (0.3, 1.0, 3.0)  # of the angle; of the world that is as assumed in turn
TURNS, SEEDS = 1000, 10_000  # of an attempt and of a draw: more than a world has cases


@dataclass(frozen=True)
class Case:
    """A dataset of the study."""

    world: str  # one of `worlds.WORLDS`
    hidden: Mapping[str, Mapping[str, float]]  # effects with their parameters by short name
    taken_out: tuple[str, ...]  # effects that the catalogue lacks
    draw: int  # seed; with the number of the case in its world it decides all that is drawn
    turn: int
    strength: float  # of the hidden effects, see `hidden_values`
    noise_deg: float  # of the angle
    attempt: int = 0  # others are drawn where no EMG keeps the arm in range

    @property
    def values(self) -> dict[str, float]:
        """Of the parameters of the hidden effects, by full name."""
        return {f"{effect}.{p}": value for effect, values in self.hidden.items() for p, value in values.items()}

    @property
    def label(self) -> str:
        return "+".join(self.hidden) or "none"

    @property
    def name(self) -> str:
        """Of a file."""
        return f"{self.draw}-{self.world}-{'' if self.hidden else 'clean-'}{self.turn:03}"

    @property
    def seed(self) -> int:
        """Of the trials."""
        return self.draw * SEEDS + self.attempt * TURNS + self.turn

    @property
    def random(self) -> np.random.Generator:
        """What is drawn for this case only, so that cases are independent."""
        return np.random.default_rng([self.seed, zlib.crc32(f"{self.world} {self.label}".encode())])


def list_cases(base: Model, catalogue: Mapping[str, Effect], draw: int) -> Iterator[Case]:
    """All cases of a draw: in each world effects in an order of its own, with strengths and noises that go round, and
    sets without any effect."""
    possible = [name for name, effect in catalogue.items() if not base.refuses(effect)]
    for world, (hidden, clean) in SETS.items():
        choice = [name for name in possible if name in (SIMULATORS[world].EFFECTS if world in SIMULATORS else possible)]
        order = np.random.default_rng([draw, zlib.crc32(world.encode())]).permutation(choice)
        noises = NOISES_DEG if world == "as_assumed" else (NOISE_DEG,)
        for i in range(hidden):
            chosen = [str(order[i % len(order)])]
            out = tuple(chosen) if world == "outside" or (world == "all_at_once" and i % 2) else ()
            if world == "outside" and i % 2:  # two at once, of which one is not in the catalogue
                chosen.append(str(order[-1 - i % len(order)]))
            strength = STRENGTHS[(i + i // len(STRENGTHS)) % len(STRENGTHS)]
            values = {name: hidden_values(base, catalogue[name], strength, i) for name in dict.fromkeys(chosen)}
            yield Case(world, values, out, draw, i, strength, noises[i % len(noises)])
        for i in range(clean):
            yield Case(world, {}, (), draw, i, 0.0, noises[i % len(noises)])


def hidden_values(model: Model, effect: Effect, strength: float, turn: int) -> dict[str, float]:
    """Parameter values: of alternating sign from one turn and from one muscle to the next where bounds allow.

    Args:
        strength: as a fraction of the strongest, which is twice the typical one or as near as the bounds allow.
    """
    named = model.with_effects([effect]).parameters_of(effect)
    room = min(max(p.high, -p.low) / abs(p.typical) for p in named.values())
    factor = strength * min(2.0, room)
    values = {}
    for i, (name, p) in enumerate(named.items()):
        sign = -1.0 if (turn + i) % 2 and p.low < 0 < p.high else 1.0
        values[name.split(".", 1)[1]] = float(np.clip(sign * factor * p.typical, 0.95 * p.low, p.high))
    return values


def make_trials(
    case: Case, world: World, dataset: SimulatedDataset, catalogue: Mapping[str, Effect]
) -> tuple[Trials, Trials] | None:
    """Trials of a case as its recorder reports them, and without noise; None where no EMG keeps the arm in range."""
    trials = _exact_trials(case, world, dataset, catalogue)
    if trials is None:
        return None
    silent = {name: value for name, value in world.recording.items() if name not in NOISES}
    seen = record(trials, world, case.noise_deg, case.random.spawn(1)[0])
    return seen, record(trials, replace(world, recording=silent), 0.0, case.random)


def _exact_trials(
    case: Case, world: World, dataset: SimulatedDataset, catalogue: Mapping[str, Effect]
) -> Trials | None:
    """What the arm does, before it is recorded."""
    if case.world in SIMULATORS:
        return simulator.make_trials(SIMULATORS[case.world].Arm.draw(case.random), case.values, case.seed, dataset)
    settings = dataset.model_copy(
        update={
            "hidden_effect": case.hidden,
            "seed": case.seed,
            "angle_noise_deg": 0.0,
            "hidden_constants": dict(world.constants),
        }
    )
    try:
        trials, _ = simulate_trials(case.name, settings, world.model, catalogue)
    except ValueError:
        return None
    if world.sample_and_hold:
        trials = replace(trials, angle=_with_sample_and_hold(case, trials, settings, world, catalogue))
    return trials


def _with_sample_and_hold(
    case: Case, trials: Trials, settings: SimulatedDataset, world: World, catalogue: Mapping[str, Effect]
) -> np.ndarray[Any, np.dtype[np.float64]]:
    """The angle of the same EMG that keeps its value between samples, (T, N)."""
    model = world.model.with_effects(catalogue[name] for name in case.hidden)
    values = case.values | dict(world.constants)
    emg = sample_and_hold(channels_of(model, trials.channels, torch.from_numpy(trials.emg)))
    motion = simulate(Simulation(model, values, emg, trials.dt / FINER), settings.start_rad)
    return motion.angle.numpy()[..., ::FINER]
