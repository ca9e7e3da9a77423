"""What is missing, where, and as a formula that runs."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import torch

from myowave.diagnosis.causes import SURE
from myowave.diagnosis.likelihood.waves import View
from myowave.diagnosis.report.figures import draw_missing_torque
from myowave.diagnosis.report.tables import draft_source
from myowave.diagnosis.report.tell import tell
from myowave.diagnosis.search import draft
from myowave.diagnosis.search.draft import LIBRARY, PRIOR, draft_effect
from myowave.diagnosis.search.next_trial import SEPARATED, Menu, propose_trials
from myowave.diagnosis.search.where import WINDOW_S, locate, misfit_by, missing_torque
from myowave.identification.output_error import fit_model
from myowave.identification.record import make_record
from myowave.physics.effect_files import load_effects
from myowave.physics.joint import STANDARD_GRAVITY


@pytest.mark.parametrize(("effect", "value"), [("gravity_tilt", {"phi": 0.05}), ("joint_damping", {"c": 0.05})])
def test_the_missing_torque_is_the_hidden_one(effect, value, make_trials, base):
    """With the true parameters held nothing else can explain what is hidden, however the damping of the muscles goes
    with their activation; a window shows the mean of the torque weighted by its test function."""
    record = make_record(make_trials({effect: value}, noise_deg=0.0), base).train
    points = missing_torque(fit_model(base, record, ())).points
    q, weight = record.angle, base.defaults["mass"] * STANDARD_GRAVITY * base.defaults["length"]
    if effect == "gravity_tilt":
        hidden = -weight * (np.sin(q + value["phi"]) - np.sin(q))
    else:
        hidden = -value["c"] * np.gradient(q, record.dt, axis=1)
    half = round(WINDOW_S / record.dt)
    test = (1 - (np.arange(-half, half + 1) / (half + 1)) ** 2) ** 3
    trial = points["trial"].map(record.names.index)
    centre = ((points["time_s"] - record.begin_s[trial]) / record.dt).round().astype(int)
    shown = [hidden[t, c - half : c + half + 1] @ test / test.sum() for t, c in zip(trial, centre, strict=True)]
    assert np.square(points["torque_Nm"] - shown).mean() < 0.04**2 * np.square(shown).mean()


@pytest.mark.parametrize("r", [-0.4, 0.5])
def test_the_missing_torque_counts_with_the_inertia_that_effects_change(r, make_trials, base, effects):
    """An inertia m (1 + r) l^2 with the weight m g l is that of a mass m / (1 + r) at the length (1 + r) l."""
    record = make_record(make_trials({"joint_damping": {"c": 0.3}}), base).train
    mass, length = base.defaults["mass"], base.defaults["length"]
    aliases = (
        (base.with_effects([effects["forearm_inertia"]]), {"forearm_inertia.r": r}),
        (base, {"mass": mass / (1 + r), "length": length * (1 + r)}),
    )
    torque = []
    for model, values in aliases:
        known = {name: torch.full((len(record.names),), value, dtype=torch.float64) for name, value in values.items()}
        torque.append(missing_torque(fit_model(model, replace(record, known=known), ())).points["torque_Nm"])
    np.testing.assert_allclose(torque[0], torque[1], rtol=1e-3, atol=1e-4)
    assert np.abs(torque[1]).max() > 0.1


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
    assert locate(misfit)


def test_parts_of_the_data_are_those_of_the_measured_motion(make_trials, base):
    """However far from it a model runs."""
    record = make_record(make_trials(noise_deg=0.0), base).train
    light = {"mass": torch.full((len(record.names),), 0.3 * base.defaults["mass"], dtype=torch.float64)}
    away = fit_model(base, replace(record, known=light), ())
    assert np.degrees(away.rmse()) > 5
    ends = np.degrees([record.angle.min(), record.angle.max()])
    parts = misfit_by(away).query("factor == 'angle [deg]'")
    assert (parts["low"].min(), parts["high"].max()) == pytest.approx(ends, abs=0.5)
    places = np.degrees(missing_torque(away).points["angle_rad"])
    assert ends[0] - 0.5 < places.min() and places.max() < ends[1] + 0.5


@pytest.fixture
def told_of(facts):
    """What is said of errors [deg] of trials, of flexion and extension, and of ranges of other factors."""

    def told(*, trial=(1, 1), rmse=(1, 1), mean=(0, 0), noise=0.5, **bins: list[float]) -> str:
        rows = [("trial", f"trial{i + 1}", np.nan, np.nan, 9, value, 0.0) for i, value in enumerate(trial)]
        for part, error, shift in zip(("flexion", "extension"), rmse, mean, strict=True):
            rows.append(("direction", part, np.nan, np.nan, 9 * bool(error), error, shift))
        for factor, values in bins.items():
            rows += [(f"{factor} [deg]", "", 10.0 * i, 10.0 * (i + 1), 9, value, 0.0) for i, value in enumerate(values)]
        misfit = pd.DataFrame(rows, columns=["factor", "part", "low", "high", "samples", "rmse_deg", "mean_deg"])
        errors = {"train": 3.3, "heldout": 6.4, "fitted": 3.3, "noise": noise}
        worst = misfit["rmse_deg"].max()
        return tell(facts(where=locate(misfit), worst_part_deg=worst, rmse_deg={"base": errors}, model="base"))["where"]

    return told


def test_muscles_that_share_an_electrode_are_listed(told_of):
    told = told_of(**{"activation of BIClong and BICshort and BRA": [1, 2, 3, 4]})
    assert "with activation of the long head of the biceps, the short head of the biceps and the brachialis, f" in told


def test_below_the_noise_nothing_is_found(told_of):
    """A noise of 0.5 deg hides an error that grows tenfold from 0.01 to 0.1 deg."""
    told = told_of(trial=[0.1, 0.3], rmse=[0.2, 0.1], mean=[0.1, -0.05], pitch=[0.01, 0.03, 0.06, 0.1])
    assert told == "In every part of the trials the misfit is below the noise, 0.50 deg: nothing to locate."
    assert "grows with pitch" in told_of(trial=[0.1, 0.3], rmse=[0.2, 0.1], pitch=[0.1, 0.3, 0.6, 1.0])


def test_muscles_that_share_an_activation_are_told_together(make_fit):
    fit = make_fit({"joint_damping": {"c": 1.0}})
    biceps, triceps = fit.model.muscles
    model = replace(fit.model, muscles=(biceps, replace(biceps, name="Bra"), triceps))
    record = replace(fit.record, emg=fit.record.emg[..., [0, 0, 1]])
    parts = misfit_by(fit_model(model, record, ()))
    activations = [factor for factor in parts["factor"].unique() if factor.startswith("activation")]
    assert activations == ["activation of Bi and Bra [-]", "activation of Tri [-]"]


def test_the_finding_names_what_the_error_grows_with_from_end_to_end(told_of):
    told = told_of(pitch=[1, 1.4, 1.3, 2], roll=[1, 2, 1, 1.2])
    assert told.startswith("The misfit grows with pitch, from 1.0 deg (0 to 10 deg) to 2.0 deg (30 to 40 deg).")
    assert "roll" not in told, "a difference between neighbours is no finding"


def test_the_finding_names_the_extremes_where_there_is_no_trend(told_of):
    told = told_of(trial=[1, 3], pitch=[1, 1.1, 2, 1.2])
    assert "largest at pitch 20 to 30 deg (2.0 deg) and smallest at 0 to 10 deg (1.0 deg)" in told
    assert "largest in trial 2 (3.0 deg), smallest in trial 1 (1.0 deg)" in told


def test_the_finding_says_which_of_arm_and_model_runs_ahead(told_of):
    assert "ahead of the model, by 1.5 deg in flexion and 1.0 deg in extension" in told_of(
        rmse=[2, 2], mean=[1.5, -1.0]
    )
    assert "behind the model" in told_of(rmse=[2, 2], mean=[-1.5, 1.0])
    assert told_of(pitch=[1, 1, 1, 1.1]) == "The misfit is the same everywhere. The noise is 0.50 deg."


@pytest.mark.parametrize("rmse", [(2, 0), (0, 0)], ids=["flexes only", "at rest"])
def test_a_direction_in_which_nothing_moved_is_not_compared(rmse, told_of):
    assert told_of(rmse=rmse, mean=(0.1, 0)) == "The misfit is the same everywhere. The noise is 0.50 deg."


def test_the_map_of_a_damper_shows_that_it_brakes_and_short_trials_have_a_coarser_one(make_fit):
    points = missing_torque(make_fit({"joint_damping": {"c": 1.0}})).points.assign(model="base")
    cells = []
    for windows in (points, points.iloc[::4]):
        (drawn,) = draw_missing_torque(windows).axes[0].collections
        velocity, torque = drawn.get_offsets()[:, 1], drawn.get_array()
        assert np.polyfit(velocity, torque, 1)[0] < 0, "what is missing brakes"
        cells.append(len(torque))
    assert cells[1] < cells[0]
    assert draw_missing_torque(points.iloc[:0]).axes, "of trials too short for a window there is a picture, too"


def test_the_draft_is_an_effect_file_that_runs_and_says_what_was_found(make_fit, tmp_path):
    fit = make_fit({"joint_damping": {"c": 1.0}})
    found = draft_effect(fit, View.of(fit))
    (term, value, error), *_ = found.terms
    assert term.name == "velocity" and value == pytest.approx(-1.0, abs=4 * error)
    path = tmp_path / "draft.py"
    path.write_text(draft_source(SimpleNamespace(draft=found, dataset="elbow")), encoding="utf-8")
    (effect,) = load_effects(path)
    assert effect.parameters["c_velocity"].unit == "N m s/rad"
    q, qdot, a = torch.rand(3, 4, 5, dtype=torch.float64).unbind(0)
    values = {f"c_{t.name}": torch.tensor(v, dtype=torch.float64) for t, v, _ in found.terms}
    expected = sum(v * t.function(q, qdot, a) for t, v, _ in found.terms)
    torch.testing.assert_close(effect.function(q, qdot, a.unsqueeze(-1), **values), expected)


def test_a_constant_of_a_draft_is_written_as_a_number_alone():
    constant, angle, *_ = LIBRARY
    assert draft.Draft(((angle, -0.2, 0.01), (constant, 0.7, 0.01))).formula == "-0.2 q +0.7"


@pytest.mark.parametrize(
    "hidden", [{}, {"extra_delay": {"d_emg_biceps": 0.02, "d_emg_triceps": 0.02}}], ids=["noise", "late EMG"]
)
def test_no_torque_is_drafted_for_what_is_none(hidden, make_fit):
    fit = make_fit(hidden)
    assert draft_effect(fit, View.of(fit)).formula == "0"


@pytest.mark.parametrize(("gain", "terms"), [(1.0, 2), (-0.5, 1)])
def test_each_term_of_a_draft_has_to_be_likelier_by_as_much(gain, terms, make_fit, monkeypatch):
    """Both cost what a term is worth before any trial; the second gains a nat more than a name takes, or less."""
    fit, needed, seen = make_fit({"joint_damping": {"c": 1.0}}), SURE - PRIOR, []

    def likely(some, view):
        seen.append(some)
        added = len(some.model.effects)
        return [0.0, needed + 1.0, 2 * needed + 1.0 + gain, 0.0][added]

    monkeypatch.setattr(draft, "_log_evidence", likely)
    assert len(draft_effect(fit, View.of(fit)).terms) == terms and len(seen) > terms


@pytest.mark.parametrize("term", LIBRARY, ids=lambda term: term.name)
def test_each_term_is_written_as_it_is_computed(term):
    q, qdot, a = torch.randn(3, 7, dtype=torch.float64).unbind(0)
    written = eval(term.code, {"torch": torch, "q": q, "qdot": qdot, "a": a})
    torch.testing.assert_close(written, term.function(q, qdot, a))


def test_a_known_load_is_the_trial_that_shows_an_unknown_one(make_fit, effects):
    best, *others = propose_trials(Menu.of(make_fit()), effects["hand_load"])
    assert best.trial == "known load of 1 kg" and best.separation > SEPARATED
    assert not any(p.separation > SEPARATED for p in others)


def test_muscles_of_one_electrode_have_one_emg_in_a_trial_that_is_proposed(make_fit):
    fit = make_fit()
    biceps, triceps = fit.model.muscles
    model = replace(fit.model, muscles=(biceps, replace(biceps, name="Bra"), triceps))
    shared = fit_model(model, replace(fit.record, emg=fit.record.emg[..., [0, 0, 1]]), ())
    emg = Menu.of(shared).record.emg
    assert torch.equal(emg[..., 0], emg[..., 1]) and not torch.equal(emg[..., 0], emg[..., 2])


def test_another_posture_tells_the_lean_of_the_arm_from_a_constant_torque(make_fit, effects):
    fit = make_fit({"gravity_tilt": {"phi": 0.1}})
    proposals = propose_trials(Menu.of(fit), effects["gravity_tilt"], effects["constant_torque"])
    separation = {p.trial.split(",")[0]: p.separation for p in proposals}
    assert separation["other posture"] > separation["as recorded"]


def test_another_trial_never_makes_candidates_harder_to_tell(make_fit, effects):
    fit = make_fit({"joint_damping": {"c": 0.5}})
    for proposal in propose_trials(Menu.of(fit), effects["joint_damping"], effects["muscle_damping"]):
        assert proposal.separation >= proposal.now * (1 - 1e-6)
