"""The score test says, without fitting, what an effect would gain, and which parameters stand in its way."""

import numpy as np
import pytest

from myowave.diagnosis.search.score import confusion, score_effect, score_effects
from myowave.identification.free_parameters import free_parameters
from myowave.identification.least_squares import gain_of
from myowave.identification.output_error import fit_model, polish
from myowave.identification.record import make_record
from myowave.settings import Scatter


@pytest.mark.parametrize("name", ["joint_damping", "fatigue", "extra_delay", "vmax_change"])
def test_the_score_of_a_weak_effect_is_the_gain_of_its_fit(make_fit, base, effects, name):
    parameters = base.with_effects([effects[name]]).parameters_of(effects[name])
    hidden = {full.removeprefix(f"{name}."): 0.2 * p.typical for full, p in parameters.items()}
    fit = make_fit({name: hidden}, noise_deg=0.3)
    score = score_effect(fit, effects[name])
    gained = fit.objective - polish(score.start).objective
    assert score.drop > 5 * fit.variance
    assert score.drop == pytest.approx(gained, rel=0.15)


@pytest.mark.parametrize(("name", "strength"), [("joint_damping", 0.2), ("vmax_change", 0.5), ("hand_load", 0.3)])
def test_the_score_is_the_gain_of_the_fit_where_constants_are_expected_somewhere(
    make_trials, base, identify, effects, name, strength
):
    """What the effect saves constants that nobody measured counts as samples do; so the alias of a mass is no alias."""
    hidden = {p: strength * q.typical for p, q in effects[name].parameters.items()}
    scatter = {"mass": Scatter(relative=0.001), "vmax": Scatter(relative=0.02), "yielding_curve": Scatter(absolute=0.1)}
    record = make_record(make_trials({name: hidden}, noise_deg=0.3), base).train
    few = {name: choice for name, choice in identify.items() if name.startswith("l0")}
    fit = fit_model(base, record, free_parameters(base, few, (), scatter))
    score = score_effect(fit, effects[name])
    found = polish(score.start)
    assert score.drop > 5 * fit.variance and not score.absorbed
    assert score.drop == pytest.approx(fit.objective - found.objective, rel=0.15)
    assert fit.normal.left @ fit.normal.left == pytest.approx(fit.objective), "samples, then expectations"
    assert score.estimate[0] * score.free[0].scale == pytest.approx(found.parameters[score.free[0].name], rel=0.3)


@pytest.mark.parametrize(
    "name", ["joint_damping", "emg_gain", "activation_dynamics", "compliant_tendon", "clock_shift"]
)
def test_an_effect_more_never_fits_worse(make_fit, effects, name):
    fit = make_fit({"emg_crosstalk": {"x": 0.1}})
    assert polish(score_effect(fit, effects[name]).start).objective <= fit.objective * (1 + 1e-9)


def test_a_hand_load_is_absorbed_by_both_strengths_in_one_condition(loaded, base, free, effects):
    fit = fit_model(base, loaded({}).train, free)
    score = score_effect(fit, effects["hand_load"])
    assert score.absorbed
    assert set(score.absorbed_by) == {"f0_Bi", "f0_Tri"}


def test_a_known_load_in_one_trial_makes_the_unknown_one_visible(loaded, base, identify, effects):
    record = loaded({"2": {"load": 1.0}})
    fit = fit_model(base, record.train, free_parameters(base, identify, record.known))
    score = score_effect(fit, effects["hand_load"])
    assert not score.absorbed
    found = polish(score.start)
    assert found.parameters["hand_load.m"] == pytest.approx(0.5, abs=4 * found.standard_errors()["hand_load.m"])
    assert found.standard_errors()["hand_load.m"] < 0.1


def test_one_sided_effects_claim_nothing_on_the_forbidden_side(make_fit, effects):
    fit = make_fit({"vmax_change": {"r": 0.3}})  # faster muscles look like negative damping
    score = score_effect(fit, effects["joint_damping"])
    assert score.estimate[0] == 0.0 and score.drop == 0.0


def test_confusion_is_whole_with_itself_and_partial_with_another(make_fit, effects):
    fit = make_fit({"joint_damping": {"c": 0.5}})
    scores = score_effects(fit, (effects[n] for n in ("joint_damping", "muscle_damping", "gravity_tilt")))
    assert confusion(scores, "joint_damping", "joint_damping") == pytest.approx(1.0, abs=1e-6)
    assert 0.8 < confusion(scores, "joint_damping", "muscle_damping") < 1.0
    assert confusion(scores, "joint_damping", "gravity_tilt") < 0.6


def test_the_smallest_detectable_value_grows_with_the_noise(make_trials, base, free, effects):
    sizes = []
    for noise in (0.5, 1.0):
        fit = fit_model(base, make_record(make_trials(noise_deg=noise), base, noise_deg=noise).train, free)
        sizes.append(score_effect(fit, effects["joint_damping"]).detectable(np.radians(noise) ** 2, 17.0))
    assert sizes[1] == pytest.approx(2 * sizes[0], rel=0.05)


def test_the_promise_of_two_parameters_is_the_best_within_their_bounds():
    """Best of all is (-1, 2); with a one-sided first parameter it is not enough to hold it and keep the second."""
    bounds = np.zeros(2), np.full(2, 9.0)
    information, product = np.array([[1.0, 0.9], [0.9, 1.0]]), np.array([0.8, 1.1])
    values, drop = gain_of(information, product, *bounds)
    assert values == pytest.approx([0.0, 1.1], abs=1e-6) and drop == pytest.approx(1.1**2)
    opposed = np.array([[1.0, -0.9], [-0.9, 1.0]])  # without bounds both are negative, beside a = 0 only a is
    assert gain_of(opposed, np.array([-1.0, 0.2]), *bounds)[0] == pytest.approx([0.0, 0.2], abs=1e-6)
