"""A small elbow: four short trials whose motion the tests simulate with whatever they hide in it."""

from collections.abc import Callable
from dataclasses import replace

import pytest
import torch

from myowave.data.trials import Trials
from myowave.diagnosis.study.cases import Case, add_noise, clean_trials, simulate_case
from myowave.identification.output_error import Fit, fit_model
from myowave.identification.record import Record, make_record
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation


@pytest.fixture(scope="session")
def clean(dataset, base) -> Trials:
    return clean_trials(dataset, base, 3)


@pytest.fixture(scope="session")
def make_trials(clean, dataset, base, effects) -> Callable[..., Trials]:
    """Trials with hidden effects, {effect: {parameter: value}}, and noise on the angle."""

    def make(hidden: dict | None = None, noise_deg: float = 0.5, seed: int = 3) -> Trials:
        trials = simulate_case(Case(hidden or {}, 3), clean, dataset, base, effects)
        return add_noise(trials, noise_deg, seed) if noise_deg else trials

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
