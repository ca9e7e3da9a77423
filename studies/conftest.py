"""What tests of the studies share: a small arm, short trials, networks that train in seconds, a copy of the project."""

from pathlib import Path

import pytest
import torch
import yaml
from project_copy import Project, copy_project

from myowave.data.simulate import simulate_trials
from myowave.data.trials import Trials
from myowave.models import build_model
from myowave.physics.effect import Effect
from myowave.physics.effects import catalogue
from myowave.physics.model import Model
from myowave.settings import Identify, Settings, SimulatedDataset, parse_settings


@pytest.fixture(scope="session", autouse=True)
def _one_thread():
    torch.set_num_threads(1)


@pytest.fixture(scope="session")
def settings(pytestconfig: pytest.Config) -> Settings:
    return parse_settings(yaml.safe_load((pytestconfig.rootpath / "config.yaml").read_text(encoding="utf-8")))


@pytest.fixture(scope="session")
def model(settings: Settings) -> Model:
    return build_model("base", settings.physics_of("case1"))


@pytest.fixture(scope="session")
def effects() -> dict[str, Effect]:
    return catalogue()


@pytest.fixture(scope="session")
def dataset() -> SimulatedDataset:
    """Three trials of 200 samples, the last of which tests."""
    return SimulatedDataset(kind="simulated", trials=3, samples=200, emg_noise=0.1, test=("3",))


@pytest.fixture(scope="session")
def trials(model: Model, dataset: SimulatedDataset) -> Trials:
    return simulate_trials("small", dataset, model, {})[0]


@pytest.fixture(scope="session")
def wanted() -> dict[str, Identify]:
    return {"f0_Bi": Identify(start_spread=0.2), "l0_Tri": Identify(start_spread=0.1)}


@pytest.fixture
def project(tmp_path: Path) -> Project:
    """A fresh copy of the project."""
    return copy_project(tmp_path)
