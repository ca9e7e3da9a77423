"""Trials that no fit has seen are predicted, from nothing of them but their first second."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.identification.output_error import fit_model
from myowave.identification.prediction import BEGINNING_S, predict


@pytest.fixture(scope="module")
def fitted(exact, base, free):
    return fit_model(base, exact, free)


def test_an_exact_model_predicts_a_trial_it_has_not_seen(fitted, make_noisy):
    kept = make_noisy(0.0)
    found = predict(fitted, kept.take([3]))
    assert found.rmse < np.radians(1e-3)
    assert found.rmse == pytest.approx(found.rmse_by_trial[0])


def test_what_comes_after_the_first_second_does_not_change_the_prediction(fitted, make_noisy):
    record = make_noisy(0.5).take([3])
    late = np.arange(record.angle.shape[1]) * record.dt > BEGINNING_S
    moved = replace(record, angle=record.angle + 0.5 * late)
    one, other = predict(fitted, record), predict(fitted, moved)
    # The first guess of the start is a smoothed angle, which may see a little further.
    np.testing.assert_allclose(one.angle, other.angle, atol=1e-4)
    assert other.rmse > 0.3


def test_known_constants_of_the_new_trials_take_part(fitted, make_noisy, base):
    record = make_noisy(0.0).take([3])
    loaded = replace(record, known={"load": torch.tensor([0.3], dtype=torch.float64)})
    assert predict(fitted, loaded).rmse > 10 * predict(fitted, record).rmse
