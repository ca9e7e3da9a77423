"""Synthetic trials: an EMG drawn at random, the motion that the physics gives for it, and the truth kept apart.

What `simulate_trials` returns first is what a recording would be, and says nothing of what made it; the truth is
returned, and stored, separately. Only scoring may read it.

Shapes: T trials, N samples, C EMG channels.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch

from myowave.data.trials import Array, Trials
from myowave.physics.effect import Effect
from myowave.physics.model import Model
from myowave.physics.motion import simulate
from myowave.physics.muscle import FLEXOR
from myowave.physics.simulation import Simulation, channels_of
from myowave.physics.trajectory import solve
from myowave.settings import SimulatedDataset

ANGLE_RANGE = (0.1, 1.7)  # of the elbow in synthetic trials [rad]: at 0 the moment arms of Eqs. 58-59 change sign

# ASSUME: a trial repeats flexion 0.12 to 0.45 times a second, slow enough for the forearm to follow its equilibrium.
FREQUENCY_RANGE = (0.12, 0.45)
# ASSUME: the flexor never relaxes below 0.35 and holds 0.15 more against a full extensor; the extensor keeps 0.2. With
# Table 1 the equilibrium angle then stays between 0.5 and 1.45 rad, and the flexor turns the arm back before it hangs
# straight.
FLEXOR_TONE, FLEXOR_SHARE, EXTENSOR_TONE = 0.35, 0.15, 0.2
NOISE_DRAWS, SHAPE_DRAWS = 8, 4

SUBSTEPS = 8  # Runge-Kutta steps between two kinks of the EMG in what is stored: within 1e-6 rad of the exact motion


@dataclass(frozen=True)
class Manoeuvre:
    """How a subject is told to move."""

    frequency: float = 1.0  # factor on the frequency of all movements [-]
    amplitude: float = 1.0  # factor on the EMG [-]; 0 is a passive swing
    cocontraction: float = 0.0  # tone c added to every muscle [-], e -> c + (1 - c) e
    effort: float = 1.0  # factor on the flexors' tone [-]; (m + load) / m keeps up an arm with a load


MANOEUVRES: Mapping[str, Manoeuvre] = {  # trials that one can ask a subject for
    "as recorded": Manoeuvre(),
    "faster": Manoeuvre(frequency=1.8),
    "slower": Manoeuvre(frequency=0.5),
    "passive swing": Manoeuvre(amplitude=0.0),
    "co-contraction": Manoeuvre(cocontraction=0.4),
}


def synthetic_emg(
    seed: int,
    *,
    sides: Sequence[float] = (FLEXOR, -FLEXOR),
    trials: int = 5,
    samples: int = 500,
    dt: float = math.sqrt(1e-3),
    manoeuvres: Sequence[Manoeuvre] | None = None,
    draw: int = 0,
) -> Array:
    """Noiseless EMG like the paper's Fig. 7: smooth, a frequency of its own for each trial, varying within it.

    Args:
        seed: decides everything; another seed is another subject moving in the same way.
        sides: side of the joint each channel's muscle is on (`FLEXOR` or `EXTENSOR`), length C.
        dt: time between samples [s].
        manoeuvres: how to move in each trial, length T; default all `Manoeuvre()`.
        draw: which draw of this seed to take; another has the same frequencies and other bursts.

    Returns:
        EMG [-], (T, N, C), within [0, 1]; in the default manoeuvre every channel of every trial reaches 1.

    Source: shape after Taneja et al. 2023, Fig. 7; the paper gives no formula.
    """
    manoeuvres = [Manoeuvre()] * trials if manoeuvres is None else manoeuvres
    low, high = FREQUENCY_RANGE
    ranks = np.random.default_rng([seed, 0]).permutation(trials)
    frequencies = low * (high / low) ** ((ranks + 0.5) / trials)
    time = np.arange(samples, dtype=np.float64) * dt
    emg = np.empty((trials, samples, len(sides)))
    for i, manoeuvre in enumerate(manoeuvres):
        random = np.random.default_rng([seed, 1 + i, draw])
        frequency = frequencies[i] * manoeuvre.frequency
        bursts = np.stack([_burst(time, frequency, random, leads=c == 0) for c in range(len(sides))], axis=-1)
        emg[i] = _compose(bursts, np.asarray(sides), manoeuvre)
    return emg


def simulate_trials(
    dataset: str, settings: SimulatedDataset, base: Model, catalogue: Mapping[str, Effect]
) -> tuple[Trials, dict[str, Any]]:
    """Synthetic trials of one dataset, and what they were made with.

    A trial whose joint angle leaves `ANGLE_RANGE` is redrawn: the noise first, then the EMG itself. The provenance of
    the trials says which draws were taken.

    Returns:
        The trials, named "1", "2", ..., and the truth: model, its parameters, effects and noise.

    Raises:
        ValueError: if a hidden effect is unknown, or a trial leaves the range in every draw.
    """
    model, hidden = _true_model(dataset, settings, base, catalogue)
    names = tuple(str(i + 1) for i in range(settings.trials))
    angle = np.zeros((settings.trials, settings.samples))
    blank = Trials(  # carries the labels and the known constants; the signals come below
        dataset=dataset,
        dt=settings.dt_s,
        names=names,
        channels=base.channels,
        emg=np.zeros((*angle.shape, len(base.channels))),
        angle=angle,
        lengths=(settings.samples,) * settings.trials,
        test=settings.test,
        conditions=settings.conditions,
        constants=settings.constants,
    )
    params = {name: torch.from_numpy(values) for name, values in blank.known(model.defaults).items()}
    hidden |= settings.hidden_constants
    params |= {name: torch.tensor(value, dtype=torch.float64) for name, value in hidden.items()}
    emg, observed, draws = _draw_in_range(blank, settings, model, params)
    random = np.random.default_rng([settings.seed, 2**31])
    observed = observed + np.radians(settings.angle_noise_deg) * random.standard_normal(observed.shape)
    if settings.recorder_noise:
        emg = np.clip(emg + settings.recorder_noise * random.standard_normal(emg.shape), 0.0, 1.0)
    provenance = {"source": "simulated", "seed": settings.seed, "draws": dict(zip(names, draws, strict=True))}
    truth = {
        "dataset": dataset,
        "model": model.name,
        "effects": list(settings.hidden_effect),
        "parameters": {**model.defaults, **settings.constants, **hidden},
        "emg_noise": settings.emg_noise,
        "recorder_noise": settings.recorder_noise,
        "angle_noise_deg": settings.angle_noise_deg,
    }
    return replace(blank, emg=emg, angle=observed, provenance=provenance), truth


def _burst(time: Array, frequency: float, random: np.random.Generator, *, leads: bool) -> Array:
    """One channel's bursts in [0, 1], peak 1, (N,): a raised cosine with wandering frequency and height.

    The channel that leads starts relaxed, at the trial's frequency; the others anywhere, 0.6 to 1.4 times as fast.
    """
    frequency = frequency if leads else frequency * random.uniform(0.6, 1.4)
    start = 0.0 if leads else random.uniform(0, 2 * np.pi)
    wander, phase = 2 * np.pi * random.uniform(0.04, 0.1), random.uniform(0, 2 * np.pi)
    depth = random.uniform(0.2, 0.5)
    elapsed = time + depth * (np.cos(phase) - np.cos(wander * time + phase)) / wander
    swell, fade = 2 * np.pi * random.uniform(0.05, 0.12), random.uniform(0.3, 0.7)
    height = 1 - fade * (1 - np.cos(swell * time + random.uniform(0, 2 * np.pi))) / 2
    burst = height * (1 - np.cos(2 * np.pi * frequency * elapsed + start)) / 2
    return burst / burst.max()


def _compose(bursts: Array, sides: Array, manoeuvre: Manoeuvre) -> Array:
    """EMG of one trial from its bursts (N, C): tone below, bursts above it, then the manoeuvre."""
    extension = bursts[:, sides != FLEXOR].max(axis=1, initial=0.0)[:, None]
    flexor_tone = np.minimum(FLEXOR_TONE * manoeuvre.effort + FLEXOR_SHARE * extension, 0.95)
    tone = np.where(sides == FLEXOR, flexor_tone, EXTENSOR_TONE)
    emg = tone + (1 - tone) * bursts
    emg = manoeuvre.cocontraction + (1 - manoeuvre.cocontraction) * emg
    return np.clip(manoeuvre.amplitude * emg, 0.0, 1.0)


def _draw_in_range(
    blank: Trials, settings: SimulatedDataset, model: Model, params: Mapping[str, torch.Tensor]
) -> tuple[Array, Array, list[int]]:
    """EMG (T, N, C), the angle a perfect sensor sees (T, N) and the draw taken, for each trial the first in range.

    Draw k of a trial is noise k % NOISE_DRAWS on EMG k // NOISE_DRAWS: datasets that differ only in noise share
    their EMG as long as one of the noises works. Without noise every draw is another EMG.
    """
    emg = np.empty_like(blank.emg)
    states = np.empty((*blank.angle.shape, model.state_size))
    taken = np.full(settings.trials, -1)
    low, high = ANGLE_RANGE
    for draws in (range(1), range(1, SHAPE_DRAWS * NOISE_DRAWS)):  # the first draw nearly always does; then all at once
        candidates = np.stack([_draw_emg(blank, settings, model, k) for k in draws])
        drive = channels_of(model, blank.channels, torch.from_numpy(candidates))
        motion = simulate(Simulation(model, params, drive, settings.dt_s), settings.start_rad)
        q = motion.q.numpy()
        inside = ((q > low) & (q < high)).all(axis=-1)
        found = np.flatnonzero((taken < 0) & inside.any(axis=0))
        first = inside.argmax(axis=0)[found]
        emg[found] = candidates[first, found]
        taken[found] = np.asarray(draws)[first]
        states[found] = motion.state.numpy()[first, found]
        if (taken >= 0).all():
            drive = channels_of(model, blank.channels, torch.from_numpy(emg))
            simulation = Simulation(model, params, drive, settings.dt_s, SUBSTEPS)
            # The exact motion, from the coarser one.
            start = torch.full((settings.trials,), settings.start_rad, dtype=torch.float64)
            fine = solve(simulation, start, torch.zeros_like(start), guess=torch.from_numpy(states))
            return emg, fine.motion.angle.numpy(), taken.tolist()
    lost = int(np.flatnonzero(taken < 0)[0])
    raise ValueError(
        f"data.datasets.{blank.dataset}, trial {blank.names[lost]}: in {SHAPE_DRAWS * NOISE_DRAWS} draws the elbow "
        f"angle always left {low} to {high} rad (the last went from {q[-1, lost].min():.2f} to "
        f"{q[-1, lost].max():.2f}). Use less emg_noise, a weaker hidden_effect, a smaller load, another start_rad, or "
        "another seed."
    )


def _draw_emg(blank: Trials, settings: SimulatedDataset, model: Model, draw: int) -> Array:
    """One draw of the EMG of all trials with its noise, (T, N, C)."""
    mass = model.defaults["mass"]
    sides = [model.leading[channel].side for channel in blank.channels]
    effort = (blank.condition("mass", mass) + blank.condition("load", model.defaults["load"])) / mass
    clean = synthetic_emg(
        settings.seed,
        sides=sides,
        trials=settings.trials,
        samples=settings.samples,
        dt=settings.dt_s,
        manoeuvres=[Manoeuvre(effort=max(1.0, e)) for e in effort],
        draw=draw // NOISE_DRAWS if settings.emg_noise else draw,
    )
    streams = [np.random.default_rng([settings.seed, 1 + i, draw, 1]) for i in range(settings.trials)]
    noise = np.stack([stream.standard_normal(clean.shape[1:]) for stream in streams])
    # ASSUME: an amplifier reports EMG within 0..1, so noise beyond is cut off; the cut EMG drives the motion.
    return np.clip(clean + settings.emg_noise * noise, 0.0, 1.0)


def _true_model(
    dataset: str, settings: SimulatedDataset, base: Model, catalogue: Mapping[str, Effect]
) -> tuple[Model, dict[str, float]]:
    """The base model with the hidden effects, and the values of their parameters by full name."""
    where = f"data.datasets.{dataset}.hidden_effect"
    if unknown := [name for name in settings.hidden_effect if name not in catalogue]:
        raise ValueError(f"{where}: no effect {unknown}; the catalogue has {', '.join(catalogue)}.")
    model = base.with_effects(catalogue[name] for name in settings.hidden_effect)
    hidden = {f"{e}.{short}": float(value) for e, of in settings.hidden_effect.items() for short, value in of.items()}
    if unknown := [name for name in hidden if name not in model.effect_parameters]:
        raise ValueError(f"{where}: no parameter {unknown}; there are {', '.join(model.effect_parameters)}.")
    for name, value in hidden.items():
        bounds = model.effect_parameters[name]
        if not bounds.low <= value <= bounds.high:
            raise ValueError(
                f"{where}: {name} is {value} {bounds.unit}; expected {bounds.low} to {bounds.high} ({bounds.meaning})."
            )
    return model, hidden
