"""A verdict says no more than the evidence: named, in a class, in part, unknown, hidden or adequate."""

from dataclasses import replace

import numpy as np
import pytest

from myowave.diagnosis.causes import EMG_NOISE, GAIN_PER_TRIAL, OUTSIDE, OWN_SHAPES, SURE
from myowave.diagnosis.likelihood.algebra import Weighed
from myowave.diagnosis.likelihood.components import CURVES, EMG, NOISE, REPEATS
from myowave.diagnosis.search.answer import ANYTHING, Answer, answer_of
from myowave.diagnosis.search.diagnose import _proposals, make_rung
from myowave.diagnosis.search.ladder import Ladder, ladder_of, shown_fit
from myowave.diagnosis.search.verdict import Verdict
from myowave.diagnosis.search.weigh import weigh_models
from myowave.identification.expected_emg import behind_noise
from myowave.identification.free_parameters import effect_parameters
from myowave.identification.output_error import begin_from, refit
from myowave.identification.prediction import predict
from myowave.identification.record import make_record


@pytest.fixture(scope="module")
def few(effects):
    return [effects[name] for name in ("joint_damping", "gravity_tilt", "hand_load")]


@pytest.fixture(scope="module")
def posterior(make_fit, few):
    """All models that were weighed of trials with damping."""
    return weigh_models(make_fit({"joint_damping": {"c": 1.0}}), few)


@pytest.fixture(scope="module")
def weighed(posterior, few):
    """An answer on damping, and its ladder."""
    answer = answer_of(posterior)
    return answer, ladder_of(posterior.base.fit, posterior, answer, few)


def test_an_effect_that_alone_explains_all_is_named(weighed):
    verdict = Verdict(*weighed)
    assert (verdict.kind, verdict.causes) == ("effect", ("joint_damping",))
    assert verdict.explained > 0.9 and not verdict.left


def test_each_rung_ranks_what_it_lacks_the_most_likely_first(weighed):
    ladder = weighed[1]
    assert ladder.effects == ("joint_damping",)
    first, last = ladder.rankings
    assert first[0].name == "joint_damping" and first[0].status == "supported" and first[0].log_odds > SURE
    assert [c.log_odds for c in first] == sorted((c.log_odds for c in first), reverse=True)
    assert {c.name for c in last} == {"gravity_tilt", "hand_load"} and not any(c.status == "supported" for c in last)
    without, nats = ladder.odds["joint_damping"]
    assert without == "base" and nats == pytest.approx(first[0].log_odds)


def test_no_odds_are_told_against_a_model_that_was_not_weighed(posterior, few):
    """Of two effects of which one alone was weighed, only the other has odds; what has an effect says nothing of it."""
    damped = posterior.models[frozenset(["joint_damping"]), False]
    model = damped.fit.model.with_effects([few[1]])
    both = refit(damped.fit, model, (*damped.fit.free, *effect_parameters(model, few[1])))
    pair = replace(damped, effects=("joint_damping", "gravity_tilt")).at(both)
    models = {(frozenset(m.effects), False): m for m in (posterior.base, damped, pair)}
    named = replace(answer_of(posterior), best=pair, named=(("joint_damping",), ("gravity_tilt",)))
    odds = ladder_of(posterior.base.fit, replace(posterior, models=models), named, few).odds
    assert {name: without for name, (without, _) in odds.items()} == {"gravity_tilt": "base+joint_damping"}


def test_where_more_is_missing_what_was_found_is_shown_as_near_to_the_trials_as_it_gets(weighed):
    """Given what is missing still, parameters would leave it to do the work of what was found; given noise, not."""
    best = weighed[0].best
    away = begin_from(best.fit.model, best.fit.record, best.fit.free, 1.02 * best.fit.values[None])[0]
    more, noisy = (
        replace(best, fit=away, states={frozenset({cause}): Weighed({NOISE: 0.01, cause: 0.01}, 0.0)})
        for cause in (REPEATS, EMG)
    )
    assert not away.converged and shown_fit(more).converged and shown_fit(noisy) is away


def test_trials_kept_for_testing_are_driven_by_emg_of_the_kind_that_the_fit_is(weighed, make_trials, base):
    """The expected one behind a noise, where that was fitted, whichever rung it is."""
    fit = weighed[0].best.fit
    trials = make_trials({"joint_damping": {"c": 1.0}})
    test = make_record(trials, base).take(trials.index(trials.test))
    freed = replace(fit, record=behind_noise(fit.record, 0.03))
    errors = [predict(fit, some).rmse for some in (test, behind_noise(test, 0.03))]
    assert errors[0] != pytest.approx(errors[1], rel=1e-3)
    assert [make_rung(one, {}, test).heldout.rmse for one in (fit, freed)] == pytest.approx(errors, rel=1e-12)


def test_parameters_are_told_over_all_likely_causes(weighed):
    best = weighed[0].best
    likely, unlikely = Weighed(best.best.sizes, 0.0), Weighed({**best.best.sizes, CURVES: 3.0}, -40.0)
    plain, curved = frozenset[str](), frozenset({CURVES})
    alone, other = (replace(best, states={on: state}).averaged for on, state in ((plain, likely), (curved, unlikely)))
    assert replace(best, states={plain: likely, curved: unlikely}).averaged == alone
    both = replace(best, states={plain: likely, curved: replace(unlikely, value=0.0)}).averaged
    for name, (mean, error) in both.items():
        means, errors = np.transpose([alone[name], other[name]])
        assert mean == pytest.approx(means.mean(), rel=1e-9)
        assert error**2 == pytest.approx((errors**2).mean() + means.var(), rel=1e-9)
    assert other["f0_Bi"][1] > 1.2 * alone["f0_Bi"][1], "curves of any shape leave forces less sure"


def test_effects_that_cannot_be_told_apart_are_a_class(weighed):
    answer, ladder = weighed
    members = ("joint_damping", "muscle_damping")
    # What the model has stands first; what has no model, as a recorder's doings, is as good a member as any.
    hedged = replace(answer, kind="class", named=((EMG_NOISE, GAIN_PER_TRIAL), members[::-1], (OWN_SHAPES,)))
    verdict = Verdict(hedged, ladder)
    assert verdict.kind == "partial"
    assert verdict.named == (members, (EMG_NOISE, GAIN_PER_TRIAL)) and verdict.causes == ("joint_damping", EMG_NOISE)


def test_what_the_catalogue_lacks_stands_behind_what_it_has(weighed):
    answer, ladder = weighed
    likelier = replace(answer, kind="class", named=((OUTSIDE, "joint_damping", "gravity_tilt"),))
    for of in (ladder, Ladder(ladder.fits[:1], ladder.rankings[:1], ladder.estimates[:1])):
        verdict = Verdict(likelier, of)
        assert verdict.named == (("joint_damping", "gravity_tilt", OUTSIDE),) and verdict.causes == ("joint_damping",)


def test_what_is_left_beside_a_name_makes_it_a_part(weighed):
    answer, ladder = weighed
    verdict = Verdict(replace(answer, kind="partial"), ladder)
    assert verdict.kind == "partial" and verdict.causes == ("joint_damping",) and verdict.left


@pytest.mark.parametrize(("errors_away", "kind"), [(1.0, "adequate"), (4.0, "undecidable"), (-4.0, "undecidable")])
def test_a_parameter_outside_its_usual_range_may_hide_an_absorbed_effect(errors_away, kind, weighed):
    """Outside by more than two standard errors; only a parameter that an absorbed effect moves counts."""
    answer, ladder = weighed
    fit, ranking = ladder.fits[0], ladder.rankings[0]
    nothing: Answer = replace(answer, kind="adequate", named=(), usual=1.0)
    assert next(c for c in ranking if c.name == "hand_load").score.absorbed_by
    for name, hidden in (("f0_Bi", ("hand_load",)), ("l0_Bi", ())):
        i = next(i for i, p in enumerate(fit.free) if p.name == name)
        p, errors, values = fit.free[i], fit.standard_errors(), {p.name: p.start for p in fit.free}
        values[name] += np.sign(errors_away) * p.spread * p.start + errors_away * errors[name]
        estimate = {n: (value, errors[n]) for n, value in values.items()}
        verdict = Verdict(nothing, Ladder((fit,), (ranking,), (estimate,)))
        assert verdict.kind == (kind if hidden else "adequate")
        assert verdict.masked == ({name: hidden} if verdict.kind == "undecidable" else {})
        assert verdict.maybe == verdict.masked.get(name, ())
        for named, stays in (("effect", verdict.masked), ("partial", {})):
            assert Verdict(replace(nothing, kind=named), verdict.ladder).masked == stays


def test_constants_that_nobody_has_propose_no_trial_of_an_effect_that_is_none(weighed, effects):
    """What they stand for may be anything, which no catalogue has."""
    answer, ladder = weighed
    far = replace(answer, kind="adequate", named=(), usual=1e-9)
    verdict = Verdict(far, Ladder(ladder.fits[:1], ladder.rankings[:1], ladder.estimates[:1]))
    assert verdict.kind == "undecidable"
    assert (ANYTHING,) in verdict.masked.values() and ANYTHING not in verdict.maybe
    assert ANYTHING not in " ".join(_proposals(verdict, effects))
