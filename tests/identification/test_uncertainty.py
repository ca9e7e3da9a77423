"""Standard errors hold for noise of any colour."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from myowave.diagnosis.report.numbers import estimate
from myowave.identification.free_parameters import expected, free_parameters
from myowave.identification.least_squares import correlations, pseudo_inverse
from myowave.identification.noise import correlation_time
from myowave.identification.output_error import fit_model
from myowave.physics.constants import CURVE_CONSTANTS
from myowave.settings import Scatter


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
        yield step * scale, replace(fit, normal=replace(normal, residual=left))


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


def test_what_the_data_cannot_tell_apart_is_not_known(fitted):
    """A direction of the parameters that no motion shows has no end, where its sum is rounding and where it is 0."""
    slope, names = fitted.normal.slope, [p.name for p in fitted.free]
    alike, unseen = slope.copy(), slope.copy()
    alike[..., 1], unseen[..., 0] = alike[..., 0], 0.0
    for columns, lost in ((alike, names[:2]), (unseen, names[:1])):
        errors = replace(fitted, normal=replace(fitted.normal, slope=columns)).standard_errors()
        for p in fitted.free:
            told = estimate(p.start, errors[p.name], (p.low, p.high))
            assert told.endswith("not known") == (p.name in lost), (p.name, told)
            assert np.isfinite(errors[p.name])


def test_the_variance_of_white_noise_is_found_without_bias(fitted):
    """Though a fit takes a part of the noise with it: 10 of 600 degrees of freedom, of which 4 are parameters."""
    draws = estimates_in_noise(fitted, 0.0, 1000, seed=6)
    found = np.mean([noisy.variance for _, noisy in draws])
    assert found == pytest.approx(np.radians(0.5) ** 2, rel=0.005)


@pytest.fixture(scope="module")
def guessed(exact, base, identify):
    """A fit of two dozen constants that nobody measured, to 50 samples."""
    scatter = {"delay": Scatter(absolute=0.02), "shape": Scatter(absolute=0.2)}
    scatter |= {c: Scatter(relative=0.1) for c in ("vmax", "slack", "l1", "l2")}
    scatter |= {f"{c}_curve": Scatter(absolute=0.1) for c in CURVE_CONSTANTS}
    record = replace(exact.take([0]), emg=exact.emg[:1, :50], angle=exact.angle[:1, :50], valid=exact.valid[:1, :50])
    record = replace(record, noise=np.radians(0.5))
    return fit_model(base, record, free_parameters(base, identify, (), scatter))


def test_constants_that_are_rather_known_than_fitted_count_little_in_the_variance(guessed):
    """True values scatter about the expected ones as is said of them, and white noise is added."""
    normal, samples, random = guessed.normal, guessed.record.samples, np.random.default_rng(7)
    variance = np.radians(0.5) ** 2
    weight = expected(guessed.free)[1] * guessed.record.misfit**2
    deviation = np.where(weight > 0, np.sqrt(variance / weight.clip(1e-300)), 0.0)
    projected, found = normal.without_starts(normal.slope), []
    for _ in range(1000):
        noise = np.radians(0.5) * random.standard_normal(normal.residual.shape)
        seen = normal.slope @ (deviation * random.standard_normal(len(deviation))) + noise
        step = pseudo_inverse(normal.matrix) @ np.einsum("tnp,tn->p", projected, seen)
        left = normal.without_starts((seen - normal.slope @ step)[..., None])[..., 0]
        found.append(replace(normal, residual=left).variance(samples))
    assert len(guessed.free) > 0.4 * samples
    assert np.mean(found) == pytest.approx(variance, rel=0.02)


def test_a_variance_is_positive_however_few_samples_there_are(guessed):
    assert all(guessed.normal.variance(samples) > 0 for samples in (2, 5, 20))


def test_slow_residuals_are_worth_fewer_samples(make_noisy, base, free):
    fit = fit_model(base, make_noisy(0.5).train, free)
    assert correlation_time(fit.normal.residual, fit.record.samples) < 1.3
    slow = np.sin(np.arange(200) / 8.0) * np.ones((3, 1))
    assert correlation_time(slow, fit.record.samples) > 5.0


def test_correlations_are_1_on_the_diagonal_and_at_most_1_beside_it(make_noisy, base, free):
    found = correlations(fit_model(base, make_noisy(0.5).train, free).covariance())
    np.testing.assert_allclose(np.diag(found), 1.0)
    assert (np.abs(found) <= 1 + 1e-9).all() and (np.abs(found - np.eye(len(free))) > 0.01).any()
