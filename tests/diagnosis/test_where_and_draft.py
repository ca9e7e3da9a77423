"""What is missing, where, and as a formula that runs."""

import numpy as np
import pytest
import torch

from myowave.diagnosis.draft import LIBRARY, draft_effect
from myowave.diagnosis.fit import fit_model
from myowave.diagnosis.independence import check_independence
from myowave.diagnosis.next_trial import propose_trials
from myowave.diagnosis.record import make_record
from myowave.diagnosis.where import describe, misfit_by, missing_torque
from myowave.physics.effect_files import load_effects


def test_the_missing_torque_is_the_hidden_one(make_trials, base):
    """With the true parameters held nothing else can explain the damping; windows smooth a little of it away."""
    record = make_record(make_trials({"joint_damping": {"c": 0.3}}, noise_deg=0.0), base).train
    found = missing_torque(fit_model(base, record, ()))
    slope = np.polyfit(found.points["velocity_rad_s"], found.points["torque_Nm"], 1)[0]
    assert slope == pytest.approx(-0.3, rel=0.2)


def test_noise_alone_is_no_missing_torque(make_fit):
    found = missing_torque(make_fit())
    assert found.rms < 0.5 * found.standard_error


def test_parts_of_the_data_add_up_to_the_whole(make_fit):
    fit = make_fit({"joint_damping": {"c": 1.0}})
    misfit = misfit_by(fit)
    for factor in ("trial", "angle [deg]", "time [s]"):
        parts = misfit[misfit["factor"] == factor]
        assert parts["samples"].sum() == fit.record.samples
        total = np.sqrt((parts["rmse_deg"] ** 2 * parts["samples"]).sum() / parts["samples"].sum())
        assert total == pytest.approx(np.degrees(fit.rmse()))
    assert "deg" in describe(misfit, 0.5)


def test_a_residual_that_follows_the_velocity_is_noticed(make_fit):
    assert check_independence(make_fit()).holds
    assert not check_independence(make_fit({"joint_damping": {"c": 1.5}})).holds


def test_the_draft_is_an_effect_file_that_runs_and_says_what_was_found(make_fit, tmp_path):
    draft = draft_effect(make_fit({"joint_damping": {"c": 1.0}}), "elbow")
    (term, value, error), *_ = draft.terms
    assert term.name == "velocity" and value == pytest.approx(-1.0, abs=4 * error)
    path = tmp_path / "draft.py"
    path.write_text(draft.source, encoding="utf-8")
    (effect,) = load_effects(path)
    q, qdot, a = torch.rand(3, 4, 5, dtype=torch.float64).unbind(0)
    values = {f"c_{t.name}": torch.tensor(v, dtype=torch.float64) for t, v, _ in draft.terms}
    expected = sum(v * t.function(q, qdot, a) for t, v, _ in draft.terms)
    torch.testing.assert_close(effect.function(q, qdot, a.unsqueeze(-1), **values), expected)


@pytest.mark.parametrize("term", LIBRARY, ids=lambda term: term.name)
def test_each_term_is_written_as_it_is_computed(term):
    q, qdot, a = torch.randn(3, 7, dtype=torch.float64).unbind(0)
    written = eval(term.code, {"torch": torch, "q": q, "qdot": qdot, "a": a})
    torch.testing.assert_close(written, term.function(q, qdot, a))


def test_a_known_load_is_the_trial_that_shows_an_unknown_one(make_fit, effects):
    best, *others = propose_trials(make_fit(), effects["hand_load"])
    assert best.trial == "known load of 1 kg" and best.separates
    assert not any(p.separates for p in others)


def test_another_trial_never_makes_candidates_harder_to_tell(make_fit, effects):
    fit = make_fit({"joint_damping": {"c": 0.5}})
    for proposal in propose_trials(fit, effects["joint_damping"], effects["muscle_damping"]):
        assert proposal.separation >= proposal.now * (1 - 1e-6)
