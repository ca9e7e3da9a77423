"""Waves of a band keep what is slow of each trial, whatever its length."""

import numpy as np

from myowave.identification.whitening import MotionBand

LENGTHS = np.array([240, 150])


def test_waves_are_orthonormal_in_each_trial_and_keep_what_is_slow_alone():
    band = MotionBand.of(LENGTHS[:, None] > np.arange(240), 0.1)
    time = np.arange(240)
    for waves, frequency, length in zip(band.waves, band.frequency, LENGTHS, strict=True):
        live = (waves != 0).any(0)
        assert np.allclose(waves[:, live].T @ waves[:, live], np.eye(live.sum())) and frequency[live].max() <= 0.1
        assert (waves[length:] == 0).all()
        slow, fast = (np.cos(2 * np.pi * f * (time + 0.5)) * (time < length) for f in (0.05, 0.25))
        assert np.linalg.norm(waves @ (waves.T @ slow) - slow) < 0.05 * np.linalg.norm(slow)
        assert np.linalg.norm(waves.T @ fast) < 0.05 * np.linalg.norm(fast)
