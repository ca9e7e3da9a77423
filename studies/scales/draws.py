"""The trials of a draw: another random motion where they are simulated, other held-out trials where they were recorded.

Shapes: T trials, N samples, C EMG channels.
"""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from myowave.data.simulate import simulate_trials
from myowave.data.store import read_trials
from myowave.data.trials import Trials
from myowave.physics.effects import catalogue
from myowave.physics.model import Model
from myowave.settings import Dataset, Physics, SimulatedDataset

Array = NDArray[np.float64]


def draw_trials(
    name: str,
    dataset: Dataset,
    base: Model,
    physics: Physics,
    recorded: Sequence[str],
    draw: int,
    rate_hz: float | None,
) -> Trials:
    """Trials of one draw.

    Args:
        name: of the dataset.
        base: model without effects.
        recorded: path of the recorded trials, where they are not simulated.
        draw: number of the draw, from 0.
        rate_hz: sampling rate to average the samples down to [Hz]; None leaves them.
    """
    if isinstance(dataset, SimulatedDataset):
        settings = dataset.model_copy(update={"seed": dataset.seed + draw})
        effects = catalogue(physics.effect_files)
        trials = simulate_trials(name, settings, base, effects)[0]
        if settings.angle_noise_deg:
            # The unseen trials are scored against the motion itself: noise would hide what ways differ in.
            quiet = settings.model_copy(update={"angle_noise_deg": 0.0})
            tests, clean = trials.index(trials.test), simulate_trials(name, quiet, base, effects)[0]
            angle = trials.angle.copy()
            angle[tests] = clean.angle[tests]
            trials = replace(trials, angle=angle)
    else:
        trials = hold_out_others(read_trials(recorded[0]), draw)
    return trials if rate_hz is None else average_down(trials, max(1, round(1 / (trials.dt * rate_hz))))


def hold_out_others(trials: Trials, draw: int) -> Trials:
    """The same trials, of which others test: one for each set of conditions, in the order of all ways to choose."""
    groups: dict[str, list[str]] = {}
    for name in trials.names:
        known = {key: value for key, value in trials.conditions.get(name, {}).items() if key not in trials.constants}
        # Measured conditions such as a tilt differ in every trial; loads are what trials have in common.
        groups.setdefault(str(known.get("load")), []).append(name)
    ways = list(itertools.product(*groups.values()))
    order = np.random.default_rng(0).permutation(len(ways))
    return replace(trials, test=ways[order[draw % len(ways)]])


def average_down(trials: Trials, every: int) -> Trials:
    """Means of `every` samples; what is left over at the end of a trial is dropped."""

    def mean(values: Array) -> Array:
        kept = len(values) - len(values) % every
        return np.asarray(values[:kept].reshape(kept // every, every, *values.shape[1:]).mean(1))

    return trials.changed(mean, dt=trials.dt * every)


def decimate(trials: Trials, every: int) -> Trials:
    """The first of every so many samples."""
    return trials.changed(lambda values: values[::every], dt=trials.dt * every)
