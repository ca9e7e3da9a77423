"""EMG that is made up: like that of the training trials, within their range, with noise of their size."""

import numpy as np
import pytest

from myowave.data.wavelets import estimate_noise
from myowave.learning.methods.rollout.augmentation import imagine_emg


@pytest.fixture(scope="module")
def train(trials):
    return trials.select(trials.train)


def test_it_stays_in_the_range_of_each_channel(train):
    emg = imagine_emg(train, 20, 0)
    assert emg.shape == (20, *train.emg.shape[1:])
    for channel in range(emg.shape[-1]):
        recorded = train.emg[..., channel]
        assert emg[..., channel].min() >= recorded.min() and emg[..., channel].max() <= recorded.max()
    assert np.ptp(emg) > 0.5 * np.ptp(train.emg), "it moves"


def test_it_has_the_noise_of_the_recorded_one(train):
    emg = imagine_emg(train, 20, 0)
    for channel in range(emg.shape[-1]):
        recorded, made = (estimate_noise(*each[..., channel]) for each in (train.emg, emg))
        assert made == pytest.approx(recorded, rel=0.3)


def test_each_trial_and_each_seed_is_another(train):
    emg = imagine_emg(train, 3, 0)
    np.testing.assert_array_equal(emg, imagine_emg(train, 3, 0))
    assert np.abs(emg - imagine_emg(train, 3, 1)).mean() > 0.01
    assert np.abs(emg[0] - emg[1]).mean() > 0.01
