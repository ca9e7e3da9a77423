"""Where whole trials diverge a fit stands on pieces of them; where they do not, nothing changes."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.identification import output_error, stages
from myowave.identification.free_parameters import Free
from myowave.identification.least_squares import FitError
from myowave.identification.output_error import Fit, fit_from, fit_model, polish
from myowave.identification.prediction import predict
from myowave.identification.smoothing import SHORTEST
from myowave.identification.stages import attempt_fit, fit_in_stages, lengthen, over_short_pieces
from myowave.identification.torque import fit_torque
from myowave.physics.motion import simulate


@pytest.fixture(scope="module")
def noisy(make_noisy):
    return make_noisy(0.3)


def _fails(error):
    def fit():
        raise error

    return fit


def test_a_fit_may_fail_but_an_error_of_its_code_is_none_of_its_failures():
    for failure in (FitError("no motion"), np.linalg.LinAlgError("singular"), torch.linalg.LinAlgError("singular")):
        assert attempt_fit(_fails(failure)) is None
    with pytest.raises(ValueError, match="could not be broadcast"):
        attempt_fit(lambda: np.zeros(2) + np.zeros(3))


@pytest.mark.parametrize("horizon_s", [0.5, 0.7, 100.0])
def test_every_sample_is_in_one_piece_and_pieces_keep_what_is_known_of_their_trial(noisy, horizon_s):
    valid = noisy.valid.copy()
    valid[1, 150:] = False
    loads = torch.tensor([0.0, 1.0, 2.0, 3.0], dtype=torch.float64)
    record = replace(noisy, valid=valid, known={"load": loads})
    pieces = record.cut(horizon_s)
    for name, angle in record.joined(record.angle).items():
        np.testing.assert_array_equal(pieces.joined(pieces.angle)[name], angle)
    origin = [record.names.index(name) for name in pieces.names]
    np.testing.assert_array_equal(pieces.known["load"], loads[origin])
    np.testing.assert_array_equal(pieces.training, record.training[origin])
    assert (pieces.lengths * record.dt >= min(horizon_s, 150 * record.dt) - 2 * record.dt).all()
    part = pieces.take([len(origin) - 1])
    assert part.names == (record.names[-1],) and part.emg.shape[1] == part.lead + part.angle.shape[1]


def test_a_piece_moves_as_the_trial_does_from_its_state_there(noisy, base):
    """EMG from before the piece drives it too, as muscles are late, and the upper arm leans as it does then."""
    sway = 0.3 * torch.sin(0.1 * torch.arange(noisy.angle.shape[1], dtype=torch.float64))
    noisy = replace(noisy, course=sway.expand(len(noisy.names), -1)[..., None])
    whole = simulate(noisy.simulation(base, {}), 0.6).state
    pieces = noisy.cut(0.5)
    row = [noisy.names.index(name) for name in pieces.names]
    begin = pieces.begin
    state = simulate(pieces.simulation(base, {}), *whole[row, begin].unbind(-1)).state
    for i, length in enumerate(pieces.lengths):
        torch.testing.assert_close(state[i, :length], whole[row[i], begin[i] : begin[i] + length], rtol=0, atol=1e-9)


def test_pieces_of_simulated_trials_give_the_true_parameters(exact, base, free):
    usual = np.array([p.start for p in free])
    fit = fit_from(base, exact.cut(0.5), free, usual[None])
    np.testing.assert_allclose(fit.values, [base.defaults[p.name] for p in free], rtol=2e-3)


def test_trials_that_do_not_diverge_are_fitted_whole_with_the_same_result(noisy, base, free):
    staged, plain = fit_in_stages(base, noisy.train, free), fit_model(base, noisy.train, free)
    assert staged.record.horizon_s is None
    errors = np.array([*plain.standard_errors().values()])
    np.testing.assert_array_less(np.abs(staged.values - plain.values), 0.1 * errors)


def test_the_values_of_the_fit_to_torque_are_a_start_of_the_fit_to_motion(noisy, base, free, monkeypatch):
    given = []
    monkeypatch.setattr(stages, "fit_model", lambda *_, further, **__: given.extend(further))
    fit_in_stages(base, noisy.train, free)
    np.testing.assert_array_equal(given, [fit_torque(base, noisy.train, free).values])


def test_both_searches_that_are_left_are_followed_to_the_end(noisy, base, free, monkeypatch):
    """What a search stands at before its descent does not tell where that leads."""
    usual = np.array([p.start for p in free])
    begun = output_error.begin_from(base, noisy.train, free, usual[None])[0]
    fits = [begun, replace(begun)]
    poor, good = (replace(begun, normal=replace(begun.normal, residual=begun.normal.residual * k)) for k in (2.0, 1.0))
    monkeypatch.setattr(output_error, "begin_from", lambda *_: fits)
    monkeypatch.setattr(output_error, "polish", lambda fit: poor if fit is fits[0] else good)
    assert output_error.fit_from(base, noisy.train, free, usual[None]) is good


@pytest.fixture(scope="module")
def runaway(noisy):
    """Trials whose EMG has nothing to do with the motion and drives it far beyond what was measured."""
    emg = np.random.default_rng(5).uniform(0, 1, noisy.emg.shape).repeat(40, axis=1)[:, : noisy.emg.shape[1]]
    return replace(noisy, emg=torch.from_numpy(emg))


def test_where_whole_trials_fail_the_fit_stands_on_pieces(runaway, base, free):
    fit = fit_in_stages(base, runaway.train, free)
    usual = replace(fit, values=np.array([p.start for p in fit.free]))
    assert fit.record.horizon_s is not None
    assert predict(fit, fit.record).rmse < 0.9 * predict(usual, fit.record).rmse
    test = runaway.cut(fit.record.horizon_s)
    assert np.isfinite(predict(fit, test.take(np.flatnonzero(~test.training))).rmse)


def test_no_longer_pieces_are_tried_than_the_model_follows(noisy, base, free, monkeypatch):
    """A fit over long pieces costs a minute where the model is far from the motion."""
    horizons, fit_over = [], stages.fit_nearby
    usual = np.array([p.start for p in free])
    fit = over_short_pieces(base, noisy.train, free, usual)
    monkeypatch.setattr(stages, "predicted", lambda fit: 1.0 if fit.record.horizon_s == 0.5 else 0.4)
    monkeypatch.setattr(stages, "fit_nearby", lambda m, r, *more: horizons.append(r.horizon_s) or fit_over(m, r, *more))
    assert lengthen(fit, noisy.train, free).record.horizon_s == 1.0 and horizons == [1.0]


@pytest.mark.parametrize("share, followed_s", [(0.8, 2.0), (0.95, None)])
def test_whole_trials_are_followed_where_nearly_all_of_their_motion_is(
    noisy, base, free, monkeypatch, share, followed_s
):
    fit = over_short_pieces(base, noisy.train, free, np.array([p.start for p in free]))
    monkeypatch.setattr(stages, "predicted", lambda fit: 1.0)
    monkeypatch.setattr(stages, "share_explained", lambda record, residual: share)
    assert lengthen(fit, noisy.train, free).record.horizon_s == followed_s


def test_pieces_begin_where_they_were_measured(runaway, base, free):
    """With any start a piece of half a second follows nearly any motion, and says little of what moves it."""
    fit = over_short_pieces(base, runaway.train, free, np.array([p.start for p in free]))
    assert fit.rmse() > 0.9 * predict(fit, fit.record).rmse > 5 * fit.record.noise
    assert np.isinf(fit.record.whole.start_error).all() and (fit.record.start_error > 0).all()


@pytest.mark.parametrize("noise_deg", [0.1, 1.0])
def test_starts_of_pieces_are_as_far_off_as_they_are_said_to_be(clean, make_noisy, noise_deg):
    """Also those of a trial, before which nothing was measured, and where smoothing takes some of the motion."""
    off = []
    for seed in range(40):
        pieces = make_noisy(noise_deg, seed).cut(0.5)
        exact = replace(make_noisy(0.0), window=SHORTEST).cut(0.5)
        off.append((pieces.motion[:, 0] - exact.motion[:, 0]).numpy() / pieces.start_error)
    sizes, first = np.sqrt(np.mean(np.square(off), 0)), pieces.begin == 0
    for some in (first, ~first):
        np.testing.assert_allclose(np.sqrt((sizes[some] ** 2).mean(0)), 1.0, rtol=0.15)


def test_where_torque_is_no_help_short_motions_tell_all_that_is_free(noisy, base, free):
    """Muscles that pull against each other leave a small torque, and a fit to it is then worth little."""
    fit = over_short_pieces(base, noisy.train, free, np.array([0.9 * p.start for p in free]))
    assert fit.record.horizon_s == 0.5 and len(fit.record.names) <= stages.ENOUGH_PIECES
    np.testing.assert_allclose(fit.values, [base.defaults[p.name] for p in free], rtol=0.03)
    assert lengthen(fit, noisy.train, free).record.horizon_s is None


def test_what_a_model_misses_does_not_drive_constants_from_where_they_are_known(runaway, base, free, monkeypatch):
    mass = Free("mass", start=1.0, low=0.2, high=5.0, scale=0.1, deviation=0.1)
    fit = over_short_pieces(base, runaway.train, [*free, mass], np.array([p.start for p in (*free, mass)]))
    by_noise = replace(fit, record=replace(fit.record, missed=0.0))
    monkeypatch.setattr(Fit, "weighed", lambda fit: fit)
    alone = polish(by_noise.fit_at(fit.values, fit.starts, fit.sensitive.motion.state))
    assert fit.record.missed > 3 * fit.record.noise
    far, further = (abs(f.parameters["mass"] - 1.0) for f in (fit, alone))
    assert far < 0.7 * further
