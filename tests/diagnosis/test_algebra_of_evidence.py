"""The log evidence of a residual is that of a dense Gaussian, its slopes are exact, and it finds what made it."""

from dataclasses import replace

import numpy as np
import pytest
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

LENGTHS = (30, 24, 30)
ALL, TAIL = sum(LENGTHS), 40


def make_residual(seed: int = 0, **sizes: float) -> Residual:
    """Values drawn from components of given sizes: noise, memory within each trial, and two kinds of shared columns."""
    random = np.random.default_rng(seed)
    memory = tuple(np.exp(-np.abs(np.subtract.outer(np.arange(n), np.arange(n))) / 8) for n in LENGTHS)
    some = {"first": 0.3, "low": 1e-2, "high": 10.0}
    components = (
        Component("floor", tuple(map(np.eye, LENGTHS)), tail=np.ones(TAIL), low=1e-2, first=1e-2, high=1e-2),
        Component("constants", columns=random.standard_normal((ALL, 4))),
        Component("noise", tuple(map(np.eye, LENGTHS)), tail=np.ones(TAIL), **some),
        Component("memory", memory, tail=np.linspace(0.2, 0.0, TAIL), cost=3.0, **some),
        Component("curves", columns=random.standard_normal((ALL, 12)), cost=3.0, **some),
        Component("repeats", columns=random.standard_normal((ALL, 10)), cost=3.0, **some),
    )
    values, tail = dense(components, {"noise": 1.0, **sizes})
    drawn = np.linalg.cholesky(values) @ random.standard_normal(ALL)
    parts = np.split(drawn, np.cumsum(LENGTHS)[:-1])
    return Residual(tuple(parts), components, np.sqrt(tail) * random.standard_normal(TAIL))


def dense(components: tuple[Component, ...], sizes: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Covariance of all values, and variances of the further ones."""
    total, tail = np.zeros((ALL, ALL)), np.zeros(TAIL)
    for c in components:
        if c.known or c.name in sizes:
            square = (c.first if c.known else sizes[c.name]) ** 2
            total += square * block_diag(*c.blocks) if c.blocks else 0.0
            total += square * c.columns @ c.columns.T if c.columns is not None else 0.0
            tail += square * c.tail if c.tail is not None else 0.0
    return total, tail


SOME = {"noise": 0.9, "memory": 0.5, "curves": 0.3}


def test_is_that_of_a_dense_gaussian():
    residual = make_residual()
    values, tail = dense(residual.components, SOME)
    expected = multivariate_normal(np.zeros(ALL), values).logpdf(residual.stacked)
    expected += norm(0, np.sqrt(tail)).logpdf(residual.tail).sum()
    assert Covariance(residual, SOME).log_evidence == pytest.approx(expected, rel=1e-9)
    assert log_evidence(residual, SOME) == pytest.approx(expected - 2 * 3.0, rel=1e-9)


@pytest.mark.parametrize("name", SOME)
def test_its_slopes_are_exact(name):
    residual, step = make_residual(), 1e-5
    up, down = ({**SOME, name: SOME[name] * np.exp(sign * step)} for sign in (1, -1))
    slope = (Covariance(residual, up).log_evidence - Covariance(residual, down).log_evidence) / (2 * step)
    assert Covariance(residual, SOME).gradient[name] == pytest.approx(slope, rel=1e-4, abs=1e-4)


def test_columns_gain_what_a_component_more_does():
    residual = make_residual()
    columns = np.random.default_rng(5).standard_normal((ALL, 2))
    richer = residual.with_components([Component("effect", columns=columns)])
    gained = Covariance(richer, SOME).log_evidence - Covariance(residual, SOME).log_evidence
    assert Covariance(residual, SOME).gain(columns) == pytest.approx(gained, rel=1e-8)


def test_what_is_left_is_white_with_the_right_sizes_and_not_without_a_cause():
    sizes = {"noise": 1.0, "memory": 2.0, "curves": 1.0}
    residual = make_residual(3, **sizes)
    assert (Covariance(residual, sizes).white() ** 2).mean() == pytest.approx(1.0, abs=0.4)
    assert (Covariance(residual, {"noise": 1.0}).white() ** 2).mean() > 1.8


@pytest.mark.parametrize("cause", ["memory", "curves", "repeats"])
def test_the_search_finds_the_cause_and_its_size(cause):
    seen = weigh_components(make_residual(7, **{cause: 2.0}))
    best = max(seen.values(), key=lambda w: w.value)
    assert set(best.sizes) == {"noise", cause}
    assert best.sizes[cause] == pytest.approx(2.0, rel=0.5)
    assert best.sizes["noise"] == pytest.approx(1.0, rel=0.3)


def test_noise_alone_asks_for_nothing():
    seen = weigh_components(make_residual(11))
    assert max(seen, key=lambda on: seen[on].value) == frozenset()


def test_a_component_without_columns_is_no_error():
    residual = make_residual()
    empty = residual.with_components([replace(residual.component("curves"), columns=np.zeros((ALL, 0)))])
    assert most_likely(empty, ["curves"]).value == pytest.approx(most_likely(empty, []).value - 3.0, abs=0.05)


def test_a_prior_that_ends_at_a_bound_favours_what_lies_within():
    low, high = np.array([0.0]), np.array([np.inf])
    inside, outside = (log_share_within(low, high, np.array([m]), np.eye(1) * 0.01) for m in (1.0, -1.0))
    assert inside == pytest.approx(np.log(2), abs=1e-6)
    assert outside == pytest.approx(np.log(2) + norm.logcdf(-10), abs=1e-3)
