"""What is missing decides by a few nats which of its parts seems likeliest alone: the search follows all near it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from myowave.diagnosis.likelihood.algebra import Weighed
from myowave.diagnosis.likelihood.components import EMG
from myowave.diagnosis.likelihood.hypothesis import Hypothesis, settle
from myowave.diagnosis.likelihood.waves import View
from myowave.diagnosis.search import weigh
from myowave.diagnosis.search.weigh import MOST_EFFECTS, Posterior, _next
from myowave.identification.free_parameters import effect_parameters
from myowave.identification.output_error import refit


def model(total, *effects, on=frozenset({"curves"}), expected_emg=False, pieces=None):
    fit = SimpleNamespace(
        model=SimpleNamespace(name="+".join(("base", *effects))), record=SimpleNamespace(pieces=pieces)
    )
    weighed = {"fit": fit, "residual": None, "states": {}}
    return SimpleNamespace(total=total, effects=effects, on=on, expected_emg=expected_emg, **weighed)


@pytest.fixture
def found():
    posterior = Posterior()
    posterior.add(model(0.0), model(100.0, "drag"), model(91.0, "damping"), model(79.0, "stiffness"))
    posterior.add(model(95.0, "drag", "tilt"), model(93.0, "damping", expected_emg=True))
    return posterior


def order_of(found):
    """Effects of the models that a search begins with, one after the other."""
    begun, order = set(), []
    while (next_one := _next(found, begun)) is not None:
        order.append(next_one.effects)
        begun.add(frozenset(next_one.effects))
    return order


def test_the_likeliest_of_each_size_up_to_that_of_the_best_are_begun_with(found):
    found.add(model(78.0, "lag"), model(77.0, "load"), model(-50.0, "drag", "lag"), model(99.0, "drag", "tilt", "lag"))
    assert order_of(found) == [(), ("drag",), ("damping",), ("stiffness",), ("lag",)]
    found.add(model(110.0, "damping", "tilt"))
    assert order_of(found)[5:] == [("damping", "tilt"), ("drag", "tilt"), ("drag", "lag")]


def test_none_is_begun_with_beside_a_model_that_leaves_noise_alone(found):
    found.add(model(101.0, "lag", on=frozenset()))
    assert order_of(found) == [(), ("lag",)]
    found.add(model(110.0, "damping", "tilt"))
    assert order_of(found) == [(), ("lag",), ("damping", "tilt"), ("drag", "tilt")]


def test_over_pieces_only_the_best_is_begun_with(found):
    found.add(model(102.0, "tilt", pieces="half a second each"))
    assert order_of(found) == [("tilt",)]


def test_noise_of_the_emg_is_weighed_against_the_recording_from_the_same_place(found, monkeypatch):
    monkeypatch.setattr(weigh, "_of_other_emg", lambda model, recorded: (recorded, *model.effects))
    found.add(model(97.0, "drag", expected_emg=True), model(99.0, "lag", expected_emg=True))
    assert weigh._by_recorded_emg(found, "fit") == [("fit", "drag"), ("fit", "lag")], "and not what is far behind"


def test_noise_of_the_emg_costs_the_same_whichever_emg_drives_a_model():
    """An EMG other than the recorded one without noise is no hypothesis; of two ways to see one the likelier counts."""
    none, noisy = frozenset(), frozenset({EMG})
    states = {none: Weighed({}, 5.0), noisy: Weighed({EMG: 0.01}, 2.0)}
    recorded, driven = (Hypothesis((), None, None, None, states, expected_emg=expected) for expected in (False, True))
    assert (recorded.best, driven.best) == (states[none], states[noisy]) and set(driven.counted) == {noisy}
    posterior = Posterior()
    for value, one in ((2.0, recorded), (1.0, driven)):
        of = {"effects": (), "offset": value, "total": value, "expected_emg": one.expected_emg}
        posterior.add(SimpleNamespace(**of, counted=one.counted))
    odds = {on: p for p, _, on in posterior.weights()}
    assert len(posterior.weights()) == 2 and odds[noisy] / odds[none] == pytest.approx(np.exp(-3.0))


@pytest.mark.parametrize("on, fitted", [({"slow"}, ["drag", "tilt", "friction"]), (set(), ["drag"])])
def test_what_would_do_without_the_causes_is_fitted_beside_them(found, monkeypatch, on, fitted):
    """Causes that are on hold back what would do without them, whether the model has an effect already or not."""
    monkeypatch.setattr(weigh, "fresh_starts", lambda fit, scores: {})
    monkeypatch.setattr(weigh, "_fitted", lambda top, begin, effects, leader: effects[-1])
    top = SimpleNamespace(**vars(model(50.0, "damping", on=frozenset(on))), prior=-3.0)
    singles = {"drag": 60.0, "tilt": 49.0, "friction": 48.0, "lag": 47.0, "gain": 46.0}
    ideal = {"gain": 0.0, "lag": 1.0, "drag": -1.0, "friction": 2.0, "tilt": 3.0}
    scores = {name: SimpleNamespace(start=None) for name in singles}
    screened = SimpleNamespace(singles=singles, ideal=ideal, scores=scores)
    assert weigh._fit_singles(top, screened, found) == fitted


@pytest.fixture
def search(monkeypatch):
    """A search among models that are given, by the effects of the one that they are fitted from; `less` gives those
    that lack one effect, and the search ends with a model that has the effects `ends`."""

    def run(leads, less=(), ends=None):
        visited = []

        def screen(top, catalogue):
            visited.append(top.effects)
            return "screened"

        monkeypatch.setattr(weigh, "screen", screen)
        monkeypatch.setattr(weigh, "_fit_singles", lambda top, screened, found: leads.get(top.effects, []))
        monkeypatch.setattr(weigh, "_with_one_less", lambda top: dict(less).get(top.effects, []))
        for name in ("_fit_pairs", "_by_recorded_emg"):
            monkeypatch.setattr(weigh, name, lambda *given: [])
        for name in ("settle", "replace", "with_likely_memory", "_of_called_for_emg"):
            monkeypatch.setattr(weigh, name, lambda model, *given, **changes: model)
        monkeypatch.setattr(weigh, "weigh_components", lambda residual: {})
        monkeypatch.setattr(weigh, "_looked_filtered", lambda model, unfiltered: model.effects == ends)
        posterior = Posterior()
        posterior.add(model(0.0))
        ended = weigh._search(
            posterior, SimpleNamespace(record=SimpleNamespace(pieces=None)), {}, None, lambda line: None
        )
        return posterior.best.effects, visited, ended

    return run


TOGETHER = {
    (): [model(50.0, "drag"), model(40.0, "lag")],
    ("drag",): [model(60.0, "drag", "lag")],
    ("lag",): [model(90.0, "damping", "lag")],
    ("damping", "lag"): [model(120.0, "damping", "lag", "tilt", on=frozenset())],
}


def test_two_that_are_better_together_than_the_best_alone_are_found(search):
    """And a third that shows beside these two only."""
    best, visited, ended = search(TOGETHER)
    assert best == ("damping", "lag", "tilt") and ended
    assert visited == [(), ("drag",), ("lag",), ("damping", "lag"), ("drag", "lag"), ("damping", "lag", "tilt")]


def test_the_search_ends_where_all_is_to_be_seen_anew(search):
    best, visited, ended = search(TOGETHER, ends=("damping", "lag"))
    assert best == ("damping", "lag") and visited == [(), ("drag",), ("lag",)] and not ended


def test_what_a_model_does_not_need_is_dropped_one_after_the_other(search):
    """Pieces of trials ask for more than whole trials do, and who begins with two effects may need none of both."""
    quiet = frozenset()
    leads = {(): [model(107.0, "drag", "tilt", "scale", on=quiet)]}
    less = {
        ("drag", "tilt", "scale"): [model(108.0, "drag", "tilt", on=quiet), model(90.0, "tilt", "scale", on=quiet)],
        ("drag", "tilt"): [model(109.0, "drag", on=quiet), model(80.0, "tilt", on=quiet)],
    }
    best, _, _ = search(leads, less)
    assert best == ("drag",)


def test_a_model_with_most_effects_is_led_on_no_more(search):
    names = ("drag", "tilt", "lag", "damping", "scale")
    leads = {names[:n]: [model(10.0 * (n + 1), *names[: n + 1])] for n in range(len(names))}
    best, visited, _ = search(leads)
    assert best == names[:MOST_EFFECTS] and max(map(len, visited)) == MOST_EFFECTS - 1


@pytest.mark.parametrize(("hidden", "seed"), [(0.02, 3), (0.05, 3), (0.02, 4)])
def test_what_a_model_would_be_without_an_effect_is_told_to_first_order(make_fit, base, effects, hidden, seed):
    """Where the effect is weak, so that the model is linear from there to 0; also where noise asks for less than none
    of it, so that its bound at 0 counts against it."""
    bare, damping = make_fit({"joint_damping": {"c": hidden}}, seed=seed), effects["joint_damping"]
    damped = base.with_effects([damping])
    fit = refit(bare, damped, [*bare.free, *effect_parameters(damped, damping)])
    with_it = settle(replace(Hypothesis.of(fit, View.of(fit), effects), effects=(damping.name,)))
    alone = settle(Hypothesis.of(bare, with_it.view, effects))
    assert with_it.without(damping.name) == pytest.approx(alone.total, abs=0.15)
