"""Causes act to first order, so steps that leave more to them may end where they cannot do it: evidence decides."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest

from myowave.diagnosis.likelihood import hypothesis
from myowave.diagnosis.likelihood.hypothesis import BEHIND, CLIMBS, settle


@dataclass
class Standing:
    """A model whose steps lead from each of some totals to the next."""

    totals: tuple[float, ...]
    fit: int = 0
    best: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(value=0.0))
    states: dict = field(default_factory=dict)

    @property
    def total(self):
        return self.totals[self.fit]

    def at(self, fit, hopeless):
        return Standing(self.totals, fit)


@pytest.fixture(autouse=True)
def steps(monkeypatch):
    monkeypatch.setattr(hypothesis, "climb", lambda model, steps: min(model.fit + 1, len(model.totals) - 1))


@pytest.mark.parametrize(
    ("totals", "ends"), [((10.0, 4.0, 90.0), 10.0), ((10.0, 14.0, 90.0), 90.0), ((10.0, 10.1, 90.0), 10.1)]
)
def test_a_fitted_model_ends_no_less_likely_than_it_began(totals, ends):
    assert settle(Standing(totals)).total == ends


def test_one_far_behind_is_given_up():
    behind = Standing((10.0, 90.0))
    assert settle(behind, 11.0 + BEHIND) is behind
    assert settle(behind, 9.0 + BEHIND).total == 90.0


def test_it_goes_on_while_that_pays():
    assert settle(Standing(tuple(range(9)))).total == CLIMBS
