"""The elbow of Table 1 and EMG that keeps it within 0.1 and 1.7 rad."""

import math

import numpy as np
import pytest
import torch

from myowave.data.simulate import synthetic_emg
from myowave.physics.effect_files import trial_elbow


@pytest.fixture(scope="session")
def elbow():
    return trial_elbow()


@pytest.fixture(scope="session")
def dt():
    return math.sqrt(1e-3)


@pytest.fixture(scope="session")
def smooth_emg():
    """Noiseless EMG (5, 500, 2) of five trials."""
    return torch.from_numpy(synthetic_emg(SEED))


@pytest.fixture(scope="session")
def noisy_emg(smooth_emg):
    """EMG with noise by its standard deviation, as in cases 1-3: {sigma: (5, 500, 2)}."""
    random = np.random.default_rng(1)
    noise = torch.from_numpy(random.standard_normal(smooth_emg.shape))
    return {sigma: smooth_emg + sigma * noise for sigma in (0.10, 0.15, 0.20)}


SEED = 3
START = 1.0  # rad, at rest
