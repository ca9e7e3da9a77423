"""Waves keep what is slow of each trial, whatever its length, and answer to pushes as the motion does."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.signal import butter, sosfiltfilt

from myowave.data.knots import straight
from myowave.diagnosis.likelihood.forcing import MORE_EXCITATION, answers, forcing_by, through_sensor
from myowave.diagnosis.likelihood.sensor import Sensor
from myowave.diagnosis.likelihood.waves import View, Waves
from myowave.identification.output_error import fit_simulated

LENGTHS = np.array([240, 150])


def test_waves_are_orthonormal_in_each_trial_and_keep_what_is_slow_alone():
    band = Waves.of(LENGTHS, [np.arange(n // 5) for n in LENGTHS], dt=1.0)
    time = np.arange(240)
    for waves, there, frequency, length in zip(band.waves, band.there, band.frequency, LENGTHS, strict=True):
        live = waves[:, there].numpy()
        assert np.allclose(live.T @ live, np.eye(live.shape[1])) and frequency.max() <= 0.1
        assert (waves[length:] == 0).all() and (waves[:, ~there] == 0).all()
        slow, fast = (np.cos(2 * np.pi * f * (time + 0.5)) * (time < length) for f in (0.05, 0.25))
        assert np.linalg.norm(live @ (live.T @ slow) - slow) < 0.05 * np.linalg.norm(slow)
        assert np.linalg.norm(live.T @ fast) < 0.05 * np.linalg.norm(fast)


def test_no_wave_is_looked_at_twice_and_those_above_are_faster(make_fit):
    view = View.of(make_fit())
    band, above = view.band, view.above
    faster = view.above.frequency[view.above.there.numpy()]
    assert band.frequency[band.there.numpy()].max() < faster.min() and faster.max() < 0.5 / view.dt
    both = np.concatenate([band.waves[0].numpy(), above.waves[0].numpy()], -1)
    assert np.allclose(both.T @ both, np.eye(both.shape[1]))


def test_pieces_have_the_band_of_the_motion_that_they_are_cut_from(make_fit):
    """Simulated, each begins anew, and the jumps between them would pass for fast motion."""
    whole = make_fit()
    some = whole.record.cut(0.5).take(range(0, 12, 3))
    pieces = fit_simulated(whole.model, some, whole.free, 0.8 * whole.values)
    assert View.of(pieces).edge_hz == pytest.approx(View.of(whole).edge_hz, rel=0.3)


def test_amplitudes_answer_to_pushes_as_the_motion_does(make_fit):
    fit = make_fit()
    jacobian, forcing = fit.linear.jacobian.numpy(), forcing_by(fit, MORE_EXCITATION)
    waves = View.of(fit).band.waves
    pushes = np.random.default_rng(0).standard_normal((*forcing.shape[:2], forcing.shape[-1]))
    state, angle = np.zeros((len(forcing), jacobian.shape[-1])), [np.zeros(len(forcing))]
    for n in range(forcing.shape[1]):
        state = (jacobian[:, n] @ state[..., None] + forcing[:, n] @ pushes[:, n, :, None])[..., 0]
        angle.append(state[:, 0])
    expected = np.einsum("tnw,tn->tw", waves.numpy(), np.stack(angle, -1))
    found = np.einsum("ntmw,tnm->tw", answers(jacobian, forcing, through_sensor(fit, waves)), pushes)
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-11)


@pytest.mark.parametrize("samples, order", [(9, 2), (10, 2), (16, 2), (27, 8), (28, 8), (500, 2), (500, 4), (500, 8)])
def test_what_is_seen_through_a_filter_is_what_the_filter_makes_of_a_motion(samples, order):
    random, corner_hz = np.random.default_rng(0), 2.0
    waves, motion = random.standard_normal((samples, 5)), random.standard_normal(samples)
    sos = butter(order, corner_hz, fs=100.0, output="sos")
    filtered = sosfiltfilt(sos, motion) if samples > 3 * (order + 1) else motion
    seen, _ = Sensor(corner_hz, order).seen(0, waves, 0.01)
    assert seen.T @ motion == pytest.approx(waves.T @ filtered, rel=1e-9, abs=1e-12)


def test_a_filtered_recording_of_the_simulated_motion_leaves_nothing_through_that_filter(make_fit):
    fit, corner_hz = make_fit(), 2.0
    seen = sosfiltfilt(butter(2, corner_hz, fs=1 / fit.record.dt, output="sos"), fit.angle, axis=1)
    recorded = replace(fit, record=replace(fit.record, angle=seen))
    through, plain = (View.of(fit, sensor).left(recorded).abs().max() for sensor in (Sensor(corner_hz), Sensor()))
    assert through < 1e-9 < plain


def test_a_recording_on_straight_lines_leaves_nothing_through_them_wherever_each_trial_begins(make_fit):
    fit = make_fit()
    samples = fit.record.valid.shape[1]
    knots = [np.arange(begin, samples + 4, 4.0) for begin in (-1.0, -2.5, 0.0, -3.0, -0.5, -2.0)[: len(fit.angle)]]
    lines = [straight(samples, at) @ straight(samples, at, at_knots=True) for at in knots]
    seen = np.stack([own @ angle for own, angle in zip(lines, fit.angle, strict=True)])
    recorded = replace(fit, record=replace(fit.record, angle=seen))
    through, plain = (View.of(fit, sensor).left(recorded).abs().max() for sensor in (Sensor(knots=knots), Sensor()))
    assert through < 1e-9 < plain


def test_noise_with_a_memory_is_alike_for_as_long(make_fit):
    view = View.of(make_fit())
    alike = toeplitz(np.exp(-np.arange(view.waves.shape[1]) * view.dt / 0.2))
    expected = np.einsum("tnw,nm,tmv->twv", view.waves, alike, view.waves)
    (within, above), band = view.with_memory(0.2), view.sizes[0]
    assert within.numpy() == pytest.approx(expected[:, :band, :band], rel=1e-9, abs=1e-9)
    assert above.numpy() == pytest.approx(np.einsum("tww->tw", expected)[:, band:], rel=1e-9, abs=1e-9)


def test_waves_that_a_filter_stops_are_not_looked_at(make_fit):
    fit = make_fit()
    whole = View.of(fit, Sensor(corner_hz=6.0))
    seen = whole.passed
    warped, corner = (np.tan(np.pi * f * whole.dt) for f in (whole.above.frequency, 6.0))
    power = (1 + (warped / corner) ** 4) ** -2.0  # of noise, forwards and backwards
    assert not seen.above.there[power < 0.005].any() and not seen.above.waves.mT[power < 0.005].any()
    assert seen.above.there[(power > 0.02) & whole.above.there.numpy()].all()
    assert seen.sizes == whole.sizes and bool((seen.band.there == whole.band.there).all())


def test_the_band_holds_the_motion_of_long_trials(make_fit):
    fit = make_fit()
    edge, times = View.of(fit).edge_hz, 40
    motion = replace(fit.sensitive.motion, angle=fit.sensitive.motion.angle.repeat(1, times))
    record = replace(
        fit.record, valid=np.tile(fit.record.valid, (1, times)), angle=np.tile(fit.record.angle, (1, times))
    )
    long = View.of(replace(fit, record=record, sensitive=replace(fit.sensitive, motion=motion)))
    assert long.band.frequency.max() == pytest.approx(2 * long.edge_hz, rel=0.02) and long.edge_hz > edge / 2


def test_a_motion_at_rest_has_a_band(make_fit):
    fit = make_fit()
    motion = replace(fit.sensitive.motion, angle=0 * fit.sensitive.motion.angle)
    view = View.of(replace(fit, sensitive=replace(fit.sensitive, motion=motion)))
    assert 0 < view.edge_hz < 0.5 / view.dt and view.band.there.any() and view.above.there.any()
