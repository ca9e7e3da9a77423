"""What is said of probabilities: names, classes, and what has no name beside them."""

from types import SimpleNamespace

import pytest
import torch

from myowave.diagnosis.causes import EMG_NOISE, OUTSIDE, OWN_SHAPES
from myowave.diagnosis.likelihood.components import CURVES, EMG, NOISE, PATHS, REPEATS
from myowave.diagnosis.search import answer
from myowave.diagnosis.search.answer import answer_of


@pytest.fixture
def said(monkeypatch):
    """The answer to a posterior whose best model leaves nothing but noise and has usual constants."""

    def ask(*rows, pieces=None):
        monkeypatch.setattr(answer, "p_of_noise", lambda model: 1.0)
        monkeypatch.setattr(answer, "p_of_constants", lambda model: 1.0)
        weights = [(p, frozenset(effects.split()), frozenset(on.split())) for p, effects, on in rows]
        best = SimpleNamespace(fit=SimpleNamespace(record=SimpleNamespace(pieces=pieces)))
        found = answer_of(SimpleNamespace(weights=lambda: weights, best=best))
        return found.kind, found.named

    return ask


def test_beside_what_has_no_name_an_effect_may_be_something_like_it_and_no_recorder_is_named(said):
    kind, named = said((0.97, "drag", f"{REPEATS} {EMG}"), (0.03, "drag", EMG))
    assert (kind, named) == ("partial", (("drag", OUTSIDE),)), "what has no name may look like noise of the EMG"


def test_the_fewest_names_that_hold_what_is_missing_are_a_class(said):
    assert said((0.6, "drag", ""), (0.38, "", EMG), (0.02, "", "")) == ("class", (("drag", EMG_NOISE),))
    assert said((0.97, "drag", ""), (0.03, "tilt", "")) == ("effect", (("drag",),))
    assert said((0.6, "drag", ""), (0.4, "", "")) == ("undecidable", ())
    assert said((0.4, "drag", ""), (0.6, "", "")) == ("adequate", ())


def test_an_effect_with_a_likelier_cause_beside_it_belongs_to_the_class(said):
    """One of two effects is missing; that some cause goes with one of them is no third possibility."""
    rows = (0.55, "drag", ""), (0.2, "damping", ""), (0.25, "damping", EMG)
    assert said(*rows) == ("class", (("drag", "damping"),))
    assert said((0.35, "drag", ""), (0.3, "damping", EMG), (0.35, "drag", EMG)) == ("class", (("drag", "damping"),))


@pytest.mark.parametrize("other", [CURVES, PATHS, f"{CURVES} {PATHS}"])
def test_a_name_is_not_all_where_other_shapes_are_likelier_than_not_beside_it(said, other):
    assert said((0.8, "drag", other), (0.2, "drag", "")) == ("partial", (("drag",),))
    assert said((0.4, "drag", other), (0.6, "drag", "")) == ("effect", (("drag",),))
    assert said((0.4, "drag", other), (0.3, "drag", REPEATS), (0.3, "drag", "")) == ("partial", (("drag",),))
    assert said((0.6, "", other), (0.4, "drag", "")) == ("class", ((OWN_SHAPES, "drag"),)), "it is named already"


def test_curves_and_paths_of_another_shape_have_one_name(said):
    assert said((0.5, "", CURVES), (0.4, "", PATHS), (0.1, "", f"{CURVES} {PATHS}")) == ("effect", ((OWN_SHAPES,),))


def test_where_only_pieces_are_followed_no_probability_names_anything(said):
    assert said((1.0, "drag", ""), pieces=object()) == ("unknown", ())


def test_what_was_taken_for_noise_and_is_none_is_told_as_large_as_it_is():
    """Backlash of 0.3 deg that noise of the angle stands for where nothing else does is more than 0."""
    fit = SimpleNamespace(rmse=lambda: 0.005, record=SimpleNamespace(noise=0.001))
    best = SimpleNamespace(fit=fit, best=SimpleNamespace(sizes={NOISE: 0.1}))
    left = answer.Answer("unknown", (), {}, best, white=1e-9, usual=1.0)
    assert left.missing == pytest.approx((0.005**2 - 0.001**2) ** 0.5)


def test_what_is_missing_moves_the_arm_no_farther_than_the_model_misses():
    """A correction may be large only to take back what another term of the same model does."""
    covariance = SimpleNamespace(made_by=lambda name: torch.full((1, 4), 0.02))
    fit = SimpleNamespace(rmse=lambda: 0.005, record=SimpleNamespace(samples=4))
    best = SimpleNamespace(fit=fit, best=SimpleNamespace(sizes={REPEATS: 1.0}), covariance=covariance)
    assert answer.Answer("unknown", (), {}, best, white=1.0, usual=1.0).missing == 0.005
