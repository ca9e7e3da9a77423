"""What tests of several layers share: one thread, and a small elbow to fit and to diagnose."""

import pytest
import torch
import yaml

from myowave.identification.free_parameters import Free, free_parameters
from myowave.models import build_model
from myowave.physics.effect import Effect
from myowave.physics.effects import catalogue
from myowave.physics.model import Model
from myowave.settings import Identify, Physics, SimulatedDataset


@pytest.fixture(scope="session", autouse=True)
def _one_thread():
    torch.set_num_threads(1)


@pytest.fixture(scope="session")
def base(pytestconfig) -> Model:
    config = yaml.safe_load((pytestconfig.rootpath / "config.yaml").read_text(encoding="utf-8"))
    return build_model("base", Physics.model_validate(config["physics"]["arms"]["paper"]))


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
def free(base, identify) -> tuple[Free, ...]:
    return free_parameters(base, identify, ())
