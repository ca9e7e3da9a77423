from pathlib import Path

import numpy as np
import pytest
import yaml

from myowave.data.trials import Trials
from myowave.models import build_model
from myowave.settings import Physics

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def base():
    """The model of Table 1, as config.yaml has it."""
    config = yaml.safe_load((ROOT / "config.yaml").read_text())
    return build_model("base", Physics.model_validate(config["physics"]["arms"]["paper"]))


@pytest.fixture
def trials():
    """Two trials of different length, with everything a set of trials can carry."""
    random = np.random.default_rng(0)
    lengths = (80, 123)
    return Trials.from_sequences(
        dataset="arm",
        dt=np.sqrt(1e-3),
        names=["short", "long"],
        channels=["emg_biceps", "emg_triceps"],
        emg=[random.random((n, 2)) for n in lengths],
        angle=[random.standard_normal(n) for n in lengths],
        test=["long"],
        conditions={"long": {"load": 1.0}},
        constants={"mass": 1.1},
        provenance={"source": "a test", "nested": {"seed": 3}},
        real_time={"channels": {"emg_biceps": {"offset": 0.1}}},
        emg_low_pass_hz=5.0,
        signals={"tilt_rad": [0.1 * random.standard_normal(n) for n in lengths]},
    )
