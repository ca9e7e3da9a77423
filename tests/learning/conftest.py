"""Small trials, models and tasks that train in seconds."""

from dataclasses import replace

import pytest
import torch
import yaml

from myowave.data.simulate import simulate_trials
from myowave.data.trials import Trials
from myowave.data.wavelets import decompose
from myowave.learning.task import Task
from myowave.models import build_model
from myowave.physics.effect import Effect
from myowave.physics.effects import catalogue
from myowave.physics.model import Model
from myowave.settings import Identify, PaperRecipe, RolloutRecipe, Settings, SimulatedDataset, parse_settings


@pytest.fixture(scope="session")
def settings(pytestconfig: pytest.Config) -> Settings:
    return parse_settings(yaml.safe_load((pytestconfig.rootpath / "config.yaml").read_text()))


@pytest.fixture(scope="session")
def model(settings: Settings) -> Model:
    return build_model("base", settings.physics.of_arm("paper"))


@pytest.fixture(scope="session")
def effects() -> dict[str, Effect]:
    return catalogue(())


@pytest.fixture(scope="session")
def trials(model: Model) -> Trials:
    """Three trials of 200 samples, the last of which tests."""
    dataset = SimulatedDataset(kind="simulated", trials=3, samples=200, emg_noise=0.1, test=("3",))
    return simulate_trials("small", dataset, model, catalogue(()))[0]


@pytest.fixture(scope="session")
def scales(trials: Trials) -> dict[int, Trials]:
    return decompose(trials, 1)


@pytest.fixture(scope="session")
def wanted() -> dict[str, Identify]:
    return {"f0_Bi": Identify(start_spread=0.2), "l0_Tri": Identify(start_spread=0.1)}


@pytest.fixture
def rollout(scales, model, wanted) -> Task:
    recipe = RolloutRecipe(hidden=8, epochs=6, rollout_s=0.3, simulated_trials=4, patience=100)
    return Task(scales, model, recipe, wanted, total=1, seeds=(0, 1), device=torch.device("cpu"))


@pytest.fixture
def teacher_forced(rollout) -> Task:
    recipe = PaperRecipe(
        hidden=8, epochs=4, history_steps=2, history_noise=0.01, beta=1e-3, learning_rate=1e-3, residual="sequence"
    )
    return replace(rollout, recipe=recipe)
