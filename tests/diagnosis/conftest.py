"""A small elbow: four short trials whose motion the tests simulate with whatever they hide in it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.data.simulate import simulate_trials
from myowave.data.trials import Trials
from myowave.identification.output_error import Fit, fit_model
from myowave.identification.record import Record, make_record
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation


def add_noise(trials: Trials, noise_deg: float, seed: int) -> Trials:
    noise = np.random.default_rng([seed, round(1000 * noise_deg)]).standard_normal(trials.angle.shape)
    return replace(trials, angle=trials.angle + np.radians(noise_deg) * noise)


@pytest.fixture(scope="session")
def clean(dataset, base) -> Trials:
    return simulate_trials("clean", dataset, base, {})[0]


@pytest.fixture(scope="session")
def make_trials(clean, dataset, base, effects) -> Callable[..., Trials]:
    """Trials with hidden effects, {effect: {parameter: value}}, and noise on the angle."""

    def make(hidden: dict | None = None, noise_deg: float = 0.5, seed: int = 3) -> Trials:
        hiding = dataset.model_copy(update={"hidden_effect": hidden or {}})
        trials = simulate_trials("hidden", hiding, base, effects)[0] if hidden else clean
        return add_noise(trials, noise_deg, seed)

    return make


@pytest.fixture(scope="session")
def make_fit(make_trials, base, free) -> Callable[..., Fit]:
    """The base model fitted to trials with hidden effects."""

    def make(hidden: dict | None = None, noise_deg: float = 0.5, seed: int = 3) -> Fit:
        return fit_model(base, make_record(make_trials(hidden, noise_deg, seed), base).train, free, starts=2)

    return make


@pytest.fixture(scope="session")
def loaded(clean, base, effects) -> Callable[[dict[str, dict[str, float]]], Record]:
    """The record of trials whose motion was simulated with 0.5 kg nobody noted, and conditions somebody did."""

    def make(conditions: dict[str, dict[str, float]]) -> Record:
        trials = replace(clean, conditions=conditions)
        record = make_record(trials, base)
        model = base.with_effects([effects["hand_load"]])
        params = {**record.known, "hand_load.m": 0.5}
        motion = simulate(Simulation(model, params, record.emg, record.dt), torch.tensor(0.6, dtype=torch.float64))
        return make_record(add_noise(replace(trials, angle=motion.angle.numpy()), 0.5, 3), base)

    return make
