"""The noise estimate finds the noise, not the motion."""

import numpy as np
import pytest

from myowave.data.simulate import simulate_trials
from myowave.data.wavelets import estimate_noise
from myowave.settings import SimulatedDataset


@pytest.fixture(scope="module")
def motions(base):
    """Simulated angles [deg] driven by the noisy EMG of case 1, without noise of their own, (T, N)."""
    settings = SimulatedDataset(kind="simulated", test=("3",), trials=8, seed=5, emg_noise=0.1)
    return np.degrees(simulate_trials("case", settings, base, {})[0].angle)


@pytest.mark.parametrize("sigma", [0.3, 1.0, 3.0])
def test_it_is_unbiased_on_motion(motions, sigma):
    random = np.random.default_rng(1)
    found = [estimate_noise(*(motions + sigma * random.standard_normal(motions.shape))) for _ in range(30)]
    assert np.mean(found) == pytest.approx(sigma, rel=0.05)
    assert np.std(found) < 0.06 * sigma


def test_it_scales_with_the_signal(motions):
    random = np.random.default_rng(2)
    noisy = motions[0] + random.standard_normal(motions.shape[1])
    assert estimate_noise(np.radians(noisy)) == pytest.approx(np.radians(estimate_noise(noisy)), rel=1e-9)


def test_smooth_motion_has_next_to_none(base):
    settings = SimulatedDataset(kind="simulated", test=("3",), seed=5, emg_noise=0.0)
    angle = simulate_trials("smooth", settings, base, {})[0].angle
    assert np.degrees(estimate_noise(*angle)) < 0.005


def test_drift_and_an_outlier_do_not_move_it():
    random = np.random.default_rng(3)
    noise = random.standard_normal(501)
    spoiled = noise + 7.0 * np.linspace(-1, 1, 501) + 3.0
    spoiled[100] += 500.0
    assert estimate_noise(spoiled) == pytest.approx(estimate_noise(noise), rel=0.1)


def test_too_short_a_signal_is_refused():
    with pytest.raises(ValueError, match=r"shape \(10,\); expected .* at least 24"):
        estimate_noise(np.zeros(10))
