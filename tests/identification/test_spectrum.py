"""Spectra tell noise of the angle, a random force and a filter apart."""

from dataclasses import replace

import numpy as np
import pytest

from myowave.identification.disturbance import excitation_forcing
from myowave.identification.noise import SMALLEST_NOISE_DEG
from myowave.identification.output_error import fit_model
from myowave.identification.spectrum import Guess, Spectra, answers, covariance
from myowave.identification.whitening import MotionBand


@pytest.fixture(scope="module")
def fit(make_noisy, base, free):
    return fit_model(base, make_noisy(0.5).train, free)


@pytest.fixture(scope="module")
def steps(fit):
    return fit.linear.jacobian.numpy(), excitation_forcing(fit)


def test_amplitudes_answer_to_pushes_as_the_motion_does(fit, steps):
    jacobian, forcing = steps
    waves = MotionBand.of(fit.record.valid, 0.05).waves
    pushes = np.random.default_rng(0).standard_normal((*forcing.shape[:2], 2))
    state, angle = np.zeros((len(forcing), jacobian.shape[-1])), [np.zeros(len(forcing))]
    for n in range(forcing.shape[1]):
        state = (jacobian[:, n] @ state[..., None] + forcing[:, n] @ pushes[:, n, :, None])[..., 0]
        angle.append(state[:, 0])
    expected = np.einsum("tnw,tn->tw", waves, np.stack(angle, -1))
    parts = zip(answers(jacobian, forcing, waves), reversed(range(forcing.shape[1])), strict=True)
    found = sum(np.einsum("tmw,tm->tw", answer, pushes[:, n]) for answer, n in parts)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


def test_the_covariance_is_that_of_answers_to_many_forces(fit, steps):
    jacobian, forcing = steps
    waves = MotionBand.of(fit.record.valid, 0.02).waves
    pushes = np.random.default_rng(1).standard_normal((4000, *forcing.shape[:2], 2))
    drawn = 0.0
    for answer, n in zip(answers(jacobian, forcing, waves), reversed(range(forcing.shape[1])), strict=True):
        drawn = drawn + np.einsum("tmw,dtm->dtw", answer, pushes[:, :, n])
    expected = np.einsum("dtw,dtv->twv", drawn, drawn) / len(pushes)
    found = covariance(jacobian, forcing, waves)
    np.testing.assert_allclose(found, expected, atol=0.1 * np.abs(expected).max())


def test_the_likelihood_is_whittles(fit, steps):
    spectra = Spectra.of(fit, steps[1], 0.02, 6.0)
    guess = Guess(noise=0.01, emg=0.03, corner=0.1)
    through = 1 / (1 + (spectra.waves.frequency / 0.1) ** 4)
    variance = through**2 * 0.01**2 + 0.03**2 * spectra.force + np.radians(SMALLEST_NOISE_DEG) ** 2
    each = np.log(variance) + spectra.residual**2 / variance
    assert spectra.unlikely(guess) == pytest.approx(each[:, 1:].sum()), "all but the mean"
    assert spectra.waves.edge == pytest.approx(0.12)


@pytest.mark.parametrize("emg", [0.0, 0.02])
@pytest.mark.parametrize("corner", [np.inf, 0.15])
def test_what_made_spectra_is_found(fit, steps, emg, corner):
    made = Spectra.of(fit, steps[1], 0.03, 14.0)
    random, noise, found = np.random.default_rng(2), 0.01, []
    through = 1 / (1 + (made.waves.frequency / corner) ** 4)
    for _ in range(10):
        left = np.sqrt((through * noise) ** 2 + emg**2 * made.force) * random.standard_normal(made.force.shape)
        drawn = replace(made, residual=left)
        found.append(drawn.most_likely(forced=True, filtered=np.isfinite(corner)))
        without, with_one = (drawn.most_likely(forced=True, filtered=filtered).unlikely for filtered in (False, True))
        assert (without - with_one > 25) == np.isfinite(corner)
    assert np.median([each.noise for each in found]) == pytest.approx(noise, rel=0.25)
    assert np.median([each.emg for each in found]) == pytest.approx(emg, rel=0.15, abs=3e-3)
    assert np.median([each.corner for each in found]) == pytest.approx(corner, rel=0.15)
