"""Innovations of disturbed motion are white, with the variance of the angle's noise; a band keeps what is slow."""

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.signal import butter, sosfiltfilt
from scipy.stats import multivariate_normal

from myowave.identification.whitening import START_DEG, START_DEG_S, MotionBand, Whitener, let_through

NOISE = 0.01
TRIALS, SAMPLES, STATES = 3, 12, 3
START = np.diag([np.radians(START_DEG) ** 2, np.radians(START_DEG_S) ** 2, 0.0])


@pytest.fixture(scope="module")
def system():
    """Steps that differ from sample to sample and from trial to trial, and what a force adds within each."""
    random = np.random.default_rng(0)
    jacobian = np.eye(STATES) + 0.2 * random.standard_normal((TRIALS, SAMPLES - 1, STATES, STATES))
    forcing = 0.03 * random.standard_normal((TRIALS, SAMPLES - 1, STATES, 2))
    return jacobian, forcing @ np.swapaxes(forcing, -1, -2)


@pytest.fixture(scope="module")
def whitener(system):
    return Whitener.of(*system, NOISE)


def covariances(jacobian, added):
    """Of the measured angle of each trial, (T, N, N), from what the start, every step and the sensor add to it."""
    for steps, pushes in zip(jacobian, added, strict=True):
        moved = [np.eye(STATES, STATES * SAMPLES)]  # by start and pushes
        for n, step in enumerate(steps, start=1):
            moved.append(step @ moved[-1] + np.eye(STATES, STATES * SAMPLES, STATES * n))
        angle = np.stack(moved)[:, 0]
        yield angle @ block_diag(START, *pushes) @ angle.T + NOISE**2 * np.eye(SAMPLES)


def test_innovations_of_disturbed_motion_are_white_with_the_variance_of_the_noise(system, whitener):
    matrix = whitener.innovations(np.broadcast_to(np.eye(SAMPLES), (TRIALS, SAMPLES, SAMPLES)))
    for filter_, covariance in zip(matrix, covariances(*system), strict=True):
        np.testing.assert_allclose(filter_ @ covariance @ filter_.T / NOISE**2, np.eye(SAMPLES), atol=1e-8)
        assert (np.triu(filter_, 1) == 0).all(), "an innovation knows nothing of later samples"


def test_the_likelihood_is_that_of_the_disturbed_motion(system, whitener):
    residual = 0.05 * np.random.default_rng(1).standard_normal((TRIALS, SAMPLES))
    expected = [multivariate_normal.logpdf(r, cov=c) for r, c in zip(residual, covariances(*system), strict=True)]
    valid = np.ones((TRIALS, SAMPLES), dtype=bool)
    found = whitener.unlikely(residual, valid) + valid.sum() * np.log(2 * np.pi)
    assert found == pytest.approx(-2 * np.sum(expected))
    valid[0, 7:] = False  # a shorter trial
    shorter = multivariate_normal.logpdf(residual[0, :7], cov=next(covariances(*system))[:7, :7])
    found = whitener.unlikely(residual, valid) + valid.sum() * np.log(2 * np.pi)
    assert found == pytest.approx(-2 * (shorter + sum(expected[1:])))


def test_columns_and_batches_are_filtered_one_by_one(whitener):
    columns = np.random.default_rng(2).standard_normal((4, TRIALS, SAMPLES, 5))
    together = whitener.innovations(columns)
    np.testing.assert_allclose(together[2, ..., 3:4], whitener.innovations(columns[2, ..., 3:4]))


def test_the_filter_of_some_trials_is_that_of_these(whitener):
    columns = np.random.default_rng(3).standard_normal((TRIALS, SAMPLES, 2))
    some = whitener.take([2, 0], 8).innovations(columns[[2, 0], :8])
    np.testing.assert_allclose(some, whitener.innovations(columns)[[2, 0], :8])


@pytest.fixture(scope="module")
def band():
    """Up to a tenth of the sampling rate, in a trial and a shorter one."""
    return MotionBand.of(LENGTHS[:, None] > np.arange(240), 0.1)


LENGTHS = np.array([240, 150])


def test_a_band_keeps_what_is_slow_and_nothing_else_of_each_trial(band):
    n = np.arange(240)
    waves = [np.cos(2 * np.pi * frequency * (n + 0.5)) for frequency in (0.05, 0.15)]
    slow, fast = (np.where(LENGTHS[:, None] > n, wave, 0.0)[..., None] for wave in waves)
    np.testing.assert_allclose(band.innovations(2.0 * slow + fast), 2.0 * slow, atol=1e-10)
    np.testing.assert_allclose(
        band.take([1], 150).innovations(fast[1:, :150] - slow[1:, :150]), -slow[1:, :150], atol=1e-10
    )
    noise = np.random.default_rng(4).standard_normal((2, 240, 30)) * (LENGTHS[:, None] > n)[..., None]
    once = band.innovations(noise)
    np.testing.assert_allclose(band.innovations(once), once, atol=1e-12)
    assert (once**2).sum() / (noise**2).sum() == pytest.approx(0.2, rel=0.05), "a fifth of the frequencies"


@pytest.fixture(scope="module")
def force(band):
    """Covariance of the amplitudes of what some random pushes do."""
    pushes = 0.1 * np.random.default_rng(5).standard_normal((2, 240, 4))
    pushed = band.amplitudes(pushes)
    return pushed @ np.swapaxes(pushed, -1, -2)


def test_a_band_beside_a_force_makes_white_what_both_do(band, force):
    whitener = band.given_force(force, NOISE)
    for trial, waves in enumerate(band.waves):
        covariance = waves @ (force[trial] + NOISE**2 * np.eye(waves.shape[1])) @ waves.T
        root = np.linalg.cholesky(covariance + 1e-15 * np.eye(240))
        new = whitener.take([trial], 240).innovations(root[None])[0]
        np.testing.assert_allclose(new @ new.T, NOISE**2 * waves @ waves.T, atol=1e-3 * NOISE**2)


def test_a_filter_lets_through_what_a_butterworth_filter_forwards_and_backwards_does():
    samples, corner = 4000, 0.01
    for frequency in (0.005, 0.01, 0.02):
        wave = np.cos(2 * np.pi * frequency * np.arange(samples))
        passed = sosfiltfilt(butter(2, 2 * corner, output="sos"), wave)[1000:3000]
        assert let_through(np.array([frequency]), corner)[0] == pytest.approx(passed.std() / wave.std(), abs=0.002)
