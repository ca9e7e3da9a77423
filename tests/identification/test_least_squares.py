"""Steps are least squares within bounds, singular or not; what a trial's start can imitate is no evidence."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from myowave.identification.free_parameters import Free
from myowave.identification.least_squares import (
    Normal,
    along_bend,
    bounded_step,
    descend,
    gain_of,
    minimise_within,
    normal_equations,
    onto_starts,
    pseudo_inverse,
)
from myowave.identification.output_error import fit_model


@pytest.mark.parametrize("seed", range(8))
def test_the_minimum_within_bounds_is_that_of_a_general_optimiser(seed):
    random = np.random.default_rng(seed)
    columns = random.standard_normal((20, 4)) @ random.standard_normal((4, 4))
    matrix, vector = columns.T @ columns, columns.T @ random.standard_normal(20) * 5
    low, high = -random.uniform(0, 0.3, 4), random.uniform(0, 0.3, 4)

    def cost(x):
        return x @ matrix @ x / 2 - vector @ x

    best = minimize(cost, np.zeros(4), jac=lambda x: matrix @ x - vector, bounds=[*zip(low, high, strict=True)])
    found = minimise_within(matrix, vector, low, high)
    assert (found >= low).all() and (found <= high).all()
    assert cost(found) <= best.fun + 1e-6 * abs(best.fun)


def test_a_batch_is_solved_problem_by_problem():
    random = np.random.default_rng(0)
    columns = random.standard_normal((6, 10, 3))
    matrix, vector = np.swapaxes(columns, -1, -2) @ columns, random.standard_normal((6, 3)) * 10
    low, high = np.full(3, -0.5), np.full(3, 0.5)
    together = minimise_within(matrix, vector, low, high)
    alone = [minimise_within(m, v, low, high) for m, v in zip(matrix, vector, strict=True)]
    np.testing.assert_allclose(together, alone)
    assert (np.abs(together) == 0.5).any() and (np.abs(together) < 0.5).any()


@pytest.mark.parametrize("matrix", [np.zeros((3, 3)), np.ones((3, 3)), np.diag([1.0, 0.0, 1e9])])
def test_a_singular_matrix_gives_a_finite_step_within_the_bounds(matrix):
    free = tuple(Free(name, 1.0, 0.5, 2.0, 1.0) for name in "abc")
    step = bounded_step(matrix, np.ones(3), free, np.ones(3), 0.0)
    assert ((step >= -0.5) & (step <= 1.0)).all()
    np.testing.assert_allclose(matrix @ pseudo_inverse(matrix) @ matrix, matrix, atol=1e-9)


def valley(at, stiffness=1e3):
    """Rosenbrock's residuals, whose floor is a parabola, and their derivatives."""
    x, y = at
    return np.array([1 - x, stiffness * (y - x * x)]), np.array([[-1.0, 0.0], [-2 * stiffness * x, stiffness]])


def attempts_along(at, beyond=np.inf):
    """Points that `along_bend` tries; no further than `beyond` is there any."""
    left, slope = valley(at)
    straight = np.linalg.lstsq(-slope, left, rcond=None)[0]

    def take(step):
        return at + step if np.abs(step).max() < beyond else None

    def bend(tried, step):
        bent = valley(tried)[0] - left - slope @ step
        aside = np.linalg.lstsq(-slope, bent, rcond=None)[0]
        path = np.stack([left, -slope @ straight, bent + slope @ aside])
        return aside, path @ path.T

    return along_bend(straight, take, bend)


def squares(at):
    return (valley(at)[0] ** 2).sum()


def test_a_step_that_fails_shows_where_a_narrow_valley_bends():
    first, second, *_ = attempts_along(np.zeros(2))
    assert squares(first) > 1e5 * squares(np.zeros(2))
    assert squares(second) < squares(np.zeros(2))
    assert second[0] > 0.5, "it is nearly as long"
    np.testing.assert_allclose(second[1], second[0] ** 2, rtol=1e-6)


def test_along_its_bends_a_narrow_valley_is_walked_in_few_steps():
    *_, last = descend(np.array([-1.2, 1.0]), squares, attempts_along, steps=12)
    np.testing.assert_allclose(last, 1.0, atol=1e-4)


def test_where_a_step_leads_nowhere_a_shorter_one_is_tried():
    first, second, *_ = attempts_along(np.zeros(2), beyond=0.9)
    assert first is None
    np.testing.assert_allclose(second, [0.25, 0.0])


def test_damping_shortens_a_step():
    free = tuple(Free(name, 1.0, -9.0, 9.0, 1.0) for name in "ab")
    matrix, vector = np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([1.0, -1.0])
    sizes = [np.linalg.norm(bounded_step(matrix, vector, free, np.ones(2), d)) for d in (0.0, 1.0, 1e3, 1e9)]
    assert sizes == sorted(sizes, reverse=True) and sizes[-1] < 1e-8
    np.testing.assert_allclose(bounded_step(matrix, vector, free, np.ones(2), 0.0), np.linalg.solve(matrix, vector))


def unmeasured(trials):
    """Starts of trials of which nothing was measured."""
    return np.zeros((trials, 2)), np.zeros((trials, 2))


def without_starts(by_start, columns):
    nothing = np.zeros((3, 50)), np.zeros((3, 50, 0))
    return Normal(*nothing, by_start, np.zeros(0), np.zeros((0, 0)), *unmeasured(3)).without_starts(columns)


def test_what_is_left_without_starts_is_orthogonal_to_them_and_the_rest_is_theirs():
    random = np.random.default_rng(1)
    by_start, columns = random.standard_normal((3, 50, 2)), random.standard_normal((3, 50, 4))
    left = without_starts(by_start, columns)
    np.testing.assert_allclose(np.swapaxes(by_start, -1, -2) @ left, 0, atol=1e-10)
    imitated = by_start @ random.standard_normal((3, 2, 1))
    np.testing.assert_allclose(without_starts(by_start, imitated), 0, atol=1e-10)
    np.testing.assert_allclose(by_start @ onto_starts(by_start, columns, np.zeros((3, 2))) + left, columns)
    same = np.repeat(by_start[..., :1], 2, axis=-1)  # angle and velocity that cannot be told apart
    np.testing.assert_allclose(np.swapaxes(same, -1, -2) @ without_starts(same, columns), 0, atol=1e-10)


def test_eliminating_starts_solves_for_parameters_and_starts_together(make_noisy, base, free):
    fit = fit_model(base, make_noisy(1.0).train, free)
    moved = normal_equations(fit.sensitive, fit.record, fit.free, fit.values)
    columns = [moved.slope.reshape(-1, len(free))]
    for trial in range(len(fit.record.names)):
        apart = np.zeros_like(moved.by_start)
        apart[trial] = moved.by_start[trial]
        columns.append(apart.reshape(-1, 2))
    whole = np.concatenate(columns, -1)
    target = np.random.default_rng(0).standard_normal(moved.residual.shape)
    expected = np.linalg.lstsq(whole, target.ravel(), rcond=None)[0]
    vector = np.einsum("tnp,tn->p", moved.without_starts(moved.slope), target)
    np.testing.assert_allclose(pseudo_inverse(moved.matrix) @ vector, expected[: len(free)], rtol=1e-5)


@pytest.mark.parametrize("damping", [0.0, 1e-3, 1.0, 1e3])
def test_a_damped_step_is_that_of_parameters_and_starts_damped_together(damping):
    rng = np.random.default_rng(5)
    residual, slope, by_start = rng.normal(size=(2, 30)), rng.normal(size=(2, 30, 3)), rng.normal(size=(2, 30, 2))
    normal = Normal(residual, slope, by_start, np.zeros(0), np.zeros((0, 3)), *unmeasured(2))
    step = np.linalg.solve(*normal.damped(damping))
    shift = normal.starts_after(step) / (1 + damping)

    together = np.zeros((60, 7))  # three parameters and two numbers of each start
    together[:, :3] = slope.reshape(60, 3)
    together[:30, 3:5], together[30:, 5:] = by_start
    matrix = together.T @ together
    matrix[3:, 3:] *= 1 + damping  # in whatever units a start is counted
    expected = np.linalg.solve(matrix, together.T @ residual.reshape(60))
    np.testing.assert_allclose([*step, *shift.ravel()], expected, rtol=1e-8)
    assert normal.gain(step, shift) > 0


@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_what_was_measured_of_a_start_counts_as_two_samples_more(damping):
    rng = np.random.default_rng(6)
    residual, slope, by_start = rng.normal(size=(2, 30)), rng.normal(size=(2, 30, 3)), rng.normal(size=(2, 30, 2))
    further, further_slope, columns = rng.normal(size=3), np.diag(rng.normal(size=3)), rng.normal(size=(2, 30, 4))
    weight, off = np.array([4.0, 90.0]), rng.normal(size=(2, 2))
    found = Normal(residual, slope, by_start, further, further_slope, off, np.tile(weight, (2, 1)))

    def longer(each, rows):
        return np.concatenate([each, rows], 1)

    own = np.tile(np.diag(np.sqrt(weight)), (2, 1, 1))
    more = longer(residual, np.sqrt(weight) * off), longer(slope, np.zeros((2, 2, 3))), longer(by_start, own)
    same = Normal(*more, further, further_slope, *unmeasured(2))
    assert found.objective == pytest.approx(same.objective) and found.left @ found.left == pytest.approx(same.objective)
    for one, other in zip(found.damped(damping), same.damped(damping), strict=True):
        np.testing.assert_allclose(one, other)
    step = np.linalg.solve(*found.damped(damping))
    shift = found.starts_after(step)
    np.testing.assert_allclose(shift, same.starts_after(step))
    assert found.gain(step, shift) == pytest.approx(same.gain(step, shift))
    (signal, imitation), (expected, by_same) = found.beyond(columns), same.beyond(longer(columns, np.zeros((2, 2, 4))))
    np.testing.assert_allclose(imitation, by_same)
    np.testing.assert_allclose(signal.T @ signal, expected.T @ expected)
    np.testing.assert_allclose(signal.T @ found.left, expected.T @ same.left)


def test_more_columns_extend_the_normal_equations_as_if_they_had_been_there(make_noisy, base, free):
    fit = fit_model(base, make_noisy(1.0).train, free)
    few = normal_equations(fit.sensitive, fit.record, free, fit.values)
    part = np.s_[..., : len(free) - 1]
    fewer = replace(few, slope=few.slope[part], further_slope=few.further_slope[part])
    again = fewer.extended(few.slope[..., len(free) - 1 :])
    np.testing.assert_allclose(again.matrix, few.matrix, rtol=1e-9)
    np.testing.assert_allclose(again.vector, few.vector, rtol=1e-6, atol=1e-9)


def test_a_gain_is_the_fall_of_the_sum_of_squares_within_bounds():
    random = np.random.default_rng(0)
    signal, noise = random.standard_normal((200, 6)), random.standard_normal(200)
    information = signal.T @ signal
    estimate, fall = gain_of(information, signal.T @ noise)
    assert estimate == pytest.approx(np.linalg.lstsq(signal, noise)[0], rel=1e-6)
    assert fall == pytest.approx((noise**2).sum() - ((noise - signal @ estimate) ** 2).sum())
    bounded, less = gain_of(information, signal.T @ (3 * signal[:, 0]), high=1.0)
    assert bounded[0] == pytest.approx(1.0) and less < gain_of(information, signal.T @ (3 * signal[:, 0]))[1]
