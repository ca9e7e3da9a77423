"""Standard errors hold for noise of any colour."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from myowave.identification.least_squares import correlations
from myowave.identification.noise import correlation_time
from myowave.identification.output_error import fit_model


def estimates_in_noise(fit, colour, count, seed):
    """What noise as large as that of a goniometer, with this first-order autocorrelation, makes of an exact fit, to
    first order: errors of the parameters (P,), SI units, and the fit with the residual that is left."""
    normal, random = fit.normal, np.random.default_rng(seed)
    projected, scale = normal.without_starts(normal.slope), np.array([p.scale for p in fit.free])
    for _ in range(count):
        white = random.standard_normal((len(normal.residual), normal.residual.shape[1] + 200))
        noise = np.radians(0.5) * lfilter([1.0], [1.0, -colour], white)[:, 200:]
        step = np.linalg.solve(normal.matrix, np.einsum("tnp,tn->p", projected, noise))
        left = normal.without_starts((noise - normal.slope @ step)[..., None])[..., 0]
        yield step * scale, replace(fit, normal=replace(normal, residual=left, rss=(left**2).sum()))


@pytest.fixture(scope="module")
def fitted(exact, base, free):
    return fit_model(base, exact, free)


@pytest.mark.parametrize("colour", [0.0, 0.5, 0.9, 0.95])
def test_intervals_of_95_percent_hold_the_truth_about_so_often(fitted, colour):
    held = [
        np.abs(error) < 1.96 * np.sqrt(np.diag(noisy.covariance()))
        for error, noisy in estimates_in_noise(fitted, colour, 150, seed=4)
    ]
    assert 0.89 < np.mean(held) < 0.99


@pytest.mark.parametrize("colour", [0.0, 0.8])
def test_standard_errors_are_the_scatter_of_estimates_in_noise_of_any_colour(fitted, colour):
    scores = [
        error / np.sqrt(np.diag(noisy.covariance())) for error, noisy in estimates_in_noise(fitted, colour, 40, seed=5)
    ]
    assert 0.8 < np.sqrt(np.mean(np.square(scores))) < 1.3


def test_no_parameter_is_known_better_than_two_solvers_agree(fitted):
    """Trials without noise, that the fitted program made itself."""
    scale = np.array([p.scale for p in fitted.free])
    of_solvers = np.radians(0.005) * np.sqrt(np.diag(np.linalg.inv(fitted.normal.matrix))) * scale
    assert (np.sqrt(np.diag(fitted.covariance())) >= 0.99 * of_solvers).all()


def test_the_variance_of_white_noise_is_found_without_bias(fitted):
    """Though a fit takes a part of the noise with it: 10 of 600 degrees of freedom, of which 4 are parameters."""
    draws = estimates_in_noise(fitted, 0.0, 1000, seed=6)
    found = np.mean([noisy.variance for _, noisy in draws])
    assert found == pytest.approx(np.radians(0.5) ** 2, rel=0.005)


def test_slow_residuals_are_worth_fewer_samples(make_noisy, base, free):
    fit = fit_model(base, make_noisy(0.5).train, free)
    assert correlation_time(fit.normal.residual, fit.record.samples) < 1.3
    slow = np.sin(np.arange(200) / 8.0) * np.ones((3, 1))
    assert correlation_time(slow, fit.record.samples) > 5.0


def test_correlations_are_1_on_the_diagonal_and_at_most_1_beside_it(make_noisy, base, free):
    found = correlations(fit_model(base, make_noisy(0.5).train, free).covariance())
    np.testing.assert_allclose(np.diag(found), 1.0)
    assert (np.abs(found) <= 1 + 1e-9).all() and (np.abs(found - np.eye(len(free))) > 0.01).any()
