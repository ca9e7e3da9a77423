"""The posterior of models: what was done to an arm or its recorder is named, and nothing else is."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, resample_poly, sosfiltfilt

from myowave.diagnosis.causes import EMG_NOISE, OUTSIDE
from myowave.diagnosis.likelihood.algebra import Covariance
from myowave.diagnosis.likelihood.components import EMG, SLOW, residual_of
from myowave.diagnosis.likelihood.sensor import Sensor
from myowave.diagnosis.likelihood.waves import View
from myowave.diagnosis.search.answer import answer_of
from myowave.diagnosis.search.weigh import through_likely_filter, weigh_models
from myowave.identification.output_error import fit_model, fit_simulated
from myowave.identification.record import make_record
from myowave.physics.motion import simulate

DAMPING = {"joint_damping": {"c": 1.0}}
FEW = ("joint_damping", "gravity_tilt", "emg_crosstalk", "extra_delay", "coulomb_friction", "clock_drift")


@pytest.fixture(scope="module")
def few(effects):
    return [effects[name] for name in FEW]


@pytest.fixture(scope="module")
def recorded(make_trials, base, free):
    """The base model fitted to trials that a recorder has changed."""

    def make(change=lambda trials: trials, hidden=None):
        return fit_model(base, make_record(change(make_trials(hidden)), base).train, free, starts=2)

    return make


def emg_made_noisy(trials):
    noise = 0.03 * np.random.default_rng(5).standard_normal(trials.emg.shape)
    return replace(trials, emg=(trials.emg + noise).clip(0, 1))


def filtered(trials):
    return replace(trials, angle=sosfiltfilt(butter(2, 6.0, fs=1 / trials.dt, output="sos"), trials.angle, axis=1))


def along_splines(trials):
    at = np.arange(trials.angle.shape[1])
    return replace(trials, angle=make_interp_spline(at[::2], trials.angle[:, ::2], axis=1)(at))


def by_polyphase_filter(trials):
    angle = resample_poly(trials.angle[:, ::2], 2, 1, axis=1, padtype="line")
    return replace(trials, angle=angle[:, : trials.angle.shape[1]])


def clock_drifted(trials):
    time = np.arange(trials.angle.shape[1]) * trials.dt
    return replace(trials, angle=np.stack([np.interp(1.005 * time, time, angle) for angle in trials.angle]))


def with_coloured_noise(trials):
    random, fall = np.random.default_rng(8), np.exp(-trials.dt / 0.3)
    noise = random.standard_normal(trials.angle.shape)
    for n in range(1, noise.shape[1]):
        noise[:, n] = fall * noise[:, n - 1] + np.sqrt(1 - fall**2) * noise[:, n]
    return replace(trials, angle=trials.angle + np.radians(1.0) * noise)


def judged(fit, few):
    return answer_of(weigh_models(fit, few))


def test_nothing_is_missing_from_clean_trials_filtered_or_not(recorded, few):
    for change in (lambda trials: trials, filtered):
        found = judged(recorded(change), few)
        assert (found.kind, found.named) == ("adequate", ())


def test_an_effect_that_a_recorder_s_fault_imitates_is_not_hidden_by_it(recorded, few):
    """Once a clock that drifts holds what is left, a delay adds nothing beside it, but does as well alone."""
    found = judged(recorded(hidden={"extra_delay": {"d_emg_biceps": 0.01, "d_emg_triceps": 0.01}}), few)
    assert "extra_delay" in found.named[0]


@pytest.mark.parametrize(
    ("names", "share", "kind"),
    [((), 0.3, "adequate"), ((), 0.9, "undecidable"), ((), 0.96, "unknown"), (("joint_damping",), 0.7, "partial")],
)
def test_that_something_is_missing_takes_as_much_to_say_as_a_name(recorded, few, monkeypatch, names, share, kind):
    found, named = weigh_models(recorded(), few[:1]), frozenset(names)
    rows = [(1 - share, named, frozenset()), (share, named, frozenset({SLOW}))]
    monkeypatch.setattr(type(found), "weights", lambda self: rows)
    assert answer_of(found).kind == kind


@pytest.mark.parametrize(("share", "kind"), [(0.2, "adequate"), (0.3, "undecidable")])
def test_nothing_is_missing_only_where_that_is_likelier_than_all_else_together(recorded, few, monkeypatch, share, kind):
    found = weigh_models(recorded(), few[:1])
    rows = [(1 - 2 * share, frozenset(), frozenset())] + [(share, frozenset({n}), frozenset()) for n in ("drag", "lag")]
    monkeypatch.setattr(type(found), "weights", lambda self: rows)
    assert answer_of(found).kind == kind


def test_an_effect_is_named_with_its_value(recorded, few):
    found = judged(recorded(hidden=DAMPING), few)
    assert (found.kind, found.named) == ("effect", (("joint_damping",),))
    value, error = found.best.estimate[0][-1], np.sqrt(found.best.estimate[1][-1, -1])
    assert found.best.fit.free[-1].name == "joint_damping.c" and abs(value - 1.0) < 2 * error < 0.25
    assert found.white > 1e-3


def test_what_the_catalogue_lacks_is_not_named(recorded, few):
    others = [effect for effect in few if effect.name != "joint_damping"]
    found = judged(recorded(hidden=DAMPING), others)
    assert found.kind in ("unknown", "partial") or found.named
    assert all(OUTSIDE in members for members in found.named)


@pytest.mark.parametrize("change, name", [(emg_made_noisy, EMG_NOISE), (clock_drifted, "clock_drift")])
def test_what_a_recorder_did_is_named_or_in_a_class_of_two(recorded, few, change, name):
    """A clock that drifts makes, on average, a delay."""
    (members,) = judged(recorded(change), few).named
    assert name in members and len(members) <= 2


def test_a_drift_too_large_for_a_first_order_leaves_nothing_to_other_sensors(recorded, few, effects):
    found = judged(recorded(hidden={"clock_drift": {"d": 0.02}}), [*few, effects["elastic_mount"]])
    assert (found.kind, found.named) == ("effect", (("clock_drift",),))


def test_coloured_noise_of_the_angle_is_no_noise_of_the_emg(recorded, few):
    found = judged(recorded(with_coloured_noise), few)
    assert EMG_NOISE not in [name for members in found.named for name in members]
    assert "coloured" in found.best.on


def test_a_filter_goes_through_motion_and_noise_alike(recorded):
    """The evidence of a filtered recording through that filter is near that of the raw one; without it, far below."""
    fit = recorded(filtered)
    through, plain = (
        Covariance(residual_of(fit, View.of(fit, sensor)), {"noise": np.radians(0.5)})
        for sensor in (Sensor(corner_hz=6.0), Sensor())
    )
    assert through.evidence > plain.evidence + 200


def test_a_filter_is_told_by_the_noise_and_not_by_what_a_model_lacks(recorded):
    seen, plain = (
        through_likely_filter(fit, View.of(fit)) for fit in (recorded(filtered, DAMPING), recorded(hidden=DAMPING))
    )
    assert seen.sensor.corner_hz == pytest.approx(6.0, rel=0.2)
    assert plain.sensor.corner_hz is None


@pytest.mark.parametrize("on_a_finer_grid", [along_splines, by_polyphase_filter])
def test_an_angle_brought_smoothly_to_a_finer_grid_lacks_nothing(recorded, few, on_a_finer_grid):
    """A steep filter has then taken all noise that was faster than the coarse grid."""
    fit = recorded(on_a_finer_grid)
    found = judged(fit, few)
    sensor = found.best.view.sensor
    assert (found.kind, found.named) == ("adequate", ())
    assert sensor.order > 2 and sensor.corner_hz == pytest.approx(0.25 / fit.record.dt, rel=0.2)


def test_a_residual_is_the_same_to_first_order_wherever_a_piece_is_linearised(recorded, base, free):
    """Where a piece begins is known as far as the motion was measured, wherever a fit has gone."""
    whole = recorded()
    fit = fit_simulated(base, whole.record.cut(0.5), free, whole.values)
    measured, state = fit.record.motion[:, 0].numpy(), fit.sensitive.motion.state
    fit, elsewhere = (fit.fit_at(fit.values, measured + n * fit.record.start_error, state) for n in (0.0, 0.05))
    here, there = (residual_of(each, View.of(fit)).values for each in (fit, elsewhere))
    apart = View.of(fit).left(fit) - View.of(fit).left(elsewhere)
    assert (here - there).norm() < 0.02 * apart.norm()


def test_a_slow_torque_of_size_1_moves_the_arm_by_1_rad(recorded):
    """So that its bounds mean the same for an arm and a small pendulum."""
    fit = recorded()
    slow = residual_of(fit, View.of(fit)).component(SLOW)
    assert float(slow.blocks.diagonal(dim1=-2, dim2=-1).sum()) == pytest.approx(fit.record.samples)


def test_noise_of_the_emg_is_no_less_than_electrodes_have(recorded):
    """The amplitude is 10.7 times its noise with one electrode and 35 times with eight (Clancy & Hogan 1995)."""
    fit = recorded()
    assert 0.1 / 35.0 <= residual_of(fit, View.of(fit)).component(EMG).low <= 0.1 / 10.7, "at a tenth of the maximum"


@pytest.mark.parametrize("corner_hz", [None, 4.0])
def test_noise_of_the_emg_has_the_covariance_that_draws_show(recorded, corner_hz):
    """Of the answers to noisy EMG, simulated, in the slow waves; also of noise that has passed the EMG's low-pass."""
    fit = recorded()
    fit = replace(fit, record=replace(fit.record, emg_low_pass_hz=corner_hz))
    view = View.of(fit)
    block, size = residual_of(fit, view).component(EMG).blocks[0].numpy(), 1e-3
    random, answers = np.random.default_rng(2), []
    assert np.linalg.eigvalsh(block).min() > -1e-9 * np.linalg.eigvalsh(block).max()
    start = fit.sensitive.motion.state[:, 0, :2].unbind(-1)
    before = simulate(fit.record.simulation(fit.model, fit.simulation.params), *start).angle.numpy()
    for _ in range(60):
        noise = random.standard_normal(fit.record.emg.shape)
        if corner_hz is not None:
            noise = sosfiltfilt(butter(2, corner_hz / 0.802, fs=1 / fit.record.dt, output="sos"), noise, axis=1)
        noise = torch.from_numpy(size * noise / noise.std())
        noisy = replace(fit.record, emg=fit.record.emg + noise)
        after = simulate(noisy.simulation(fit.model, fit.simulation.params), *start).angle.numpy()
        answers.append(view.amplitudes((after - before)[..., None])[0, :, 0].numpy() / size)
    slow = slice(1, 8)
    drawn = np.mean(np.square(answers), 0)[slow]
    assert np.allclose(drawn.sum(), np.diag(block)[slow].sum(), rtol=0.35)
