"""The log evidence of a residual is that of a dense Gaussian, its slopes are exact, and it finds what made it."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.linalg import block_diag
from scipy.stats import multivariate_normal, norm

from myowave.diagnosis.likelihood.algebra import (
    Component,
    Covariance,
    Residual,
    log_evidence,
    log_share_within,
    most_likely,
    weigh_components,
)

LENGTHS, APART = (30, 24, 30), (14, 11, 14)  # values of each trial, and those that are independent of one another
LONGEST, MOST = max(LENGTHS), max(APART)
FIRST, LAST = (torch.arange(max(some)) < torch.tensor(some)[:, None] for some in (LENGTHS, APART))
VALID = torch.cat([FIRST, LAST], 1)


def padded(blocks: list[np.ndarray]) -> torch.Tensor:
    """Blocks of each trial, 0 where padded."""
    found = torch.zeros(len(blocks), LONGEST, LONGEST, dtype=torch.float64)
    for n, block in enumerate(blocks):
        found[n, : len(block), : len(block)] = torch.from_numpy(block)
    return found


def make_residual(seed: int = 0, **sizes: float) -> Residual:
    """Values drawn from components of given sizes: noise, memory within each trial, and two kinds of shared columns."""
    random = np.random.default_rng(seed)
    eyes = padded([np.eye(n) for n in LENGTHS])
    memory = padded([np.exp(-np.abs(np.subtract.outer(np.arange(n), np.arange(n))) / 8) for n in LENGTHS])
    one = LAST.double()
    some = {"first": 0.3, "low": 1e-2, "high": 10.0}
    components = (
        Component("floor", eyes, tail=one, low=1e-2, first=1e-2, high=1e-2),
        Component("constants", columns=columns_of(random, 4)),
        Component("noise", eyes, tail=one, **some),
        Component("memory", memory, tail=one * torch.linspace(0.2, 0.0, MOST), cost=3.0, **some),
        Component("curves", columns=columns_of(random, 12), cost=3.0, **some),
        Component("repeats", columns=columns_of(random, 10), cost=3.0, **some),
    )
    total = dense(components, {"noise": 1.0, **sizes})
    values = torch.zeros(VALID.shape, dtype=torch.float64)
    values[VALID] = torch.from_numpy(np.linalg.cholesky(total) @ random.standard_normal(len(total)))
    return Residual(values, VALID, components, MOST)


def columns_of(random: np.random.Generator, count: int) -> torch.Tensor:
    return torch.from_numpy(random.standard_normal((*VALID.shape, count))) * VALID[..., None]


def dense(components: tuple[Component, ...], sizes: dict[str, float]) -> np.ndarray:
    """Covariance of all values that are not padded, one trial after the other."""
    count, trials = int(VALID.sum()), range(len(LENGTHS))
    total, none = np.zeros((count, count)), torch.zeros(len(LENGTHS), LONGEST, LONGEST).double()
    for c in components:
        if c.known or c.name in sizes:
            square = (c.first if c.known else sizes[c.name]) ** 2
            blocks = (none if c.blocks is None else c.blocks).numpy()
            tail = (0.0 * LAST.double() if c.tail is None else c.tail).numpy()
            own = [(blocks[t, : LENGTHS[t], : LENGTHS[t]], np.diag(tail[t, : APART[t]])) for t in trials]
            total += square * block_diag(*(block_diag(*parts) for parts in own))
            if c.columns is not None:
                columns = c.columns[VALID].numpy()
                total += square * columns @ columns.T
    return total


SOME = {"noise": 0.9, "memory": 0.5, "curves": 0.3}


def test_is_that_of_a_dense_gaussian():
    residual = make_residual()
    total = dense(residual.components, SOME)
    expected = multivariate_normal(np.zeros(len(total)), total).logpdf(residual.values[VALID].numpy())
    assert Covariance(residual, SOME).evidence == pytest.approx(expected, rel=1e-9)
    assert log_evidence(residual, SOME) == pytest.approx(expected - 2 * 3.0, rel=1e-9)


@pytest.mark.parametrize("sizes", [SOME, {"noise": 0.02, "repeats": 5.0}, {"noise": 3.0, "memory": 9.0}])
def test_its_slopes_are_those_of_differences(sizes):
    residual, step = make_residual(2, memory=1.0, curves=1.0), 1e-4

    def moved(name: str, by: float) -> float:
        return Covariance(residual, {**sizes, name: sizes[name] * np.exp(by)}).evidence

    expected = [(moved(name, step) - moved(name, -step)) / (2 * step) for name in sizes]
    np.testing.assert_allclose(Covariance(residual, sizes).slope([*sizes]), expected, rtol=1e-5, atol=1e-4)


def test_columns_that_are_sums_of_others_are_condensed_and_the_evidence_stays():
    residual = make_residual(2, memory=1.0, curves=1.0)
    curves = residual.component("curves")
    columns = curves.columns @ torch.from_numpy(np.random.default_rng(3).standard_normal((12, 30)))
    many = residual.with_components([replace(curves, columns=columns)])
    assert many.condensed().columns("curves").shape[-1] == 12
    assert log_evidence(many.condensed(), SOME) == pytest.approx(log_evidence(many, SOME), abs=1e-6)


def test_dividing_is_dividing_by_the_dense_covariance():
    residual = make_residual()
    total = dense(residual.components, SOME)
    columns = columns_of(np.random.default_rng(5), 2)
    covariance = Covariance(residual, SOME)
    divided = np.linalg.solve(total, columns[VALID].numpy())
    np.testing.assert_allclose(covariance.solve(columns)[VALID].numpy(), divided, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(covariance.inner(columns, columns).numpy(), columns[VALID].numpy().T @ divided)
    np.testing.assert_allclose(covariance.with_residual(columns), divided.T @ residual.values[VALID].numpy())


@pytest.mark.parametrize("name", ["memory", "curves"])
def test_what_a_cause_made_is_its_share_of_the_residual(name):
    residual = make_residual(2, memory=1.0, curves=1.0)
    total = dense(residual.components, SOME)
    alone = dense((replace(residual.component(name), low=SOME[name], first=SOME[name], high=SOME[name]),), {})
    expected = alone @ np.linalg.solve(total, residual.values[VALID].numpy())
    np.testing.assert_allclose(Covariance(residual, SOME).made_by(name)[VALID].numpy(), expected, rtol=1e-6, atol=1e-9)


def test_the_posterior_of_amplitudes_is_that_of_linear_regression():
    residual, columns = make_residual(), columns_of(np.random.default_rng(5), 2)
    total = dense(residual.components, SOME)
    plain, values = columns[VALID].numpy(), residual.values[VALID].numpy()
    expected = np.linalg.inv(np.eye(2) + plain.T @ np.linalg.solve(total, plain))
    mean, covariance = Covariance(residual, SOME).posterior(columns)
    np.testing.assert_allclose(covariance, expected)
    np.testing.assert_allclose(mean, expected @ plain.T @ np.linalg.solve(total, values))


def test_what_is_left_is_white_with_the_right_sizes_and_not_without_a_cause():
    sizes = {"noise": 1.0, "memory": 2.0, "curves": 1.0}
    residual = make_residual(3, **sizes)
    covariance, values = Covariance(residual, sizes), residual.values[..., None]
    assert (covariance.white() ** 2).sum().item() == pytest.approx(covariance.inner(values, values).item(), rel=1e-9)
    assert (covariance.white()[VALID] ** 2).mean().item() == pytest.approx(1.0, abs=0.4)
    assert (Covariance(residual, {"noise": 1.0}).white()[VALID] ** 2).mean() > 1.8


@pytest.mark.parametrize("cause", ["memory", "curves", "repeats"])
def test_the_search_finds_the_cause_and_its_size(cause):
    seen = weigh_components(make_residual(7, **{cause: 2.0}))
    best = max(seen.values(), key=lambda w: w.value)
    assert set(best.sizes) == {"noise", cause}
    assert best.sizes[cause] == pytest.approx(2.0, rel=0.5)
    assert best.sizes["noise"] == pytest.approx(1.0, rel=0.3)


@pytest.mark.parametrize("cause", ["memory", "repeats"])
def test_a_search_from_a_seed_ends_where_one_from_nothing_does(cause):
    residual = make_residual(7, **{cause: 2.0})
    whole = weigh_components(residual)
    best = max(whole.values(), key=lambda w: w.value)
    hopeless = [on for on, w in whole.items() if w.value < best.value - 5.0]
    again = weigh_components(residual, [best], hopeless)
    assert max(again.values(), key=lambda w: w.value).value == pytest.approx(best.value, abs=0.05)
    assert hopeless and not set(hopeless) & set(again) and set(again) < set(whole)


def test_noise_alone_asks_for_nothing():
    seen = weigh_components(make_residual(11))
    assert max(seen, key=lambda on: seen[on].value) == frozenset()


def test_what_shared_columns_do_to_values_apart_tells_their_amplitudes():
    """Values that are independent of one another otherwise say as much of a column as the others."""
    residual = make_residual()
    column = columns_of(np.random.default_rng(5), 1)
    column[:, :LONGEST] = 0.0
    added = replace(residual, values=residual.values + 3.0 * column[..., 0])
    (mean,), ((variance,),) = Covariance(added, SOME).posterior(column)
    assert abs(mean - 3.0) < 4 * np.sqrt(variance) < 2.0


def test_a_component_without_columns_is_no_error():
    residual = make_residual()
    empty = residual.with_components(
        [replace(residual.component("curves"), columns=residual.columns("curves")[..., :0])]
    )
    assert most_likely(empty, ["curves"]).value == pytest.approx(most_likely(empty, []).value - 3.0, abs=0.05)


def test_a_prior_that_ends_at_a_bound_favours_what_lies_within():
    low, high = np.array([0.0]), np.array([np.inf])
    inside, outside = (log_share_within(low, high, np.array([m]), np.eye(1) * 0.01) for m in (1.0, -1.0))
    assert inside == pytest.approx(np.log(2), abs=1e-6)
    assert outside == pytest.approx(np.log(2) + norm.logcdf(-10), abs=1e-3)


def test_a_cause_that_moves_nothing_is_not_weighed():
    residual = make_residual(noise=1.0)
    still = Component("still", torch.zeros_like(residual.component("memory").blocks), cost=3.0)
    assert residual.with_components([still]).optional == residual.optional
