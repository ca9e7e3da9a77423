"""How much is missing, and whether it is the same in all trials: noise is nothing, whatever filter it has passed."""

import numpy as np
import pytest
from scipy.signal import butter, filtfilt

from myowave.diagnosis.misfit.repeated import Repeated, repeated_misfit
from myowave.diagnosis.misfit.size import LEAST_RATIO, Size, size_of, size_of_misfit
from myowave.identification.record import make_record

NOISE_DEG = 0.5


@pytest.fixture(scope="module")
def record(make_trials, base):
    return make_record(make_trials(noise_deg=0.0), base).train


def noise(record, seed, cutoff_hz=None):
    """White noise of 0.5 deg, or what a filter with zero phase lets through of it."""
    white = np.radians(NOISE_DEG) * np.random.default_rng(seed).standard_normal(record.angle.shape)
    if cutoff_hz is None:
        return white
    return filtfilt(*butter(4, cutoff_hz, fs=1 / record.dt), white, axis=-1)


@pytest.mark.parametrize("cutoff_hz", [None, 4.0])
def test_noise_is_no_misfit_whether_an_angle_has_passed_a_filter_or_not(record, cutoff_hz):
    sizes = [size_of(noise(record, seed, cutoff_hz), record.angle, record) for seed in range(30)]
    assert not any(size.significant for size in sizes)
    assert np.degrees(np.median([size.noise for size in sizes])) == pytest.approx(NOISE_DEG, rel=0.1)
    assert np.mean([size.ratio for size in sizes]) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("cutoff_hz", [None, 4.0])
def test_what_is_slow_is_missing_with_its_root_mean_square(record, cutoff_hz):
    t = record.dt * np.arange(record.angle.shape[1])
    slow = np.radians(0.4) * np.sqrt(2) * np.sin(2 * np.pi * 0.31 * t)
    size = size_of(noise(record, 0, cutoff_hz) + slow, record.angle, record)
    assert size.edge_hz > 0.5 and size.significant and size.excess > 100
    assert np.degrees(size.missing) == pytest.approx(0.4, rel=0.15)
    assert np.degrees(size.noise) == pytest.approx(NOISE_DEG, rel=0.3)


def test_what_is_fast_is_not_missing(record):
    t = record.dt * np.arange(record.angle.shape[1])
    fast = np.radians(0.4) * np.sqrt(2) * np.sin(2 * np.pi * 8.0 * t)
    assert not size_of(noise(record, 0) + fast, record.angle, record).significant


def test_fitted_parameters_are_counted_off(record):
    """They take power out of the band, as if the noise in it were less."""
    some, none = (size_of(noise(record, 1), record.angle, record, fitted) for fitted in (10, 0))
    assert some.independent == none.independent - 10
    floor = np.radians(0.05) ** 2  # of the smallest noise that counts
    slow = [size.ratio * size.noise**2 - floor for size in (some, none)]
    assert slow[0] / slow[1] == pytest.approx(none.independent / some.independent)


def test_a_misfit_is_significant_where_chance_would_not_make_it_and_it_is_large_enough():
    size = Size(0.01, 0.0, 1.3, 1.2, 1.0, 100.0)
    assert size.significant and size.excess == pytest.approx(30.0)
    assert not Size(0.01, 0.0, 1.3, 1.4, 1.0, 100.0).significant, "by chance"
    assert not Size(0.01, 0.0, LEAST_RATIO - 0.01, 1.1, 1.0, 1e5).significant, "next to nothing"
    assert Size(0.01, 0.0, 0.9, 1.2, 1.0, 100.0).excess == 0.0


@pytest.mark.parametrize("seed", range(3, 8))
def test_noise_repeats_in_no_trial(make_fit, seed):
    fit = make_fit(seed=seed)
    repeated = repeated_misfit(fit, size_of_misfit(fit))
    assert not repeated.significant
    assert repeated.gain < 2 * repeated.freedom


@pytest.mark.parametrize(("effect", "parameter", "value"), [("joint_damping", "c", 0.3), ("emg_crosstalk", "x", 0.1)])
def test_what_physics_misses_repeats_in_all_trials(make_fit, effect, parameter, value):
    fit = make_fit({effect: {parameter: value}})
    size = size_of_misfit(fit)
    repeated = repeated_misfit(fit, size)
    assert repeated.significant and repeated.excess > 10
    assert repeated.gain < 1.2 * fit.objective / fit.variance, "it explains no more than there is"


def test_a_correction_is_significant_only_beyond_its_freedom():
    assert not Repeated(20.0, 20.0, 1.0).significant and Repeated(60.0, 20.0, 1.0).significant
    assert Repeated(15.0, 20.0, 1.0).excess == 0.0 and Repeated(25.0, 20.0, 1.0).excess == 5.0


def test_what_noise_often_gives_is_not_certainly_left():
    """A sum of 50 squares of noise scatters by 10."""
    assert Repeated(58.0, 50.0, 1.0).certain == 0.0 and Repeated(75.0, 50.0, 1.0).certain == pytest.approx(15.0)
    assert Size(0.01, 0.0, 1.1, 1.2, 1.0, 50.0).certain == 0.0
    assert Size(0.01, 0.0, 1.4, 1.2, 1.0, 50.0).certain == pytest.approx(10.0)
