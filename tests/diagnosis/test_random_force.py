"""Effects beside noise of the EMG: what such noise can do is not put down to an effect, and the other way round."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import torch

from myowave.diagnosis.evidence import EVIDENCE
from myowave.diagnosis.misfit import left
from myowave.diagnosis.search import conclude
from myowave.diagnosis.search.conclude import Findings, search
from myowave.diagnosis.search.verdict import judge
from myowave.identification.disturbance import estimate_disturbance, excitation_forcing, wandering
from myowave.identification.output_error import fit_model
from myowave.identification.record import make_record
from myowave.physics.motion import simulate

CANDIDATES = ("joint_damping", "gravity_tilt", "joint_stiffness", "emg_crosstalk")


@pytest.fixture(scope="module")
def searched(make_trials, base, free, effects) -> Callable[..., Findings]:
    """What a search finds where the recorded EMG has noise that did not drive the arm."""

    def make(hidden: dict, emg_noise: float, seed: int = 0) -> Findings:
        trials = make_trials(hidden)
        wrong = emg_noise * np.random.default_rng(seed).standard_normal(trials.emg.shape)
        record = make_record(replace(trials, emg=trials.emg + wrong), base).train
        return search(fit_model(base, record, free), [effects[name] for name in CANDIDATES])

    return make


@pytest.mark.parametrize("seed", range(2))
def test_noise_of_the_emg_alone_is_named_alone(searched, seed):
    verdict = judge(searched({}, 0.05, seed))
    assert verdict.causes == ("emg_noise",) and verdict.kind == "effect" and not verdict.structure_left
    assert verdict.emg_noise == pytest.approx(0.05, rel=0.5)


def test_an_effect_beside_noise_of_the_emg_is_found_and_sized(searched):
    found = searched({"joint_damping": {"c": 1.5}}, 0.05)
    verdict = judge(found)
    assert verdict.causes == ("joint_damping", "emg_noise")
    fit = found.selection.fit
    error = fit.standard_errors()["joint_damping.c"]
    assert fit.parameters["joint_damping.c"] == pytest.approx(1.5, abs=4 * error) and error < 0.5
    assert fit.record.filter is found.disturbance.whitener


def test_a_little_that_is_slow_beside_a_force_is_no_rest_and_much_is(searched, monkeypatch):
    found = searched({}, 0.05)
    beside = left.size_given_force(found.selection.fit, found.disturbance)
    for ratio, rest in ((2.5, False), (4.0, True)):
        slow = replace(beside, ratio=ratio, critical=1.5)
        monkeypatch.setattr(left, "size_given_force", lambda *args, slow=slow: slow)
        again = conclude.conclude(found.selection, found.disturbance)
        assert again.left.only_noise is not rest and (again.left.slow > 0) is rest


@pytest.mark.parametrize("damping", [0.6, 1.0, 1.5])
def test_an_effect_alone_needs_no_force_beside_it(searched, damping):
    """While it is missing its misfit calls for one."""
    found = searched({"joint_damping": {"c": damping}}, 0.0)
    assert judge(found).causes == ("joint_damping",)
    assert found.disturbance is None and found.selection.fit.record.filter is None


def test_less_than_any_sensor_shows_is_not_missing(make_fit, effects):
    """Two programs that solve the same equations differ by as much."""
    fit = make_fit({"joint_damping": {"c": 1e-3}}, noise_deg=0.0)
    found = search(fit, [effects[name] for name in CANDIDATES])
    assert np.radians(1e-6) < fit.rmse() < np.radians(1e-3)
    assert found.left.repeated.significant and judge(found).kind == "adequate"


def test_effects_that_leave_little_to_a_force_are_weighed_without_it(searched, monkeypatch):
    gains = []

    def doubtful(fit):
        force = estimate_disturbance(fit)
        gains.append(0.05 * gains[0] if fit.model.effects else force.gain)
        return replace(force, gain=gains[-1])

    monkeypatch.setattr(conclude, "estimate_disturbance", doubtful)
    found = searched({"joint_damping": {"c": 1.5}}, 0.0)
    assert gains[-1] > EVIDENCE
    assert found.disturbance is None and judge(found).causes == ("joint_damping",)


def test_noise_of_the_emg_moves_the_arm_as_far_as_is_foretold(make_fit):
    fit = make_fit()
    forcing = excitation_forcing(fit)
    valid, noise, starts = fit.record.valid, 0.02, torch.from_numpy(fit.starts)
    foretold = noise * wandering(fit.linear.jacobian.numpy(), forcing @ np.swapaxes(forcing, -1, -2), valid)
    squares = []
    for seed in range(8):
        wrong = noise * np.random.default_rng(seed).standard_normal(fit.record.emg.shape)
        noisy = replace(fit.record, emg=fit.record.emg + torch.from_numpy(wrong))
        moved = simulate(noisy.simulation(fit.model, fit.params), *starts.unbind(-1)).angle.numpy() - fit.angle
        squares.append((moved[valid] ** 2).mean())
    assert foretold == pytest.approx(np.sqrt(np.mean(squares)), rel=0.15)


def test_what_noise_of_the_emg_does_to_the_motion_is_a_share_of_what_is_left(searched):
    found = searched({}, 0.05)
    verdict = judge(found)
    together = np.hypot(found.disturbance.angle, verdict.emg_motion)
    assert verdict.emg_motion > found.disturbance.angle
    assert together == pytest.approx(found.selection.fit.rmse(), rel=0.35)
