"""What effects promise, to first order, where a hypothesis stands; how strong they may be, and what is no rival."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.diagnosis.likelihood.components import MOST_MOTION, REPEATS, prior_of, residual_of, usual_strength
from myowave.diagnosis.likelihood.hypothesis import Hypothesis
from myowave.diagnosis.likelihood.pushes import Pushes
from myowave.diagnosis.likelihood.terms import OF_ACTIVATION, OF_EFFECTS, OF_MOTION, OF_SENSOR
from myowave.diagnosis.likelihood.waves import View
from myowave.diagnosis.search.screen import screen
from myowave.identification.free_parameters import effect_parameters
from myowave.identification.output_error import refit
from myowave.physics.effect import Effect, Parameter
from myowave.physics.effects import catalogue

FEW = ("joint_damping", "quadratic_drag")


def made_by(effect, given, size):
    """What an effect makes of given quantities at a size of its first parameter, the others 0."""
    first, *others = effect.parameters
    asked = effect.function.__code__.co_varnames[: effect.function.__code__.co_argcount]
    values = dict.fromkeys(others, torch.tensor(0.0).double()) | {first: torch.tensor(size).double()}
    return torch.as_tensor(effect.function(*(given[name] for name in asked), **values))


def with_effect(fit, effect):
    model = fit.model.with_effects([effect])
    return refit(fit, model, (*fit.free, *effect_parameters(model, effect)))


@pytest.fixture(scope="module")
def damped(make_fit):
    return make_fit({"joint_damping": {"c": 0.3}})


def test_an_effect_promises_to_first_order_what_it_gains(damped, effects):
    few = {name: effects[name] for name in FEW}
    without = Hypothesis.of(damped, View.of(damped), FEW)
    promised = screen(without, few)
    for name, effect in few.items():
        with_it = replace(without.at(with_effect(damped, effect)), effects=(name,))
        gained = with_it.total - without.total
        assert gained > 1.0 and promised.singles[name] - without.total == pytest.approx(gained, rel=0.15)
    assert promised.singles["joint_damping"] > promised.singles["quadratic_drag"]


def test_an_effect_is_no_stronger_than_moves_the_arm_by_a_radian(damped, effects):
    fit = with_effect(damped, effects["joint_damping"])
    last = len(fit.free) - 1
    slope = fit.normal.slope
    size = np.sqrt((slope[..., last] ** 2).sum() / fit.record.samples)
    for factor in (0.1 / size, 10.0 / size):
        expected = 1.0 if factor * size < MOST_MOTION else MOST_MOTION / (factor * size)
        assert usual_strength(factor * slope, fit.record.samples)[last] == pytest.approx(expected)
    assert prior_of(fit)[0][last] == pytest.approx(min(1.0, MOST_MOTION / size))


def test_what_a_bound_is_worth_hangs_on_no_unit(damped):
    """Of an effect that is expected to move the arm by a radian, whatever is said to be typical of it."""
    totals = []
    for typical in (60.0, 90.0):
        tau = Parameter("N m", high=100.0, typical=typical, meaning="of a pull that is far too strong")
        fit = with_effect(damped, Effect("pull", "joint", "tau q", lambda q, *, tau: tau * q, {"tau": tau}, "a pull"))
        assert prior_of(fit)[0][-1] < 0.9
        totals.append(replace(Hypothesis.of(fit, View.of(fit)), effects=("pull",)).total)
    assert totals[0] == pytest.approx(totals[1], abs=1e-3)


def test_what_the_catalogue_has_is_no_part_of_what_it_lacks(damped, effects):
    """Else a term would stand there twice, and be cheaper without its name."""
    whole = Pushes.of(damped).repeating
    places = {name: list(OF_MOTION).index(term) for term, name in OF_EFFECTS.items()}
    places["forearm_inertia"] = len(OF_MOTION) + len(damped.model.muscles) * (len(OF_ACTIVATION) + 1)
    for name, place in places.items():
        np.testing.assert_array_equal(Pushes.of(damped, [name]).repeating, np.delete(whole, place, -1))
    assert Pushes.of(damped, catalogue()).repeating.shape[-1] == whole.shape[-1] - len(places)


def test_what_the_catalogue_has_of_a_sensor_is_no_part_of_what_it_lacks(damped):
    view = View.of(damped)
    whole = residual_of(damped, view).columns(REPEATS).numpy()
    for place, name in enumerate(reversed(OF_SENSOR), 1):
        without = residual_of(damped, view, [name]).columns(REPEATS).numpy()
        np.testing.assert_array_equal(without, np.delete(whole, -place, -1))


@pytest.mark.parametrize(("name", "term"), OF_SENSOR.items())
def test_a_term_of_the_sensor_is_the_effect_that_it_is_said_to_be(name, term, effects):
    dt, size = 0.001, 1e-4
    t = dt * torch.arange(200).double()
    q, v = torch.sin(5 * t), 5 * torch.cos(5 * t)
    seen = made_by(effects[name], {"q": q, "qdot": v, "dt": dt}, size)
    torch.testing.assert_close((seen - q) / size, term(q, v, v), rtol=1e-2, atol=1e-2)


@pytest.mark.parametrize(("term", "name"), OF_EFFECTS.items())
def test_a_term_of_the_general_correction_is_the_effect_that_it_is_said_to_be(term, name, effects):
    """But for its size, and for a constant torque beside a stiffness."""
    q, v = torch.linspace(0.2, 2.0, 50).double(), torch.linspace(-3.0, 2.0, 50).double()
    torque = made_by(effects[name], {"q": q, "qdot": v}, 1.0).expand_as(q)
    centred = torch.stack([torque - torque.mean(), (part := OF_MOTION[term](q, v, v)) - part.mean()])
    if term != "1":
        assert abs(torch.corrcoef(centred)[0, 1]) == pytest.approx(1.0, abs=1e-6)
    else:
        assert centred.abs().max() < 1e-12
