"""A trial kept for testing tells its start with its first second, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from myowave.diagnosis.heldout import BEGINNING_S, predict
from myowave.diagnosis.record import make_record


@pytest.fixture(scope="module")
def test_record(make_trials, base):
    record = make_record(make_trials(noise_deg=0.5), base)
    return record.take(np.flatnonzero(~record.training))


@pytest.fixture(scope="module")
def fit(make_fit):
    return make_fit(noise_deg=0.5)


def test_what_comes_after_the_first_second_changes_no_prediction(fit, test_record):
    late = np.arange(test_record.angle.shape[1]) * test_record.dt > BEGINNING_S
    moved = test_record.angle + 0.05 * late * np.sin(np.arange(len(late)))
    one, other = predict(fit, test_record), predict(fit, replace(test_record, angle=moved))
    np.testing.assert_allclose(one.angle, other.angle, rtol=0, atol=1e-7)
    assert other.rmse > 1.5 * one.rmse


def test_the_first_second_tells_where_the_trial_starts(fit, test_record):
    early = np.arange(test_record.angle.shape[1]) * test_record.dt <= BEGINNING_S
    one, other = predict(fit, test_record), predict(fit, replace(test_record, angle=test_record.angle + 0.05 * early))
    assert np.abs(other.angle - one.angle)[early[None]].max() > 0.005


def test_the_right_model_leaves_little_more_than_the_noise_of_the_unseen_trial(fit, test_record):
    found = predict(fit, test_record)
    assert np.degrees(found.rmse) == pytest.approx(0.5, rel=0.3)
    assert found.rmse == pytest.approx(np.sqrt((found.residual**2).sum() / test_record.samples))
    np.testing.assert_allclose(found.residual, test_record.angle - found.angle)
