"""Angles that were resampled along straight lines between the values that were measured."""

import numpy as np
import pytest

from myowave.data.knots import knots_of, straight
from myowave.identification.noise import noise_of


@pytest.mark.parametrize("knots", [2.0, 2.5, 2.5169, 3.0, 5.5975, 20.0])
def test_lines_between_measured_values_are_seen_and_a_smooth_or_noisy_angle_has_none(knots):
    random = np.random.default_rng(1)
    lines = straight(600, knots)
    angles = [lines @ (np.cumsum(random.standard_normal(lines.shape[1])) * 0.05) for _ in range(3)]
    assert knots_of(angles) == pytest.approx(knots, abs=1e-6), "on samples or between them"
    assert knots_of([random.standard_normal(600) for _ in range(3)]) is None
    assert knots_of([np.sin(np.arange(600) / 50)]) is None
    assert knots_of([np.zeros(600)]) is None
    assert knots_of([np.round(np.sin(np.arange(600) / 20), 1)]) is None


@pytest.mark.parametrize("knots", [1.0, 2.5169, 3.0, 5.5975])
def test_the_noise_of_such_an_angle_is_that_of_the_values_measured(knots):
    """Straight lines have no finest scale and tell next to no noise; what is read between samples tells less of it
    by up to a fifth."""
    random, lines = np.random.default_rng(2), straight(2000, knots)
    at = np.arange(lines.shape[1]) * knots / 50
    angles = [lines @ (np.sin(at) + 0.02 * random.standard_normal(len(at))) for _ in range(4)]
    assert noise_of(angles, None) == pytest.approx(0.02, rel=0.25)
    few = straight(24, knots) @ random.standard_normal(straight(24, knots).shape[1])
    assert noise_of([few], None) > 0, "too few values were measured to tell more"
