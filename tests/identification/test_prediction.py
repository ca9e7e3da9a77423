"""A trial that no fit has seen tells its start with its first second, and nothing else of it has a part."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from myowave.data.simulate import simulate_trials
from myowave.identification.free_parameters import effect_parameters
from myowave.identification.output_error import fit_model
from myowave.identification.prediction import BEGINNING_S, predict
from myowave.identification.record import make_record


@pytest.fixture(scope="module")
def fitted(exact, base, free):
    return fit_model(base, exact, free)


@pytest.fixture(scope="module")
def kept(make_noisy):
    """The trial that is kept, as a sensor sees it."""
    return make_noisy(0.5).take([3])


def test_an_exact_model_predicts_a_trial_it_has_not_seen(fitted, make_noisy):
    found = predict(fitted, make_noisy(0.0).take([3]))
    assert found.rmse < np.radians(1e-3)
    assert found.rmse == pytest.approx(np.sqrt((found.residual**2).mean()))


def test_what_comes_after_the_first_second_changes_no_prediction(fitted, kept):
    late = np.arange(kept.angle.shape[1]) * kept.dt > BEGINNING_S
    moved = kept.angle + 0.05 * late * np.sin(np.arange(len(late)))
    one, other = predict(fitted, kept), predict(fitted, replace(kept, angle=moved))
    np.testing.assert_allclose(kept.angle - one.residual, moved - other.residual, rtol=0, atol=1e-7)
    assert other.rmse > 1.5 * one.rmse


def test_the_first_second_tells_where_the_trial_starts(fitted, kept):
    early = np.arange(kept.angle.shape[1]) * kept.dt <= BEGINNING_S
    moved = kept.angle + 0.05 * early
    one, other = predict(fitted, kept), predict(fitted, replace(kept, angle=moved))
    assert np.abs((moved - other.residual) - (kept.angle - one.residual))[early[None]].max() > 0.005


def test_the_right_model_leaves_little_more_than_the_noise_of_the_unseen_trial(make_noisy, base, free, kept):
    found = predict(fit_model(base, make_noisy(0.5).train, free), kept)
    assert np.degrees(found.rmse) == pytest.approx(0.5, rel=0.3)
    assert found.rmse == pytest.approx(np.sqrt((found.residual**2).sum() / kept.samples))


def test_known_constants_of_the_new_trials_take_part(fitted, make_noisy):
    record = make_noisy(0.0).take([3])
    loaded = replace(record, known={"load": torch.tensor([0.3], dtype=torch.float64)})
    assert predict(fitted, loaded).rmse > 10 * predict(fitted, record).rmse


def test_muscles_that_have_worked_are_tired_where_a_piece_begins(dataset, base, effects):
    hiding = dataset.model_copy(update={"hidden_effect": {"fatigue": {"k": 0.8}}})
    record = make_record(simulate_trials("tired", hiding, base, effects)[0], base)
    model = base.with_effects([effects["fatigue"]])
    free = effect_parameters(model, effects["fatigue"])
    true, rested = (
        predict(SimpleNamespace(model=model, free=free, values=np.array([k])), record.cut(0.5)).rmse for k in (0.8, 0.0)
    )
    assert true < np.radians(0.1) < rested / 3


def test_a_measured_torque_has_no_part_in_where_a_trial_starts(fitted, kept):
    told = replace(kept, torque=np.full_like(kept.angle, np.nan))
    np.testing.assert_array_equal(predict(fitted, told).residual, predict(fitted, kept).residual)
