"""The fit finds what made the motion, says how sure it is, and never gets worse by knowing more."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from myowave.diagnosis.fit import correlation_time, fit_model, free_parameters, polish
from myowave.diagnosis.record import make_record
from myowave.diagnosis.score import score_effect
from myowave.settings import Identify


def test_noiseless_motion_gives_back_its_parameters_from_a_far_start(make_trials, base, free):
    record = make_record(make_trials(noise_deg=0.0), base).train
    far = tuple(replace(p, start=p.start * (0.6 if p.name.startswith("f0") else 1.1)) for p in free)
    fit = fit_model(base, record, far, starts=4)
    assert fit.converged
    for name, value in fit.parameters.items():
        assert value == pytest.approx(base.defaults[name], rel=2e-3)


def test_standard_errors_are_as_large_as_the_errors(make_trials, base, free):
    scores = []
    for seed in range(8):
        record = make_record(make_trials(noise_deg=1.0, seed=seed), base).train
        fit = fit_model(base, record, free)
        errors = fit.standard_errors()
        scores += [(value - base.defaults[name]) / errors[name] for name, value in fit.parameters.items()]
    assert 0.7 < np.sqrt(np.mean(np.square(scores))) < 1.4


@pytest.mark.parametrize("colour", [0.0, 0.8])
def test_standard_errors_hold_for_noise_of_any_colour(colour, make_fit):
    """To first order: what least squares makes of noise that is a motion's whole residual."""
    fit, random, scores = make_fit(noise_deg=0.1), np.random.default_rng(5), []
    normal, scale = fit.normal, np.array([p.scale for p in fit.free])
    for _ in range(40):
        white = random.standard_normal((len(fit.record.names), 100 + fit.record.angle.shape[1]))
        noise = np.radians(0.5) * lfilter([1.0], [1.0, -colour], white)[:, 100:]
        step = np.linalg.solve(normal.matrix, np.einsum("tnp,tn->p", normal.without_starts(normal.slope), noise))
        left = normal.without_starts((noise - normal.slope @ step)[..., None])[..., 0]
        noisy = replace(fit, normal=replace(normal, residual=left, rss=(left**2).sum()))
        scores.append(step * scale / np.sqrt(np.diag(noisy.covariance())))
    assert 0.8 < np.sqrt(np.mean(np.square(scores))) < 1.3


def test_what_pads_a_short_trial_has_no_influence(make_trials, base, free):
    trials = make_trials()
    record = make_record(trials, base).train
    valid = record.valid.copy()
    valid[1, 150:] = False
    short = replace(record, valid=valid)
    nonsense = record.angle.copy()
    nonsense[1, 150:] = 3.0
    one = fit_model(base, short, free)
    other = fit_model(base, replace(short, angle=np.where(valid, record.angle, nonsense)), free)
    np.testing.assert_allclose(one.values, other.values, rtol=1e-6)


def test_estimates_stay_within_their_bounds(make_trials, base):
    record = make_record(make_trials(), base).train
    narrow = {"f0_Bi": Identify(low=200.0, high=280.0), "l0_Bi": Identify()}
    fit = fit_model(base, record, free_parameters(base, narrow, ()))
    assert fit.parameters["f0_Bi"] == pytest.approx(280.0)
    assert fit.at_bound("f0_Bi") and not fit.at_bound("l0_Bi")


@pytest.mark.parametrize(
    "name", ["joint_damping", "emg_gain", "activation_dynamics", "compliant_tendon", "clock_shift"]
)
def test_an_effect_more_never_fits_worse(make_fit, effects, name):
    fit = make_fit({"emg_crosstalk": {"x": 0.1}})
    assert polish(score_effect(fit, effects[name]).start).rss <= fit.rss * (1 + 1e-9)


def test_slow_residuals_are_worth_fewer_samples(make_fit):
    fit = make_fit()
    assert correlation_time(fit.normal.residual, fit.record) < 1.3
    slow = np.sin(np.arange(200) / 8.0) * np.ones((3, 1))
    assert correlation_time(slow, fit.record) > 5.0
