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
from myowave.diagnosis.search.weigh import Posterior, _rivals
from myowave.identification.free_parameters import effect_parameters
from myowave.identification.output_error import refit


def model(total, *effects, on=frozenset({"curves"}), expected_emg=False):
    fit = SimpleNamespace(model=SimpleNamespace(name="+".join(("base", *effects))))
    weighed = {"fit": fit, "residual": None, "states": {}}
    return SimpleNamespace(total=total, effects=effects, on=on, expected_emg=expected_emg, **weighed)


@pytest.fixture
def found():
    posterior = Posterior()
    posterior.add(model(0.0), model(100.0, "drag"), model(91.0, "damping"), model(79.0, "stiffness"))
    posterior.add(model(95.0, "drag", "tilt"), model(93.0, "damping", expected_emg=True))
    return posterior


def test_rivals_are_those_of_the_likeliest_model_not_of_where_another_has_settled(found):
    assert [m.effects for m in _rivals(found, model(60.0, "drag"))] == [("damping",)]


def test_models_that_are_nearly_as_likely_are_followed_each_once(found):
    assert [(m.effects, m.total) for m in _rivals(found, found.best)] == [(("damping",), 93.0)]


def test_none_is_followed_beside_a_model_that_leaves_noise_alone(found):
    assert _rivals(found, model(100.0, "drag", on=frozenset())) == []


def test_what_a_model_does_not_need_is_dropped_one_after_the_other(found, monkeypatch):
    """Pieces of trials ask for more than whole trials do, and who begins with two effects may need none of both."""
    totals = {("drag", "tilt"): 108.0, ("drag",): 109.0, ("tilt",): 80.0}

    def with_one_less(one):
        rest = [tuple(e for e in one.effects if e != name) for name in one.effects if len(one.effects) > 1]
        return [model(totals.get(effects, 90.0), *effects) for effects in rest]

    monkeypatch.setattr(weigh, "_with_one_less", with_one_less)
    begun = model(107.0, "drag", "tilt", "scale")
    found.add(begun)
    assert weigh._drop(found, begun).effects == ("drag",) and found.best.effects == ("drag",)


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


@pytest.mark.parametrize("on, likeliest", [({"slow"}, ("damping", "lag")), (set(), ("drag", "lag"))])
def test_what_is_best_alone_gives_its_place_to_two_that_are_better_together(monkeypatch, on, likeliest):
    posterior, asked = Posterior(), []
    posterior.add(model(0.0), model(50.0, "drag"), model(40.0, "lag"), model(60.0, "drag", "lag", on=frozenset(on)))
    posterior.screened[frozenset({"drag"})] = None  # the search came from there

    def fit_singles(top, screened, found):
        asked.append(top.effects)
        return [model(90.0 if len(top.effects) == 1 else 50.0, "damping", *top.effects, on=frozenset())]

    monkeypatch.setattr(weigh, "screen", lambda top, catalogue: "screened")
    monkeypatch.setattr(weigh, "_fit_singles", fit_singles)
    monkeypatch.setattr(weigh, "_with_one_less", lambda top: [])
    assert weigh._lead_on_from_fewer(posterior, {}) is bool(on)
    assert set(posterior.best.effects) == set(likeliest) and asked == [("drag", "lag"), ("lag",)] * bool(on)


@pytest.mark.parametrize(
    "ends, visited", [((), ["drag", "lag", "lag", "tilt", "tilt"]), (("damping", "lag"), ["drag", "lag", "lag"])]
)
def test_the_search_goes_on_from_what_models_with_fewer_effects_have_led_to(monkeypatch, ends, visited):
    """Two that are better together than the best alone, and a third that shows beside these two only; it ends with a
    model that asks for no filter any more, as all is to be seen anew then."""
    leads = {
        (): [model(50.0, "drag"), model(40.0, "lag")],
        ("drag",): [model(60.0, "drag", "lag")],
        ("lag",): [model(90.0, "damping", "lag")],
        ("damping", "lag"): [model(120.0, "damping", "lag", "tilt", on=frozenset())],
    }

    def lead_on(found, top, catalogue):
        found.screened[frozenset(top.effects)] = None
        found.add(*leads.get(top.effects, []))

    monkeypatch.setattr(weigh, "_lead_on", lead_on)
    for name in ("_fit_pairs", "_with_one_less", "_rivals", "_by_recorded_emg"):
        monkeypatch.setattr(weigh, name, lambda *given: [])
    for name in ("settle", "replace", "with_likely_memory", "_of_called_for_emg"):
        monkeypatch.setattr(weigh, name, lambda model, *given, **changes: model)
    monkeypatch.setattr(weigh, "weigh_components", lambda residual: {})
    monkeypatch.setattr(weigh, "_looked_filtered", lambda model, unfiltered: model.effects == ends)
    posterior, told = Posterior(), []
    posterior.add(model(0.0))
    fit = SimpleNamespace(record=SimpleNamespace(pieces=None))
    assert weigh._search(posterior, fit, {}, None, told.append) is not bool(ends)
    likeliest = [line.rsplit("+", 1)[1] for line in told]
    assert posterior.best.effects == (ends or ("damping", "lag", "tilt")) and likeliest == visited


def test_a_model_with_most_effects_is_led_on_no_more(found, monkeypatch):
    monkeypatch.setattr(weigh, "screen", lambda top, catalogue: "screened")
    monkeypatch.setattr(weigh, "_fit_singles", lambda top, screened, found: [model(200.0, *top.effects, "more")])
    for effects in (("drag", "tilt", "lag"), ("drag", "tilt", "lag", "damping")):
        weigh._lead_on(found, model(90.0, *effects), {})
    assert found.screened == {frozenset({"drag", "tilt", "lag"}): "screened"}
    assert max(map(len, found.by_effects())) == weigh.MOST_EFFECTS


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
