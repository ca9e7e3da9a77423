"""Nothing that diverges or cannot be fitted ends a diagnosis: it stands on less, or is a row that says why."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.diagnosis.comparison.compare import compare_models
from myowave.diagnosis.comparison.summary import summarize
from myowave.diagnosis.report.facts import verdict_facts
from myowave.diagnosis.report.motion import beside
from myowave.diagnosis.report.tables import TABLES, predictions_table, ranking_table
from myowave.diagnosis.report.tell import tell
from myowave.diagnosis.scoring import add_truth
from myowave.diagnosis.search import diagnose as search
from myowave.diagnosis.search.diagnose import diagnose, weigh
from myowave.diagnosis.search.weigh import weigh_models
from myowave.identification.least_squares import FitError
from myowave.identification.output_error import fit_from
from myowave.identification.prediction import predict
from myowave.identification.record import make_record
from myowave.physics.effect import Effect, Parameter
from myowave.settings import DiagnosisSettings


def _refuse(q, qdot, activation, *, c):
    raise FitError("no motion with this effect")


def _blow_up(q, qdot, activation, *, c):
    return torch.where(c != 0, torch.nan, 0.0) + 0 * q


def broken(name, function):
    parameter = Parameter(unit="N m", low=-1.0, high=1.0, typical=0.5, meaning="nothing")
    return Effect(
        name=name, acts_on="joint", equation="?", function=function, parameters={"c": parameter}, source="a test"
    )


@pytest.fixture(scope="module")
def runaway(make_trials):
    """Trials whose EMG has nothing to do with the motion and drives the model far beyond it."""
    trials = make_trials()
    emg = np.random.default_rng(5).uniform(0, 1, trials.emg.shape).repeat(40, axis=1)[:, : trials.emg.shape[1]]
    return replace(trials, emg=emg)


@pytest.fixture(scope="module")
def diagnosis(runaway, base, effects, identify):
    candidates = [effects["joint_damping"], effects["joint_stiffness"], broken("refusing", _refuse)]
    return diagnose(runaway, base, candidates, identify, DiagnosisSettings(starts=1))


def test_trials_over_which_the_model_diverges_are_judged_over_a_horizon_that_is_told(diagnosis):
    summary = verdict_facts(diagnosis)
    assert summary["horizon_s"] in (0.5, 1.0, 2.0)
    assert all(np.isfinite(errors["heldout"]) for errors in summary["rmse_deg"].values())


def test_an_effect_that_cannot_be_fitted_is_a_row_with_its_reason(diagnosis):
    row = ranking_table(diagnosis).query("model == 'base' and effect == 'refusing'").iloc[0]
    assert row["status"] == "failed" and "no motion with this effect" in row["reason"]


def _diverge(*_):
    raise FitError("it diverges")


@pytest.mark.parametrize("nearby", [True, False])
def test_a_model_is_led_to_whole_trials_by_what_it_lacks(
    make_trials, base, effects, free, make_fit, monkeypatch, nearby
):
    """What a model lacks may be why it follows nothing, so the search does not end where it does not follow, nor where
    it has no motion near the one that it is led to."""
    if not nearby:
        monkeypatch.setattr(search, "refit", _diverge)
    hidden = {"joint_damping": {"c": 1.0}}
    whole = make_record(make_trials(hidden), base).train
    lost = fit_from(base, whole.cut(0.5), free, np.array([[0.9 * p.start for p in free]]))
    candidates = [effects["joint_damping"], effects["joint_stiffness"]]
    found = weigh(lost, whole, free, candidates)
    assert found.causes == ("joint_damping",) and found.kind == "effect"
    assert all(fit.record.pieces is None for fit in found.ladder.fits)
    alone = found.ladder.fits[0]
    assert alone.objective == pytest.approx(make_fit(hidden).objective, rel=0.01), "as where it follows by itself"


@pytest.mark.parametrize(
    "step, does", [("lengthen", lambda fit, *_: fit), ("lengthen", _diverge), ("_alone", lambda *_: None)]
)
def test_where_only_pieces_are_followed_nothing_is_named(make_trials, base, effects, free, monkeypatch, step, does):
    """Or what leaves the model without it no motion over whole trials, to be set beside."""
    monkeypatch.setattr(search, step, does)
    whole = make_record(make_trials({"joint_damping": {"c": 1.0}}), base).train
    lost = fit_from(base, whole.cut(0.5), free, np.array([[0.9 * p.start for p in free]]))
    found = weigh(lost, whole, free, [effects["joint_damping"], effects["joint_stiffness"]])
    assert found.kind == "unknown" and not found.named and not found.follows
    assert found.nearest == ("joint_damping",) and found.answer.probabilities["joint_damping"] > 0.9


def test_where_no_model_follows_no_effect_is_named(runaway, base, effects, identify, monkeypatch, facts):
    monkeypatch.setattr(search, "lengthen", lambda fit, *_: fit)
    found = diagnose(runaway, base, [effects["joint_damping"]], identify, DiagnosisSettings(starts=1))
    summary = verdict_facts(found)
    assert summary["verdict"] == "unknown" and not summary["effects"] and not summary["follows"]
    assert summary["formula"] == "0"
    near = summary["rmse_deg"]["base+joint_damping"]["heldout"]
    assert near < 0.5 * summary["rmse_deg"]["base"]["heldout"], "what comes nearest is tried on held-out trials"
    assert "base+joint_damping" in summary["models_that_leave_more"]
    told, noise = tell(facts() | add_truth(summary, None)), next(iter(summary["rmse_deg"].values()))["noise"]
    assert "does not follow" in told["headline"]
    assert f"with it the error on short pieces of held-out trials is {near:.2g} deg instead of" in told["which"]
    assert f"{noise:.2g} deg" in told["where"] and "nothing to locate" not in told["where"]


def test_tables_show_whole_trials_in_the_order_of_time(diagnosis, runaway):
    predictions = predictions_table(diagnosis)
    for name, rows in predictions[predictions["model"] == "base"].groupby("trial"):
        i = runaway.names.index(name)
        np.testing.assert_array_equal(rows["angle_rad"], runaway.angle[i])
        np.testing.assert_allclose(rows["time_s"], np.arange(len(rows)) * runaway.dt)
    for table in ("errors", "misfit"):
        found = TABLES[table](diagnosis)
        names = found["trial"] if table == "errors" else found[found["factor"] == "trial"]["part"]
        assert set(names) <= set(runaway.names)


def test_a_prediction_that_starts_again_at_a_measured_state_has_a_gap_there(diagnosis):
    """Drawn through, it would look as if it stayed with the arm."""
    table = predictions_table(diagnosis)
    starts = table.groupby(["model", "trial"])["piece"].diff() > 0
    assert starts.any() and beside(table, "", None)["predicted_rad"].isna().tolist() == starts.tolist()


def test_training_trials_are_predicted_from_measured_states_as_held_out_ones_are(diagnosis):
    """Pieces with starts of their own are fitted far better, which would look like overfitting beside held-out ones."""
    rung, errors = diagnosis.rungs[0], verdict_facts(diagnosis)["rmse_deg"]["base"]
    assert errors["train"] == pytest.approx(np.degrees(predict(rung.fit, rung.fit.record).rmse))
    assert errors["fitted"] == pytest.approx(np.degrees(rung.fit.rmse())) and errors["fitted"] < errors["train"]
    assert TABLES["ladder"](diagnosis)["train_rmse_deg"][0] == errors["train"]
    left = predictions_table(diagnosis).query("model == 'base' and role == 'train'").eval("angle_rad - predicted_rad")
    assert np.degrees(np.sqrt((left**2).mean())) == pytest.approx(errors["train"])


def test_the_page_says_over_what_the_model_was_judged(diagnosis, runaway):
    tables = {name: table(diagnosis) for name, table in TABLES.items()}
    comparison = compare_models(
        runaway,
        lambda name: next(r.fit.model for r in diagnosis.tried if r.name == name),
        tables["parameters"],
        tables["errors"],
    )
    assert np.isfinite(comparison["horizons"]["horizon_s"]).all(), "nothing here ran free over whole trials"
    verdict = add_truth(verdict_facts(diagnosis), None) | summarize(**comparison) | {"command": ""}
    told = tell(verdict)
    assert f"starts again at the measured state every {verdict['horizon_s']:g} s" in told["compare"]
    assert "errors of the fit to training trials, with the best start of each piece" in told["where"]


@pytest.mark.parametrize("effect", [broken("refusing", _refuse), broken("endless", _blow_up)])
def test_a_failing_candidate_changes_nothing_for_the_others(make_fit, effects, effect):
    fit = make_fit({"joint_damping": {"c": 1.0}})
    posterior = weigh_models(fit, [effects["joint_damping"], effect])
    assert posterior.best.effects == ("joint_damping",)
    assert posterior.screened[frozenset()].scores[effect.name].failure


def test_a_model_asked_for_by_name_is_fitted_to_pieces_where_whole_trials_diverge(runaway, base, effects, identify):
    damped = base.with_effects([effects["joint_damping"]])
    found = diagnose(runaway, base, [], identify, DiagnosisSettings(starts=1), models=[damped])
    (rung,) = found.named
    assert rung.fit.record.horizon_s == found.rungs[0].fit.record.horizon_s and not found.failed
    assert rung.fit.objective < found.rungs[0].fit.objective and rung.fit.parameters["joint_damping.c"] > 0
