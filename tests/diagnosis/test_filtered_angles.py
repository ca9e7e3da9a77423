"""An angle that has passed a filter, as motion capture's has, is told from one that a force or an effect moves."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, filtfilt

from myowave.diagnosis.misfit import filtered
from myowave.diagnosis.misfit.filtered import has_passed_a_filter, noise_above
from myowave.diagnosis.misfit.size import size_of, size_of_misfit
from myowave.diagnosis.search.conclude import search
from myowave.identification.disturbance import estimate_disturbance
from myowave.identification.output_error import fit_model
from myowave.identification.record import make_record
from myowave.identification.whitening import Band

NOISE_DEG = 0.5
DAMPING = {"joint_damping": {"c": 1.0}}


def low_passed(trials, cutoff_hz):
    """Trials as motion capture gives them: through a Butterworth filter of second order, forwards and backwards."""
    angle = trials.angle.copy()
    for i, length in enumerate(trials.lengths):
        angle[i, :length] = filtfilt(*butter(2, cutoff_hz, fs=1 / trials.dt), angle[i, :length])
    return replace(trials, angle=angle)


def emg_made_noisy(trials, noise):
    random = np.random.default_rng(5)
    return replace(trials, emg=(trials.emg + noise * random.standard_normal(trials.emg.shape)).clip(0, 1))


@pytest.fixture(scope="module")
def make_strange_fit(make_trials, base, free):
    def make(change, hidden=None, noise_deg=NOISE_DEG):
        return fit_model(base, make_record(change(make_trials(hidden, noise_deg)), base).train, free, starts=2)

    return make


def judged(fit):
    size, disturbance = size_of_misfit(fit), estimate_disturbance(fit)
    return has_passed_a_filter(fit, size, disturbance), *noise_above(fit, size, disturbance)


@pytest.mark.parametrize("cutoff_hz", [4.0, 6.0])
def test_a_filter_is_seen_though_a_force_would_explain_so_smooth_a_residual(make_strange_fit, cutoff_hz):
    fit = make_strange_fit(lambda trials: low_passed(trials, cutoff_hz), DAMPING)
    passed, noise, gain = judged(fit)
    assert passed and gain > 20
    assert np.degrees(noise) == pytest.approx(NOISE_DEG, rel=0.25)


@pytest.mark.parametrize("emg", [0.0, 0.03])
def test_neither_a_missing_effect_nor_noise_of_the_emg_is_taken_for_a_filter(make_strange_fit, emg):
    passed, _, gain = judged(make_strange_fit(lambda trials: emg_made_noisy(trials, emg), DAMPING))
    assert not passed and gain < 10


def test_what_a_missing_effect_leaves_of_an_angle_without_noise_is_no_noise(make_strange_fit):
    _, _, gain = judged(make_strange_fit(lambda trials: trials, DAMPING, noise_deg=0.0))
    assert gain < 10


@pytest.mark.parametrize(("times", "gain", "expected"), [(3.0, 50.0, True), (1.5, 50.0, False), (3.0, 5.0, False)])
def test_a_filter_takes_much_from_the_noise_and_is_evident(make_strange_fit, monkeypatch, times, gain, expected):
    fit = make_strange_fit(lambda trials: trials, DAMPING)
    disturbance = estimate_disturbance(fit)
    monkeypatch.setattr(filtered, "noise_above", lambda *args: (times * disturbance.angle, gain))
    assert has_passed_a_filter(fit, size_of_misfit(fit), disturbance) == expected


@pytest.mark.parametrize("cutoff_hz", [4.0, 5.0, None])
def test_what_a_filter_takes_from_the_noise_beside_the_motion_is_added_again(make_trials, base, cutoff_hz):
    record = make_record(make_trials(noise_deg=0.0), base).train
    random, found, plain = np.random.default_rng(1), [], []
    for _ in range(30):
        noise = np.radians(NOISE_DEG) * random.standard_normal(record.angle.shape)
        if cutoff_hz is not None:
            noise = filtfilt(*butter(2, cutoff_hz, fs=1 / record.dt), noise, axis=-1)
        plain.append(size_of(noise, record.angle, record).noise)
        found.append(size_of(noise, record.angle, replace(record, filter=Band(0.1))).noise)
    assert np.degrees(np.median(found)) == pytest.approx(NOISE_DEG, rel=0.1)
    assert (np.array(found) >= np.array(plain) * (1 - 1e-6)).all()


def test_damping_is_found_behind_a_filter_and_nothing_else_is_said(make_strange_fit, effects):
    fit = make_strange_fit(lambda trials: low_passed(trials, 4.0), DAMPING)
    found = search(fit, [effects["joint_damping"], effects["gravity_tilt"]])
    assert found.selection.effects == ("joint_damping",) and found.settled and found.disturbance is None
    assert isinstance(found.selection.fit.record.filter, Band)
