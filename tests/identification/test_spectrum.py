"""Spectra tell noise of the angle, a random force and a filter apart."""

import numpy as np
import pytest

from myowave.identification.disturbance import excitation_forcing
from myowave.identification.output_error import fit_model
from myowave.identification.spectrum import answers
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
