"""A small elbow: three short training trials and one that is kept, whose motion the tests simulate."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from myowave.data.simulate import simulate_trials
from myowave.data.trials import Trials
from myowave.identification.record import Record, make_record


@pytest.fixture(scope="session")
def clean(dataset, base) -> Trials:
    return simulate_trials("clean", dataset, base, {})[0]


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
