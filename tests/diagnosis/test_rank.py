"""What an effect must show before it is added: evidence that pays for its parameters, in most folds, off its bounds."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.signal import lfilter

from myowave.diagnosis.evidence import EVIDENCE, delta_bic, independent_samples
from myowave.diagnosis.search import rank
from myowave.diagnosis.search.rank import folds_won, left_out_residuals, rank_effects, similar
from myowave.identification.output_error import fit_model, refit
from myowave.identification.record import make_record


@pytest.fixture(scope="module")
def fit(make_fit):
    return make_fit({"joint_damping": {"c": 1.0}})


@pytest.fixture(scope="module")
def ranking(fit, effects):
    return rank_effects(fit, [effects[n] for n in ("joint_damping", "gravity_tilt", "hand_load")])


@pytest.fixture(scope="module")
def found(ranking):
    best = ranking[0]
    assert best.name == "joint_damping" and best.acceptable
    return best


def with_residual(fit, residual):
    return replace(fit, normal=replace(fit.normal, residual=residual, rss=(residual**2).sum()))


def coloured(fit, colour, seed=0):
    white = np.random.default_rng(seed).standard_normal((len(fit.record.names), 100 + fit.record.angle.shape[1]))
    return np.radians(1.0) * lfilter([1.0], [1.0, -colour], white)[:, 100:]


def test_an_effect_that_fits_as_well_with_a_parameter_more_or_nearly_with_one_less_is_not_told_apart(ranking, found):
    assert found.gain - found.delta_bic == pytest.approx(np.log(independent_samples(found.fit)))

    def with_lead(evidence, gain):
        return replace(found, delta_bic=found.delta_bic + evidence, gain=found.gain + gain)

    more, less, worse = with_lead(-9.0, -2.0), with_lead(-2.0, -9.0), with_lead(-9.0, -9.0)
    assert similar([found, more, less, worse], found) == [found, more, less]
    assert similar([found, replace(found, fit=None)], found) == [found]


@pytest.mark.parametrize("parameters", [0, 1, 3])
def test_parameters_that_gain_nothing_cost_the_logarithm_of_the_samples_each(fit, parameters):
    """The penalty of the BIC (Schwarz 1978)."""
    assert delta_bic(fit, fit.objective, parameters, 200.0) == pytest.approx(-parameters * np.log(200.0))


def test_evidence_is_the_fall_of_the_bic(fit):
    """BIC = n ln(RSS / n) + k ln n, for residuals far above the smallest noise that counts."""
    loud = with_residual(fit, coloured(fit, 0.0) * 20)
    n, fewer, more = 300.0, 4, 6
    bic = [n * np.log(rss / n) + k * np.log(n) for rss, k in ((loud.objective, fewer), (0.6 * loud.objective, more))]
    assert delta_bic(loud, 0.6 * loud.objective, more - fewer, n) == pytest.approx(bic[0] - bic[1], rel=1e-3)


@pytest.mark.parametrize("colour", [0.0, 0.5, 0.8])
def test_samples_of_slow_noise_count_for_less(fit, colour):
    """A first-order autoregression of n samples tells a mean as well as n (1 - c) / (1 + c) independent ones."""
    counts = [independent_samples(with_residual(fit, coloured(fit, colour, seed))) for seed in range(10)]
    assert np.mean(counts) == pytest.approx(fit.record.samples * (1 - colour) / (1 + colour), rel=0.2)


def test_a_ranking_counts_the_independent_samples_of_the_best_candidates_residual(make_fit, effects):
    """Other muscle curves leave a slow residual whatever is added; few of its samples are worth anything."""
    fit = make_fit({"millard_curves": {"w": 1.0}}, noise_deg=0.05)
    ranking = rank_effects(fit, [effects[n] for n in ("joint_damping", "gravity_tilt")])
    best = min((c.fit for c in ranking if c.fit), key=lambda f: f.objective, default=fit)
    samples = independent_samples(best)
    assert samples < 0.3 * fit.record.samples
    for candidate in ranking:
        rss = candidate.fit.objective if candidate.fit else fit.objective - candidate.score.drop
        assert candidate.delta_bic == pytest.approx(delta_bic(fit, rss, len(candidate.score.free), samples))
        assert candidate.delta_bic < samples * np.log(fit.objective / rss)


def test_candidates_are_ranked_by_evidence(ranking):
    values = [c.delta_bic for c in ranking]
    assert values == sorted(values, reverse=True) and values[0] > EVIDENCE


@pytest.mark.parametrize(
    "short",
    [
        {"delta_bic": EVIDENCE - 0.1},
        {"delta_bic": -1000.0},
        {"folds_won": 1, "folds": 3},
        {"folds_won": 3, "folds": 5},
        {"fit": None},
    ],
    ids=str,
)
def test_an_effect_that_falls_short_in_one_respect_is_not_accepted(found, short):
    assert not replace(found, **short).acceptable


def test_four_of_five_folds_are_enough(found):
    assert replace(found, folds_won=4, folds=5).acceptable


def test_an_effect_that_the_data_cannot_show_is_not_accepted(found, ranking):
    hidden = next(c for c in ranking if c.name == "hand_load")
    assert hidden.score.absorbed
    unseen = replace(found, score=replace(found.score, visible=hidden.score.visible))
    assert not replace(unseen, delta_bic=2 * EVIDENCE).acceptable
    assert unseen.acceptable, "unless a fit with it shows that it is seen"


def test_an_effect_that_ends_on_its_bound_is_not_accepted(found):
    (p,) = found.score.free
    values = found.fit.values.copy()
    at = [q.name for q in found.fit.free].index(p.name)
    values[at] = p.high
    assert p.high != p.scale
    assert not replace(found, fit=replace(found.fit, values=values)).acceptable


def test_left_out_trials_are_predicted_by_a_fit_to_the_others(fit, base):
    """Against a real fit to the others, and one of the trial left out in which only its start is free."""
    record = fit.record
    predicted = left_out_residuals(fit)
    for i in range(len(record.names)):
        others = [j for j in range(len(record.names)) if j != i]
        elsewhere = fit_model(base, record.take(others), [replace(p, start=fit.parameters[p.name]) for p in fit.free])
        alone = record.take([i])
        known = {name: torch.tensor([value], dtype=torch.float64) for name, value in elsewhere.parameters.items()}
        left = fit_model(base, replace(alone, known=alone.known | known), ()).normal.residual[0]
        assert (predicted[i] ** 2).sum() == pytest.approx((left**2).sum(), rel=0.05)
        assert (left**2).sum() > 1.001 * (fit.normal.residual[i] ** 2).sum(), "the trial left out is fitted worse"


def test_an_effect_of_one_trial_wins_few_folds(make_trials, base, free, effects):
    """What only one trial asks for lowers the error of all together, but the others are predicted worse with it."""
    trials, damped = make_trials(noise_deg=0.5), make_trials({"joint_damping": {"c": 1.0}}, noise_deg=0.5)
    trials.angle[0] = damped.angle[0]
    record = make_record(trials, base).train
    without = fit_model(base, record, free)
    (candidate,) = rank_effects(without, [effects["joint_damping"]])
    assert candidate.delta_bic > EVIDENCE
    assert candidate.folds == 3 and candidate.folds_won <= 1
    assert not candidate.acceptable


def test_the_richer_model_wins_where_the_effect_is_in_all_trials(fit, found):
    assert folds_won(fit, found.fit) == (3, 3)
    assert folds_won(found.fit, refit(found.fit, fit.model, fit.free)) == (0, 3)


def test_a_candidate_whose_steps_fail_in_a_row_leaves_the_race_with_what_it_has(make_fit, monkeypatch):
    fit, steps = make_fit(), []

    def stubborn(start):
        for step in range(30):
            steps.append(step)
            yield start

    monkeypatch.setattr(rank, "descend", stubborn)
    fits, failures = rank.race({"stubborn": fit}, [])
    assert fits == {"stubborn": fit} and not failures
    assert len(steps) == 1 + rank.REFUSED
