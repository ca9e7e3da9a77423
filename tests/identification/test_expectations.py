"""What is known of constants beforehand counts in a fit as one further measurement of each."""

from dataclasses import replace

import numpy as np
import pytest

from myowave.identification.free_parameters import (
    FARTHEST,
    LEAST_SHARE,
    Free,
    expected,
    free_parameters,
    scales,
)
from myowave.identification.least_squares import normal_equations
from myowave.identification.noise import correlation_time
from myowave.identification.output_error import fit_model, refit
from myowave.settings import Scatter

SCATTER = {
    "slack": Scatter(relative=0.03),
    "slack_Tri": Scatter(relative=0.01, absolute=0.002),
    "delay": Scatter(absolute=0.007),
    "mass": Scatter(relative=0.05),
    "shape": Scatter(absolute=0.15),
    "yielding_curve": Scatter(absolute=0.4),
    "ascending_curve": Scatter(absolute=0.1),
    "l1": Scatter(),
}


@pytest.fixture(scope="module")
def wide(base, identify):
    return free_parameters(base, identify, (), SCATTER)


@pytest.fixture(scope="module")
def fit(make_noisy, base, wide):
    return fit_model(base, make_noisy(1.0).train, wide)


def test_constants_that_nobody_measured_are_free_about_their_usual_values(base, wide, identify):
    assumed = {p.name: p for p in wide if p.assumed}
    assert set(assumed) == {
        *("slack_Bi", "slack_Tri", "delay_Bi", "delay_Tri", "mass", "shape_Bi", "shape_Tri"),
        *("yielding_curve", "ascending_curve"),
    }, "a scatter of 0 frees nothing"
    assert {p.name for p in wide if not p.assumed} == set(identify)
    for name, p in assumed.items():
        assert p.start == base.defaults[name] and p.scale == p.deviation and p.low < p.start < p.high
    slack = base.defaults["slack_Tri"]
    assert assumed["slack_Bi"].deviation == pytest.approx(0.03 * base.defaults["slack_Bi"])
    assert assumed["slack_Tri"].deviation == pytest.approx(0.01 * slack + 0.002), "a parameter's own scatter goes first"
    assert assumed["delay_Bi"].deviation == 0.007


def test_known_constants_and_those_to_identify_are_not_assumed(base, identify):
    scatter = SCATTER | {"f0": Scatter(relative=0.3)}
    free = {p.name: p for p in free_parameters(base, identify, {"mass", "slack_Bi"}, scatter)}
    assert not {"mass", "slack_Bi"} & set(free) and "slack_Tri" in free
    assert not free["f0_Bi"].assumed, "what the settings identify is estimated from the data alone"
    effects_only = free_parameters(base, identify, set())
    assert not any(p.assumed for p in effects_only)


def test_a_constant_stays_in_its_physical_bounds(wide):
    free = {p.name: p for p in wide}
    delay, shape, ascending, mass = (free[n] for n in ("delay_Bi", "shape_Bi", "ascending_curve", "mass"))
    assert delay.low == pytest.approx(LEAST_SHARE * delay.start), "its deviations would reach below 0"
    assert delay.high == pytest.approx(delay.start + FARTHEST * 0.007)
    assert shape.low == pytest.approx(LEAST_SHARE * shape.start) and 0 < mass.low < mass.high
    assert ascending.low == pytest.approx(-0.95) and ascending.high == pytest.approx(1.2)


def test_only_what_is_assumed_has_a_weight(wide):
    start, weight = expected(wide)
    np.testing.assert_array_equal(start, [p.start for p in wide])
    np.testing.assert_allclose(weight, [1.0 if p.assumed else 0.0 for p in wide])


def test_the_objective_is_that_of_samples_and_pseudo_observations(fit, wide):
    far = [(v - p.start) / p.deviation for p, v in zip(wide, fit.values, strict=True) if p.assumed]
    assert np.abs(far).max() > 0.1
    assert fit.objective == pytest.approx(fit.rss + fit.record.noise**2 * np.sum(np.square(far)))
    tolerant = refit(replace(fit, record=replace(fit.record, noise=2 * fit.record.noise)), fit.model, wide)
    far = [(v - p.start) / p.deviation for p, v in zip(wide, tolerant.values, strict=True) if p.assumed]
    assert tolerant.objective == pytest.approx(tolerant.rss + 4 * fit.record.noise**2 * np.sum(np.square(far)))


def least_squares(fit):
    """The whole problem about a fit, in units of the scales: a row a sample, then one for each expectation."""
    normal, count = fit.normal, len(fit.free)
    columns = [normal.slope.reshape(-1, count)]
    for trial in range(len(fit.record.names)):
        apart = np.zeros_like(normal.by_start)
        apart[trial] = normal.by_start[trial]
        columns.append(apart.reshape(-1, 2))
    samples = np.concatenate(columns, -1)
    chosen = [i for i, p in enumerate(fit.free) if p.assumed]
    rows = np.zeros((len(chosen), samples.shape[1]))
    rows[range(len(chosen)), chosen] = [scales(fit.free)[i] / fit.free[i].deviation for i in chosen]
    off = np.array([(fit.free[i].start - fit.values[i]) / fit.free[i].deviation for i in chosen])
    return samples, normal.residual.ravel(), rows, off


def test_a_step_is_that_of_least_squares_with_the_expectations_as_samples(make_noisy, base, wide):
    """Anywhere, so also far from where constants are expected."""
    random = np.random.default_rng(0)
    start = [replace(p, start=p.start + p.deviation * random.uniform(-1, 1)) if p.assumed else p for p in wide]
    away = refit(fit_model(base, make_noisy(1.0).train, start), base, start)
    fit = replace(away, free=wide, normal=normal_equations(away.sensitive, away.record, wide, away.values))
    samples, residual, rows, off = least_squares(fit)
    noise = fit.record.noise
    whole, target = np.concatenate([samples, noise * rows]), np.concatenate([residual, noise * off])
    best = np.linalg.lstsq(whole, target, rcond=None)[0][: len(wide)]
    assert np.abs(best).max() > 0.05
    np.testing.assert_allclose(np.linalg.solve(fit.normal.matrix, fit.normal.vector), best, rtol=1e-5, atol=1e-7)


def test_standard_errors_are_those_of_least_squares_with_the_expectations_as_samples(fit, wide):
    samples, _, rows, _ = least_squares(fit)
    variance = fit.variance * correlation_time(fit.normal.residual, fit.record.samples)
    information = samples.T @ samples / variance + rows.T @ rows
    covariance = np.linalg.inv(information)[: len(wide), : len(wide)] * np.outer(scales(wide), scales(wide))
    np.testing.assert_allclose(fit.covariance(), covariance, rtol=1e-4, atol=1e-12)
    errors = fit.standard_errors()
    assert all(errors[p.name] <= p.deviation * (1 + 1e-9) for p in wide if p.assumed), "data never make one less sure"


def test_of_a_constant_that_data_say_nothing_about_the_posterior_is_the_prior(make_noisy, base, identify):
    """As that of a curve which no fibre reaches: the derivatives by it are 0."""
    only = free_parameters(base, identify, (), {"mass": Scatter(relative=0.05)})
    record = make_noisy(1.0).train
    fit = fit_model(base, record, only)
    blind = [i for i, p in enumerate(only) if p.name == "mass"]
    slope = fit.normal.slope.copy()
    slope[..., blind] = 0
    covariance = replace(fit, normal=replace(fit.normal, slope=slope)).covariance()
    deviation = only[blind[0]].deviation
    assert covariance[blind[0], blind[0]] == pytest.approx(deviation**2)
    np.testing.assert_allclose(np.delete(covariance[blind[0]], blind), 0, atol=1e-15)


def test_a_constant_is_estimated_between_what_is_expected_and_what_data_say(make_noisy, base, free):
    """The surer one was before, the nearer to that; data decide where little was known."""
    record, usual = make_noisy(1.0).train, base.defaults["mass"]
    expected_at = 1.1 * usual
    values = []
    for deviation in (1e-4, 0.05, 10.0):
        mass = Free("mass", expected_at, 0.2, 3.0, 0.05, deviation=deviation * usual)
        strength = [replace(p, low=p.start - 1e-6, high=p.start + 1e-6) for p in free if p.name.startswith("f0")]
        values.append(fit_model(base, record, [*strength, mass]).parameters["mass"])
    assert values[0] == pytest.approx(expected_at, rel=1e-3)
    assert values[2] == pytest.approx(usual, rel=0.02)
    assert values[2] <= values[1] <= values[0]
