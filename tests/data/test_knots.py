"""Angles that were resampled along straight lines between the values that were measured."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from myowave.data.knots import knots_of, straight
from myowave.identification.noise import noise_of


def lines(samples, step, begin=0.0):
    """What makes of values at even places from a first one on all samples of a trial."""
    return straight(samples, begin + step * np.arange(np.ceil((samples - 1 - begin) / step - 1e-9) + 1))


def walk(random, count):
    return np.cumsum(random.standard_normal(count)) * 0.05


@pytest.mark.parametrize("decimals", [None, 5])
@pytest.mark.parametrize("step", [1.2, 1.736, 2.0, 2.5, 2.5169, 3.0, 5.5975, 20.0])
def test_lines_between_measured_values_are_seen_wherever_a_trial_begins(step, decimals):
    random = np.random.default_rng(1)
    begins = [0.0, -1.0, 0.0 if step == 2.0 else 0.4 - step]  # all samples kink there, and below 2
    each = [lines(n, step, begin) for n, begin in zip((600, 593, 811), begins, strict=True)]
    angles = [own @ walk(random, own.shape[1]) for own in each]
    angles = angles if decimals is None else [np.round(angle, decimals) for angle in angles]
    found = knots_of(angles)
    assert found is not None, "on samples or between them"
    for knots, begin, own in zip(found, begins, each, strict=True):
        assert knots == pytest.approx(begin + step * np.arange(own.shape[1]), abs=1e-6 if decimals is None else 0.01)


def test_a_smooth_noisy_still_or_rounded_angle_runs_along_no_lines():
    random, at = np.random.default_rng(1), np.arange(600)
    assert knots_of([random.standard_normal(600) for _ in range(3)]) is None
    assert knots_of([np.sin(at / 50)]) is None
    assert knots_of([np.sin(at / 50), np.sin(at / 37) ** 2]) is None
    assert knots_of([np.zeros(600)]) is None
    assert all(knots_of([random.standard_normal(40) for _ in range(4)]) is None for _ in range(30)), "chance"
    assert knots_of([np.round(np.sin(at / 20), 1)]) is None
    slow = [45 + 6 * np.sin(np.pi / 2 * (np.arange(6000) / 1000 + late)) for late in (0.0, 0.7, 1.1)]
    assert knots_of([np.radians(np.round(angle)) for angle in slow]) is None, "few kinks are no lines"


@pytest.mark.parametrize("step", [1.2, 1.736, 2.5, 5.5975])
def test_smooth_curves_through_measured_values_are_no_lines(step):
    random = np.random.default_rng(3)
    angles = [make_interp_spline(np.arange(300.0), walk(random, 300))(np.arange(0.4, 299, 1 / step)) for _ in range(3)]
    assert knots_of(angles) is None


@pytest.mark.parametrize("step", [1.0, 1.736, 2.5169, 3.0, 5.5975])
def test_the_noise_of_such_an_angle_is_that_of_the_values_measured(step):
    """Straight lines have no finest scale and tell next to no noise."""
    random, own = np.random.default_rng(2), lines(2000, step)
    at = np.arange(own.shape[1]) * step / 50
    angles = [own @ (np.sin(at) + 0.02 * random.standard_normal(len(at))) for _ in range(4)]
    assert noise_of(angles, None) == pytest.approx(0.02, rel=0.1)
    few = lines(24, step)
    assert noise_of([few @ random.standard_normal(few.shape[1])], None) > 0, "too few values were measured to tell more"
