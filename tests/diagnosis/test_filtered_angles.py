"""An angle that has passed a filter, as motion capture's has, is told from one that a force or an effect moves."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d
from scipy.signal import butter, filtfilt, savgol_filter

from myowave.diagnosis.misfit.filtered import EVIDENCE, evidence_of_a_filter, has_passed_a_filter, noise_left
from myowave.diagnosis.misfit.size import size_of, size_of_misfit
from myowave.diagnosis.search import conclude
from myowave.diagnosis.search.conclude import search, within_band
from myowave.diagnosis.search.verdict import judge
from myowave.identification.disturbance import estimate_disturbance
from myowave.identification.output_error import fit_model
from myowave.identification.record import make_record
from myowave.identification.whitening import MotionBand

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


def evidence(fit):
    return evidence_of_a_filter(fit, size_of_misfit(fit))


@pytest.mark.parametrize("emg", [0.0, 0.03])
@pytest.mark.parametrize("hidden", [None, DAMPING, {"gravity_tilt": {"phi": 0.4}}])
@pytest.mark.parametrize("cutoff_hz", [4.0, 8.0])
def test_a_filter_is_seen_though_a_force_would_explain_so_smooth_a_residual(make_strange_fit, cutoff_hz, hidden, emg):
    fit = make_strange_fit(lambda trials: low_passed(emg_made_noisy(trials, emg), cutoff_hz), hidden)
    assert evidence(fit) > 1.5 * EVIDENCE and has_passed_a_filter(fit, size_of_misfit(fit))


@pytest.mark.parametrize(
    "smooth", [lambda x: savgol_filter(x, 9, 2, axis=-1), lambda x: uniform_filter1d(x, 5, axis=-1)]
)
def test_nor_need_it_be_the_filter_that_is_assumed(make_strange_fit, smooth):
    fit = make_strange_fit(lambda trials: replace(trials, angle=smooth(trials.angle)), DAMPING)
    assert evidence(fit) > 1.5 * EVIDENCE


@pytest.mark.parametrize("noise_deg", [0.0, NOISE_DEG])
@pytest.mark.parametrize("emg", [0.0, 0.03])
@pytest.mark.parametrize("hidden", [DAMPING, {"gravity_tilt": {"phi": 0.4}}])
def test_neither_a_missing_effect_nor_noise_of_the_emg_is_taken_for_a_filter(make_strange_fit, hidden, emg, noise_deg):
    fit = make_strange_fit(lambda trials: emg_made_noisy(trials, emg), hidden, noise_deg)
    assert evidence(fit) < EVIDENCE / 2 and not has_passed_a_filter(fit, size_of_misfit(fit))


def test_an_arm_that_does_not_move_shows_no_filter(make_strange_fit):
    fit = make_strange_fit(lambda trials: trials)
    assert evidence_of_a_filter(fit, replace(size_of_misfit(fit), edge_hz=0.0)) == 0.0


@pytest.mark.parametrize("cutoff_hz", [4.0, 5.0, None])
def test_what_a_filter_takes_from_the_noise_beside_the_motion_is_added_again(make_trials, base, cutoff_hz):
    record = make_record(make_trials(noise_deg=0.0), base).train
    random, found, plain = np.random.default_rng(1), [], []
    for _ in range(30):
        noise = np.radians(NOISE_DEG) * random.standard_normal(record.angle.shape)
        if cutoff_hz is not None:
            noise = filtfilt(*butter(2, cutoff_hz, fs=1 / record.dt), noise, axis=-1)
        plain.append(size_of(noise, record.angle, record).noise)
        found.append(size_of(noise, record.angle, replace(record, filter=MotionBand.of(record.valid, 0.1))).noise)
    assert np.degrees(np.median(found)) == pytest.approx(NOISE_DEG, rel=0.1)
    assert (np.array(found) >= np.array(plain) * (1 - 1e-6)).all()


def test_damping_is_found_behind_a_filter_and_nothing_else_is_said(make_strange_fit, effects):
    fit = make_strange_fit(lambda trials: low_passed(trials, 4.0), DAMPING)
    found = search(fit, [effects["joint_damping"], effects["gravity_tilt"]])
    assert found.selection.effects == ("joint_damping",) and found.left.only_noise and found.disturbance is None
    assert isinstance(found.selection.fit.record.filter, MotionBand)


@pytest.mark.parametrize("hidden", [{}, {"joint_damping": {"c": 2.0}}])
def test_noise_of_the_emg_is_named_behind_a_filter_alone_and_beside_an_effect(make_strange_fit, effects, hidden):
    fit = make_strange_fit(lambda trials: low_passed(emg_made_noisy(trials, 0.03), 6.0), hidden)
    found = search(fit, [effects["joint_damping"], effects["gravity_tilt"]])
    verdict = judge(found)
    assert verdict.causes == (*hidden, "emg_noise") and not verdict.structure_left
    assert verdict.emg_noise == pytest.approx(0.03, rel=0.35)
    assert isinstance(found.selection.fit.record.filter, MotionBand)


def test_an_angle_without_any_noise_is_not_explained_by_a_force(make_strange_fit, effects, monkeypatch):
    """Of no noise nothing is left above the motion's band to weigh a force by."""
    filters = []

    def estimate(fit):
        filters.append(fit.record.filter)
        return estimate_disturbance(fit)

    monkeypatch.setattr(conclude, "estimate_disturbance", estimate)
    found = search(make_strange_fit(lambda trials: trials, DAMPING, noise_deg=0.0), [effects["gravity_tilt"]])
    assert isinstance(found.selection.fit.record.filter, MotionBand) and filters == [None]
    assert found.disturbance is None and judge(found).kind == "unknown"


@pytest.mark.parametrize("cutoff_hz", [4.0, 8.0])
def test_the_noise_that_is_told_is_what_the_filter_has_left(make_trials, make_strange_fit, cutoff_hz):
    without = low_passed(make_trials(noise_deg=0.0), cutoff_hz)
    fit = make_strange_fit(lambda trials: low_passed(trials, cutoff_hz))
    with_it = low_passed(make_trials(noise_deg=NOISE_DEG), cutoff_hz)
    left = np.degrees((with_it.angle - without.angle)[:3].std())
    slow = within_band(fit, size_of_misfit(fit))
    assert np.degrees(noise_left(slow, np.radians(NOISE_DEG))) == pytest.approx(left, rel=0.25)
