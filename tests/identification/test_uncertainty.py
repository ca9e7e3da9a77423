"""Standard errors hold for noise of any colour."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from myowave.identification.least_squares import pseudo_inverse
from myowave.identification.output_error import fit_model
from myowave.identification.uncertainty import correlation_time, correlations, covariance


@pytest.mark.parametrize("colour", [0.0, 0.5, 0.9, 0.95])
def test_intervals_of_95_percent_hold_the_truth_about_so_often(make_noisy, base, free, colour):
    """On the linearised fit: the estimate that noise gives, and the residual that it leaves."""
    fit = fit_model(base, make_noisy(0.0).train, free)
    normal, random, held = fit.normal, np.random.default_rng(4), []
    projected = normal.without_starts(normal.slope)
    scale = np.array([p.scale for p in free])
    for _ in range(150):
        white = random.standard_normal((len(normal.residual), normal.residual.shape[1] + 200))
        noise = lfilter([1.0], [1.0, -colour], white)[:, 200:]
        error = pseudo_inverse(normal.matrix) @ np.einsum("tnp,tn->p", projected, noise)
        left = normal.without_starts((noise - normal.slope @ error)[..., None])[..., 0]
        found = replace(normal, residual=left, rss=(left**2).sum())
        held.append(np.abs(error * scale) < 1.96 * np.sqrt(np.diag(covariance(found, fit.record, free))))
    assert 0.89 < np.mean(held) < 0.99


def test_slow_residuals_are_worth_fewer_samples(make_noisy, base, free):
    fit = fit_model(base, make_noisy(0.5).train, free)
    assert correlation_time(fit.normal.residual, fit.record) < 1.3
    slow = np.sin(np.arange(200) / 8.0) * np.ones((3, 1))
    assert correlation_time(slow, fit.record) > 5.0


def test_correlations_are_1_on_the_diagonal_and_at_most_1_beside_it(make_noisy, base, free):
    found = correlations(fit_model(base, make_noisy(0.5).train, free).covariance())
    np.testing.assert_allclose(np.diag(found), 1.0)
    assert (np.abs(found) <= 1 + 1e-9).all() and (np.abs(found - np.eye(len(free))) > 0.01).any()
