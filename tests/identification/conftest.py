"""A small elbow: three short training trials and one that is kept, whose motion the tests simulate."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch
import yaml

from myowave.data.simulate import simulate_trials
from myowave.data.trials import Trials
from myowave.identification.free_parameters import Free, free_parameters
from myowave.identification.record import Record, make_record
from myowave.physics.build import build_model
from myowave.physics.effect import Effect
from myowave.physics.effects import catalogue
from myowave.physics.model import Model
from myowave.settings import Identify, Physics, SimulatedDataset


@pytest.fixture(scope="session", autouse=True)
def _one_thread():
    torch.set_num_threads(1)


@pytest.fixture(scope="session")
def base(pytestconfig) -> Model:
    physics = yaml.safe_load((pytestconfig.rootpath / "config.yaml").read_text(encoding="utf-8"))["physics"]
    return build_model("base", Physics.model_validate(physics))


@pytest.fixture(scope="session")
def effects() -> dict[str, Effect]:
    return catalogue()


@pytest.fixture(scope="session")
def dataset() -> SimulatedDataset:
    return SimulatedDataset(kind="simulated", trials=4, samples=200, test=("4",), seed=3)


@pytest.fixture(scope="session")
def identify(dataset) -> dict[str, Identify]:
    return dict(dataset.identify)


@pytest.fixture(scope="session")
def clean(dataset, base) -> Trials:
    return simulate_trials("clean", dataset, base, {})[0]


@pytest.fixture(scope="session")
def free(base, identify) -> tuple[Free, ...]:
    return free_parameters(base, identify, ())


@pytest.fixture(scope="session")
def make_noisy(clean, base) -> Callable[..., Record]:
    """The record of all trials with white noise on the angle."""

    def make(noise_deg: float, seed: int = 0) -> Record:
        noise = np.radians(noise_deg) * np.random.default_rng(seed).standard_normal(clean.angle.shape)
        return make_record(replace(clean, angle=clean.angle + noise), base)

    return make


@pytest.fixture(scope="session")
def exact(make_noisy) -> Record:
    """The training trials as a perfect sensor sees them."""
    return make_noisy(0.0).train
