"""Mechanics of the elbow: energy, virtual work, exact aliases."""

import numpy as np
import pytest
import torch
from scipy.integrate import solve_ivp

from myowave.physics.dynamics import muscle_quantities, torques
from myowave.physics.effects import catalogue
from myowave.physics.joint import STANDARD_GRAVITY
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation
from myowave.physics.valued import give_values

ANGLES = torch.linspace(0.15, 2.2, 60, dtype=torch.float64)
REST = torch.zeros_like(ANGLES)
INACTIVE = torch.zeros(len(ANGLES), 2, dtype=torch.float64)


def slope(function, x, step=1e-6):
    return (function(x + step) - function(x - step)) / (2 * step)


def work_done(torque, begin, end):
    """Integral of a torque from one angle to another, by Gauss-Legendre quadrature on short pieces."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    edges = torch.linspace(begin, end, 201, dtype=torch.float64)
    half = torch.diff(edges)[:, None] / 2
    q = (edges[:-1, None] + half) + half * torch.from_numpy(nodes)
    return (torque(q.flatten()).reshape(q.shape) * torch.from_numpy(weights) * half).sum()


@pytest.mark.parametrize("tilt", [0.0, 0.5])
def test_torque_of_gravity_is_the_slope_of_the_energy_of_a_raised_mass(elbow, tilt):
    valued = give_values(elbow, {"mass": 1.7, "length": 0.4, "load": 0.6, "tilt": tilt}, ANGLES)
    gravity = torques(valued, ANGLES, REST, INACTIVE, {}).gravity
    height = lambda q: -0.4 * torch.cos(q + tilt)  # noqa: E731
    torch.testing.assert_close(gravity, -slope(lambda q: (1.7 + 0.6) * 9.80665 * height(q), ANGLES), rtol=0, atol=1e-8)


def test_passive_muscles_return_the_energy_stored_in_their_fibres(elbow):
    """Torque about the joint against the strain energy f0 l0 integral f_P dl of the fibres."""
    params = {"slack_Bi": 0.25, "slack_Tri": 0.15, "pennation_Tri": 0.3}

    def state(q):
        valued = give_values(elbow, params, q)
        return valued, muscle_quantities(valued, q, torch.zeros_like(q), torch.zeros(len(q), 2, dtype=q.dtype))

    def torque(q):
        valued, _ = state(q)
        return torques(valued, q, torch.zeros_like(q), torch.zeros(len(q), 2, dtype=q.dtype), {}).driving

    ends = torch.tensor([0.3, 1.4], dtype=torch.float64)
    valued, quantities = state(ends)
    lengths = quantities["fibre_length"]
    stored = sum(
        300.0 * valued.muscle["l0"][..., m].item() * work_done(elbow.curves.passive, *lengths[:, m].tolist())
        for m in (0, 1)
    )
    assert abs(stored) > 1.0  # joules: the muscles are stretched
    torch.testing.assert_close(work_done(torque, 0.3, 1.4), -stored, rtol=1e-6, atol=0)


@pytest.mark.parametrize("offset", [0.0, 0.02])
def test_moment_arms_do_the_virtual_work_of_the_path(offset, elbow):
    model = elbow.with_effects([catalogue()["moment_arm_offset"]])
    params = {"moment_arm_offset.d_Bi": offset, "moment_arm_offset.d_Tri": -offset}
    valued = give_values(model, params, ANGLES)

    def path(q):
        fibre = muscle_quantities(valued, q, REST, INACTIVE)["fibre_length"]
        return fibre * valued.muscle["l0"] + valued.muscle["slack"]

    arm = muscle_quantities(valued, ANGLES, REST, INACTIVE)["moment_arm"]
    torch.testing.assert_close(arm, -slope(path, ANGLES), rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", ["joint_stiffness", "joint_stops", "gravity_tilt", "constant_torque"])
def test_elastic_torques_do_no_work_around_a_closed_path_and_ignore_speed(name, elbow):
    effect = catalogue()[name]
    valued = give_values(
        elbow.with_effects([effect]), {f"{name}.{n}": p.typical for n, p in effect.parameters.items()}, ANGLES
    )
    still = torques(valued, ANGLES, REST, INACTIVE, {}).effects
    moving = torques(valued, ANGLES, REST + 3.0, INACTIVE + 0.5, {}).effects
    assert (still != 0).any()
    torch.testing.assert_close(moving.expand_as(ANGLES), still.expand_as(ANGLES), rtol=0, atol=0)


@pytest.mark.parametrize("name", ["joint_damping", "coulomb_friction", "stribeck_friction", "muscle_damping"])
def test_friction_and_damping_only_take_energy(name, elbow):
    effect = catalogue()[name]
    model = elbow.with_effects([effect])
    q, qdot = torch.meshgrid(ANGLES, torch.linspace(-6, 6, 41, dtype=torch.float64), indexing="ij")
    active = torch.full((*q.shape, 2), 0.4, dtype=torch.float64)
    value = {f"{name}.{n}": p.typical for n, p in effect.parameters.items()}
    with_it, without = (torques(give_values(model, p, q), q, qdot, active, {}).total for p in (value, {}))
    power = (with_it - without) * qdot
    assert power.max() <= 1e-12
    assert power.min() < -0.1


def test_a_load_is_the_same_motion_as_weaker_muscles(elbow, noisy_emg, dt):
    emg, load = noisy_emg[0.10][:2, :150], 0.35
    loaded = simulate(Simulation(elbow, {"load": load}, emg, dt), 1.0)
    weaker = simulate(Simulation(elbow, {"f0_Bi": 300 / (1 + load), "f0_Tri": 300 / (1 + load)}, emg, dt), 1.0)
    assert (loaded.q - simulate(Simulation(elbow, {}, emg, dt), 1.0).q).abs().max() > 0.05
    torch.testing.assert_close(loaded.q, weaker.q, rtol=0, atol=1e-9)


def test_a_known_tilt_in_one_trial_is_the_effect_there_and_adds_to_it(elbow, noisy_emg, dt):
    emg = noisy_emg[0.10][:2, :150]
    model = elbow.with_effects([catalogue()["gravity_tilt"]])
    known = simulate(Simulation(model, {"tilt": torch.tensor([0.0, 0.3]), "gravity_tilt.phi": 0.1}, emg, dt), 1.0)
    effect = simulate(Simulation(model, {"gravity_tilt.phi": torch.tensor([0.1, 0.4])}, emg, dt), 1.0)
    torch.testing.assert_close(known.q, effect.q, rtol=0, atol=1e-6)
    assert (known.q - simulate(Simulation(elbow, {}, emg, dt), 1.0).q).abs().amax(-1).min() > 0.02


def test_an_arm_without_muscles_swings_below_an_upper_arm_that_leans_over_time(elbow, dt):
    """Against an independent solver; the lean is linear between samples."""
    time = np.arange(120) * dt
    tilt = 0.2 + 0.5 * np.sin(2.0 * time)
    emg = torch.zeros(1, len(time), 2, dtype=torch.float64)
    limp = {"f0_Bi": 1e-9, "f0_Tri": 1e-9, "tilt": 0.2}
    q = simulate(Simulation(elbow, limp, emg, dt, course=torch.from_numpy(tilt - 0.2)[None, :, None]), 1.0).q[0]

    def swing(t, state):
        return [state[1], -STANDARD_GRAVITY * np.sin(state[0] + np.interp(t, time, tilt))]

    found = solve_ivp(swing, time[[0, -1]], [1.0, 0.0], t_eval=time, rtol=1e-9, atol=1e-9, max_step=dt)
    torch.testing.assert_close(q, torch.from_numpy(found.y[0]), rtol=0, atol=1e-4)


def test_a_lean_over_time_that_stays_the_same_is_the_constant(elbow, noisy_emg, dt):
    emg = noisy_emg[0.10][:2, :100]
    model = elbow.with_effects([catalogue()["gravity_tilt"]])
    sway = torch.full((2, 100, 1), 0.3, dtype=torch.float64)
    over_time = simulate(Simulation(model, {"tilt": 0.1, "gravity_tilt.phi": 0.1}, emg, dt, course=sway), 1.0)
    constant = simulate(Simulation(model, {"tilt": 0.4, "gravity_tilt.phi": 0.1}, emg, dt), 1.0)
    torch.testing.assert_close(over_time.q, constant.q, rtol=0, atol=1e-12)


def test_an_emg_gain_is_strength_where_activation_is_proportional_to_emg(elbow, noisy_emg, dt):
    emg = noisy_emg[0.10][:2, :150]
    model = elbow.with_effects([catalogue()["emg_gain"]])
    linear = {"shape_Bi": 0.0, "shape_Tri": 0.0, "slack_Bi": 0.6, "slack_Tri": 0.5}  # no passive force either
    gain = simulate(
        Simulation(model, {**linear, "emg_gain.g_emg_biceps": 0.1, "emg_gain.g_emg_triceps": -0.05}, emg, dt), 1.0
    )
    strength = simulate(Simulation(model, {**linear, "f0_Bi": 330.0, "f0_Tri": 285.0}, emg, dt), 1.0)
    torch.testing.assert_close(gain.q, strength.q, rtol=0, atol=1e-9)


def test_pennate_fibres_lengthen_as_fast_as_their_length_changes(elbow):
    """And so they and the tendon that they pull on do the same work: fibres are slower than it and pull harder."""
    params = {"slack_Bi": 0.25, "slack_Tri": 0.15, "pennation_Bi": 0.3, "pennation_Tri": 0.5}
    speed, active = 2.5, torch.full((len(ANGLES), 2), 0.6, dtype=torch.float64)
    valued = give_values(elbow, params, ANGLES)

    def along(q):
        return muscle_quantities(valued, q, REST + speed, active)

    of_length = speed * slope(lambda q: along(q)["fibre_length"] * valued.muscle["l0"], ANGLES)
    fibre = along(ANGLES)
    velocity = fibre["fibre_velocity"] * valued.muscle["vmax"]
    torch.testing.assert_close(velocity, of_length, rtol=0, atol=1e-7)
    of_fibres = -(valued.muscle["f0"] * fibre["force"] * velocity).sum(-1)
    torch.testing.assert_close(torques(valued, ANGLES, REST + speed, active, {}).driving * speed, of_fibres)
