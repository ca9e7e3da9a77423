"""The fit to torque along the measured motion, and torque that a dynamometer measured."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from myowave.data.trials import TORQUE
from myowave.identification.along import Along
from myowave.identification.free_parameters import free_parameters
from myowave.identification.output_error import fit_model
from myowave.identification.record import make_record
from myowave.identification.torque import (
    ACCURACY,
    COARSE_S,
    HALF_WIDTH_S,
    TorqueBalance,
    fit_torque,
    measured_torque,
    windows_of,
)
from myowave.identification.windows import between
from myowave.physics.dynamics import torques
from myowave.physics.motion import simulate
from myowave.settings import Identify, Scatter

TRUE = {"f0_Bi": 240.0, "f0_Tri": 350.0, "l0_Bi": 0.62}


@pytest.fixture(scope="module")
def free(base):
    return free_parameters(
        base, {name: Identify(start_spread=0.0) for name in TRUE}, (), {"mass": Scatter(relative=0.05)}
    )


def moved(record, base, params, seconds=0.0):
    """The record with the motion that other parameters give, and the muscles' torque along it, (T, N) [N m]."""
    simulation = record.simulation(base, params)
    motion = simulate(simulation, torch.tensor(0.6, dtype=torch.float64))
    position = torch.arange(record.angle.shape[1], dtype=torch.float64)[:, None, None]
    _, activation = simulation.activate(position)
    state = motion.q[..., None], motion.qdot[..., None]
    given = torques(simulation.valued_along(2), *state, activation, {}).driving[..., 0]
    return replace(record, angle=motion.angle.numpy()), given.numpy()


@pytest.fixture(scope="module")
def exact_motion(exact, base):
    return moved(exact, base, TRUE)[0]


def test_a_fit_to_torque_finds_the_parameters_of_the_motion(exact_motion, base, free):
    fit = fit_torque(base, exact_motion, free)
    found = dict(zip((p.name for p in free), fit.values, strict=True))
    for name, value in TRUE.items():
        assert found[name] == pytest.approx(value, rel=0.03)


def test_torque_is_that_of_an_upper_arm_that_leans_over_time(exact, base, free):
    time = torch.arange(exact.angle.shape[1], dtype=torch.float64) * exact.dt
    leaning = replace(exact, course=(0.5 * torch.sin(3 * time)).expand(len(exact.names), -1)[..., None])
    leaning, _ = moved(leaning, base, TRUE)
    fit = fit_torque(base, leaning, free)
    assert dict(zip((p.name for p in free), fit.values, strict=True))["f0_Bi"] == pytest.approx(240, rel=0.03)
    true = np.array([TRUE.get(p.name, p.start) for p in free])
    told, untold = (
        np.abs(TorqueBalance.along(Along(base, r, {})).residual(free, true)).max()
        for r in (leaning, replace(leaning, course=None))
    )
    assert told < 0.1 < untold
    last = leaning.take([1])
    assert torch.equal(last.course[0], leaning.course[1, : last.angle.shape[1]])


def test_a_mass_that_nobody_measured_does_not_run_away_with_the_forces(exact_motion, base, free):
    """Without mass and without forces nothing is left in N m: residuals must not be weighed in N m."""
    light = [replace(p, low=1e-3, deviation=0.05) if p.name == "mass" else p for p in free]
    noisy = replace(
        exact_motion, angle=exact_motion.angle + np.random.default_rng(0).normal(0, 0.02, exact_motion.angle.shape)
    )
    values = dict(zip((p.name for p in free), fit_torque(base, noisy, light).values, strict=True))
    assert values["mass"] == pytest.approx(1.0, abs=0.1) and values["f0_Bi"] > 200


def test_the_share_of_a_trial_does_not_depend_on_the_unit_of_torque(exact_motion, base, free):
    """Twice the mass, the load and the forces is twice the torque: residuals are the same."""
    balance = TorqueBalance.along(Along(base, exact_motion, {}))
    names = [p.name for p in free]
    usual = np.array([base.defaults[n] for n in names])
    double = usual * [2.0 if n.startswith("f0") or n == "mass" else 1.0 for n in names]
    np.testing.assert_allclose(balance.residual(free, double), balance.residual(free, usual), atol=1e-9)


def test_trials_shorter_than_a_window_have_no_fit(exact_motion, base, free):
    short = replace(exact_motion, angle=exact_motion.angle[:, :8], valid=exact_motion.valid[:, :8])
    assert fit_torque(base, short, free) is None


# ------------------------------------------------------------------------------------------------ a dynamometer


@pytest.fixture(scope="module")
def alias(make_noisy, base, effects):
    """A model that may hold a load, what is free, and a record of 0.5 kg in the hand with the torque it took."""
    model = base.with_effects([effects["hand_load"]])
    identify = {name: Identify(start_spread=0.0, low=50.0, high=900.0) for name in ("f0_Bi", "f0_Tri")}
    record, given = moved(make_noisy(0.0).train, model, {"hand_load.m": 0.5})
    noise = np.random.default_rng(1).normal(0, np.radians(0.2), record.angle.shape)
    record = replace(record, angle=record.angle + noise, noise=np.radians(0.2))
    return model, free_parameters(model, identify, ()), record, given


def test_torque_tells_a_load_from_forces_that_motion_cannot_tell_apart(alias):
    model, free, record, given = alias
    without = fit_model(model, record, free)
    measured = given.copy()
    measured[1:] = np.nan  # one trial on the dynamometer is enough
    beside = fit_model(model, replace(record, torque=measured), free)
    assert abs(without.parameters["hand_load.m"] - 0.5) > 0.1, "any load is as good"
    assert beside.parameters["hand_load.m"] == pytest.approx(0.5, abs=0.05)
    assert beside.parameters["f0_Bi"] == pytest.approx(300.0, rel=0.03)
    assert 0 < beside.standard_errors()["hand_load.m"] < 0.1


@pytest.fixture(scope="module")
def beside(alias):
    """What only torque tells, the load, and the fit to both."""
    model, free, record, given = alias
    return [p.name for p in free].index("hand_load.m"), fit_model(model, replace(record, torque=given), free)


def test_standard_errors_with_a_dynamometer_are_the_scatter_of_its_errors(beside, alias):
    """To first order, of errors of 5 % that last as long as a window."""
    load, fit = beside
    model, free, record, given = alias
    last, size = round(2 * HALF_WIDTH_S / record.dt), ACCURACY * np.sqrt((given**2).mean())
    random, rows = np.random.default_rng(2), len(fit.normal.further_slope) - len(free)
    loads = []
    for _ in range(60):
        errors = np.repeat(random.normal(0, size, (len(given), given.shape[1] // last + 1)), last, 1)
        noisy = replace(record, torque=given + errors[:, : given.shape[1]])
        missed = measured_torque(model, noisy, free, fit.values)[0] * fit.record.misfit - fit.normal.further[:rows]
        loads.append(np.linalg.solve(fit.normal.matrix, fit.normal.further_slope[:rows].T @ missed)[load])
    scatter = np.std(loads) * free[load].scale
    assert 0.7 < fit.standard_errors()["hand_load.m"] / scatter < 1.5


def test_what_a_dynamometer_tells_does_not_hang_on_how_well_motion_is_followed(beside):
    _, fit = beside
    worse = replace(fit, normal=replace(fit.normal, residual=5 * fit.normal.residual))
    assert worse.standard_errors()["hand_load.m"] == pytest.approx(fit.standard_errors()["hand_load.m"], rel=0.2)


def test_torque_counts_no_less_where_the_model_misses_the_motion(alias, effects):
    """Damping that the model lacks pulls at the motion; forces stay with what the dynamometer told."""
    model, free, record, _ = alias
    hidden = {"f0_Bi": 390.0, "f0_Tri": 390.0, "joint_damping.c": 2.0}
    record, given = moved(record, model.with_effects([effects["joint_damping"]]), hidden)
    noise = np.random.default_rng(1).normal(0, np.radians(0.2), record.angle.shape)
    fit = fit_model(model, replace(record, angle=record.angle + noise, torque=given), free)
    assert np.degrees(fit.rmse()) > 0.5
    for name in ("f0_Bi", "f0_Tri"):
        assert fit.parameters[name] == pytest.approx(hidden[name], rel=0.015)


def test_the_fit_to_torque_uses_it_too(alias):
    model, free, record, given = alias
    found = fit_torque(model, replace(record, torque=given), free)
    values = dict(zip((p.name for p in free), found.values, strict=True))
    assert values["hand_load.m"] == pytest.approx(0.5, abs=0.1)
    without = fit_torque(model, record, free).values[[p.name for p in free].index("hand_load.m")]
    assert abs(values["hand_load.m"] - 0.5) < 0.5 * abs(without - 0.5)


def test_a_record_takes_the_torque_that_trials_hold(clean, base):
    torque = np.full(clean.angle.shape, np.nan)
    torque[0] = 1.0
    record = make_record(replace(clean, signals={TORQUE: torque}), base)
    np.testing.assert_array_equal(record.take([1, 0]).torque, torque[[1, 0]])
    assert make_record(clean, base).torque is None


@pytest.mark.parametrize("rate_hz", [31.6, 50, 66, 95, 107, 130, 157, 200, 1000])
def test_what_moves_and_what_pulls_are_weighed_over_the_same_windows(rate_hz):
    """Along q = t^3 the acceleration is 6 t, at every rate."""
    dt, samples = 1 / rate_hz, int(3 * rate_hz)
    time = np.arange(samples) * dt
    coarse = max(1, round(COARSE_S / dt))
    windows = windows_of(SimpleNamespace(lengths=[samples], dt=dt))
    moved = windows.integrate(between(time[None] ** 3, [samples], windows.positions(samples)), derivative=2)[0]
    merged = windows.merged(coarse)
    pulled = merged.integrate(6 * dt * merged.positions(samples))
    assert len(pulled) <= len(moved) and len(moved) == windows.inside.shape[1]
    torch.testing.assert_close(moved[: len(pulled)], pulled, rtol=1e-2, atol=1e-4)
