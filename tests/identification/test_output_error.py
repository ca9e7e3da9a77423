"""The fit finds what made the motion, says how sure it is, and does not see what only pads a trial."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.identification.free_parameters import Free, free_parameters, start_values
from myowave.identification.output_error import Fit, LiftedSearch, descend, fit_model, polish, refit
from myowave.physics.motion import simulate
from myowave.settings import Identify


def worst_error(values, free, model) -> float:
    return max(abs(v / model.defaults[p.name] - 1) for p, v in zip(free, np.moveaxis(values, -1, 0), strict=True))


def test_noiseless_motion_gives_back_its_parameters_from_a_far_start(exact, base, free):
    far = tuple(replace(p, start=p.start * (0.6 if p.name.startswith("f0") else 1.1)) for p in free)
    fit = fit_model(base, exact, far, starts=4)
    assert fit.converged
    assert worst_error(fit.values, free, base) < 1e-4


def test_the_factors_of_a_group_are_found_as_the_constants_that_they_stand_for(exact, base):
    """Trials of muscles as they are, seen by a model whose flexor is weaker and whose extensor is stronger."""
    biceps, triceps = base.muscles
    weaker = replace(biceps, group="front", constants=biceps.constants | {"f0": 250.0})
    stronger = replace(triceps, group="back", constants=triceps.constants | {"f0": 375.0})
    model = replace(base, muscles=(weaker, stronger))
    names = ("strength_front", "length_front", "strength_back", "length_back")
    free = free_parameters(model, dict.fromkeys(names, Identify(start_spread=0.1)), ())
    fit = fit_model(model, exact, free, starts=4)
    expected = {"strength_front": 300 / 250, "length_front": 1.0, "strength_back": 300 / 375, "length_back": 1.0}
    assert fit.parameters == pytest.approx(expected, rel=1e-3)


def test_constants_go_no_further_than_what_a_model_misses_lets_noise_take_them(exact, base, free, effects, monkeypatch):
    """What is known of a constant counts against independent samples of what is left, be it noise or a misfit."""
    fastest = Free("vmax_Bi", start=6.0, low=0.5, high=60.0, scale=1.2, deviation=0.1)
    hidden = base.with_effects([effects["joint_damping"]])
    moved = simulate(exact.simulation(hidden, {"joint_damping.c": torch.tensor(1.0).double()}), 0.6).angle
    record = replace(exact, angle=moved.numpy())
    fit = fit_model(base, record, [*free, fastest], starts=2)
    assert fit.weighed().record.misfit ** 2 == pytest.approx(fit.independent_variance, rel=1e-6)
    begin = replace(fit, record=record).fit_at(fit.values, fit.starts, fit.sensitive.motion.state)
    monkeypatch.setattr(Fit, "weighed", lambda fit: fit)
    held_by_noise = polish(begin)
    far, further = (abs(f.parameters["vmax_Bi"] - 6.0) for f in (fit, held_by_noise))
    assert fit.record.misfit > 3 * record.noise and far < 0.7 * further
    assert fit.record.misfit**2 == pytest.approx(fit.independent_variance, rel=1e-4)


def test_where_noise_alone_is_left_it_alone_weighs(make_noisy, base, free):
    record = make_noisy(0.3).train
    assert fit_model(base, record, free).record.misfit == pytest.approx(record.noise, rel=0.3)


def test_lifted_steps_bring_starts_that_are_wide_apart_together(exact, base, free):
    search = LiftedSearch.begin(base, exact, free, start_values(free, range(4)))
    before = np.ptp(search.values, axis=0)
    for _ in range(4):
        search = search.lifted()
    assert (np.ptp(search.values, axis=0) < 0.01 * before).all()
    assert worst_error(polish(next(search.fits())).values, free, base) < 1e-4


@pytest.fixture
def moving(exact, base):
    """Trials that begin in the middle of a movement, with their angle and velocity there (T,)."""
    angle, speed = torch.tensor([[0.6, 0.9, 1.2], [2.0, -1.5, 1.0]], dtype=torch.float64)
    motion = simulate(exact.simulation(base, {}), angle, speed)
    return replace(exact, angle=motion.angle.numpy()), angle.numpy(), speed.numpy()


def test_a_search_begins_near_where_the_trials_do_and_about_as_fast(moving, base, free):
    record, angle, speed = moving
    starts = LiftedSearch.begin(base, record, free, start_values(free, (0, 1))).starts
    np.testing.assert_allclose(starts[..., 0], [angle] * 2, rtol=0, atol=0.05)
    np.testing.assert_allclose(starts[..., 1], [speed] * 2, rtol=0.3)


def test_a_fit_ends_where_the_trials_begin_and_as_fast(moving, base, free):
    record, angle, speed = moving
    fit = fit_model(base, record, [replace(p, start=1.1 * p.start) for p in free])
    np.testing.assert_allclose(fit.starts, np.stack([angle, speed], -1), rtol=1e-4)
    assert worst_error(fit.values, free, base) < 1e-4


def test_no_step_of_a_descent_raises_the_error(make_noisy, base, free):
    far = replace(LiftedSearch.begin(base, make_noisy(1.0).train, free, start_values(free, [1])))
    (first,) = far.fits()
    errors = [fit.rss for fit in descend(first)]
    assert len(errors) > 2 and errors == sorted(errors, reverse=True) and errors[-1] < 0.9 * errors[0]


def test_standard_errors_are_as_large_as_the_errors(make_noisy, base, free):
    scores = []
    for seed in range(8):
        fit = fit_model(base, make_noisy(1.0, seed).train, free)
        errors = fit.standard_errors()
        scores += [(value - base.defaults[name]) / errors[name] for name, value in fit.parameters.items()]
    assert 0.7 < np.sqrt(np.mean(np.square(scores))) < 1.4


def test_what_pads_a_short_trial_has_no_influence(make_noisy, base, free):
    record = make_noisy(0.5).train
    valid = record.valid.copy()
    valid[1, 150:] = False
    short = replace(record, valid=valid)
    nonsense = record.angle.copy()
    nonsense[1, 150:] = 3.0
    one = fit_model(base, short, free)
    other = fit_model(base, replace(short, angle=np.where(valid, record.angle, nonsense)), free)
    np.testing.assert_allclose(one.values, other.values, rtol=1e-6)


def test_estimates_stay_within_their_bounds(make_noisy, base):
    narrow = {"f0_Bi": Identify(low=200.0, high=280.0), "l0_Bi": Identify()}
    fit = fit_model(base, make_noisy(0.5).train, free_parameters(base, narrow, ()))
    assert fit.parameters["f0_Bi"] == pytest.approx(280.0)


def test_a_fit_of_the_same_model_from_its_end_changes_nothing(make_noisy, base, free):
    fit = fit_model(base, make_noisy(0.5).train, free)
    np.testing.assert_allclose(refit(fit, base, free).values, fit.values, rtol=1e-4)


@pytest.mark.parametrize("damping", [1.0, 10.0, 100.0])
def test_a_damped_step_of_a_fit_promises_a_fall(make_noisy, base, free, damping):
    """Of parameters and starts together: over pieces, whose starts make up for most of what a parameter does."""
    usual = np.array([1.1 * p.start for p in free])
    narrow = [replace(p, low=v * 0.9999, high=v * 1.0001) for p, v in zip(free, usual, strict=True)]
    away = replace(fit_model(base, make_noisy(0.3).train.cut(0.1), narrow), free=tuple(free))
    assert away.normal.gain(*away.next_step(damping)) > 0
