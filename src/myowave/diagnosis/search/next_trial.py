"""Which trial would tell candidates apart that the recorded ones do not?

For each trial on a menu the motion is simulated with the fitted parameters, and its derivatives say how far the two
candidates would be apart after all parameters, old and new, were fitted again to all trials together.

Shapes: T trials, N samples, M muscles, P parameters.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from myowave.data.simulate import MANOEUVRES, Manoeuvre, synthetic_emg
from myowave.data.trials import Array
from myowave.diagnosis.search.score import score_effect
from myowave.identification.free_parameters import Free, bind_values, effect_parameters
from myowave.identification.least_squares import FitError, Normal, gain_of
from myowave.identification.output_error import Fit, Problem, polish
from myowave.identification.record import Record
from myowave.physics.effect import Effect
from myowave.physics.motion import Motion, pack, resting_states, simulate, unpack
from myowave.physics.simulation import channels_of
from myowave.physics.trajectory import solve

LOAD_KG, TILT_RAD = 1.0, np.pi / 6
START_RAD = np.pi / 6
SEED = 2
# What to do, and the constants that are then known to differ from the recorded trials.
MENU: dict[str, tuple[Manoeuvre, dict[str, float]]] = {
    **{name: (manoeuvre, {}) for name, manoeuvre in MANOEUVRES.items()},
    "known load of 1 kg": (Manoeuvre(effort=2.0), {"load": LOAD_KG}),
    "other posture, upper arm 30 deg forward": (Manoeuvre(effort=1.5), {"tilt": TILT_RAD}),
}
SEPARATED = 10.0  # chi-square that tells two candidates apart


@dataclass(frozen=True)
class Proposal:
    """A trial that could be recorded next."""

    trial: str  # what to do
    separation: float  # expected chi-square between the candidates with this trial added to the recorded ones
    now: float  # the same without it


@dataclass(frozen=True)
class Menu:
    """The trials that may be proposed, as a fitted model would move."""

    fit: Fit  # to the recorded trials
    record: Record  # of the trials of the menu
    motion: Motion  # of these

    @classmethod
    def of(cls, fit: Fit) -> "Menu":
        """A FitError if no motion is found."""
        record = _menu(fit)
        motion = simulate(record.simulation(fit.model, bind_values(fit.free, fit.values)), START_RAD)
        if not motion.state.isfinite().all():
            raise FitError(f"{fit.model.name}: its motion in a trial of the menu diverges.")
        return cls(fit, record, motion)


def propose_trials(menu: Menu, one: Effect, other: Effect | None = None) -> list[Proposal]:
    """Trials of the menu, the one that tells most first.

    Args:
        menu: of a fit without either effect.
        one: the effect taken to be real, as strong as the trials say (or of its typical strength where they cannot).
        other: the effect that imitates it; None asks whether the fitted parameters alone can imitate it.
    """
    fit, effects = menu.fit, [one] if other is None else [one, other]
    own, *rival = (effect_parameters(fit.model.with_effects([effect]), effect) for effect in effects)
    imitators = (*fit.free, *(p for parameters in rival for p in parameters))
    strength, noise, everything = _strength(fit, one), fit.record.noise, (*own, *imitators)
    recorded = _normal(fit, fit.record, fit.sensitive.motion, effects, everything)
    further = _normal(fit, menu.record, menu.motion, effects, everything)
    # Of each trial of the menu by itself, (T, P, P); what is known beforehand counts once, with the recorded ones.
    alone = np.swapaxes(further.without_starts(further.slope), -1, -2) @ further.slope
    now = _separation(recorded.matrix, strength, noise)
    after = [_separation(recorded.matrix + matrix, strength, noise) for matrix in alone]
    return sorted(map(Proposal, menu.record.names, after, [now] * len(after)), key=lambda p: -p.separation)


def _strength(fit: Fit, effect: Effect) -> Array:
    score = score_effect(fit, effect)
    if score.absorbed or not np.any(score.estimate):
        return np.ones(len(score.free))
    found = polish(score.start).parameters
    return np.array([found[p.name] / p.scale for p in score.free])


def _menu(fit: Fit) -> Record:
    """The trials of the menu as a record, with synthetic EMG: as long as the recorded trials, or as their pieces."""
    record = fit.record
    channels = fit.model.channels
    sides = [fit.model.leading[channel].side for channel in channels]
    samples = record.angle.shape[1]
    manoeuvres = [m for m, _ in MENU.values()]
    emg = synthetic_emg(SEED, sides=sides, trials=len(MENU), samples=samples, dt=record.dt, manoeuvres=manoeuvres)
    usual = fit.model.defaults | {name: float(values.median()) for name, values in record.known.items()}
    names = sorted({*record.known, *(name for _, values in MENU.values() for name in values)})
    known = {name: [values.get(name, usual[name]) for _, values in MENU.values()] for name in names}
    return replace(
        record,
        names=tuple(MENU),
        emg=channels_of(fit.model, channels, torch.from_numpy(emg)),
        angle=np.zeros((len(MENU), samples)),
        valid=np.ones((len(MENU), samples), dtype=bool),
        training=np.ones(len(MENU), dtype=bool),
        begin=np.zeros(len(MENU), dtype=np.int64),
        known={name: torch.tensor(values, dtype=torch.float64) for name, values in known.items()},
        course=None,
        torque=None,
        lead=0,
        pieces=None,
    )


def _normal(fit: Fit, record: Record, motion: Motion, effects: Sequence[Effect], free: Sequence[Free]) -> Normal:
    """The normal equations of trials whose motion is that of a fit with further effects, which are still 0."""
    values = np.array([fit.parameters.get(p.name, 0.0) for p in free])
    model = fit.model.with_effects(effects)
    simulation = record.simulation(model, bind_values(free, values))
    states = unpack(model, resting_states(simulation, motion.q, motion.qdot))[2] | unpack(fit.model, motion.state)[2]
    guess = pack(model, motion.q, motion.qdot, states)
    result = solve(simulation, *guess[:, 0, :2].unbind(-1), guess=guess, wrt={p.name: p.scale for p in free})
    return Problem(simulation, record, tuple(free)).normal_at(result, values)


def _separation(matrix: Array, strength: Array, noise: float) -> float:
    """Chi-square of an effect of this strength, whose parameters come first in a normal matrix, that no change of the
    others, which imitate it, can make up for."""
    own = len(strength)
    imitated = gain_of(matrix[own:, own:], matrix[own:, :own] @ strength)[1]
    return max(float(strength @ matrix[:own, :own] @ strength) - imitated, 0.0) / noise**2
