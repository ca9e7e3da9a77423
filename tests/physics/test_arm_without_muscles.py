"""An arm without muscles: nothing drives it, or a motor whose torque is known."""

import numpy as np
import pytest
import torch
from scipy.integrate import solve_ivp

from myowave.models import build_model
from myowave.physics.effects import catalogue
from myowave.physics.joint import STANDARD_GRAVITY
from myowave.physics.model import Model
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation
from myowave.physics.trajectory import solve
from myowave.settings import Physics

DT = 0.005
TIME = np.arange(300) * DT
TORQUE = 0.3 * np.sin(5 * TIME)
EMG = torch.zeros(1, len(TIME), 0, dtype=torch.float64)
MASS, COM, INERTIA, BRAKING = 0.49, 0.1, 0.0067, 0.05


@pytest.fixture
def machine():
    return Model((), {"mass": MASS, "com": COM, "inertia": INERTIA, "grip": COM})


def driven(model, params):
    """By a motor; the lean of the upper arm stays at 0."""
    course = torch.from_numpy(np.stack([np.zeros_like(TORQUE), TORQUE], -1))[None]
    return Simulation(model, {"braking": BRAKING, **params}, EMG, DT, course=course)


def test_a_machine_moves_as_an_independent_solver_says(machine):
    """The motor's torque is linear between samples and falls with speed; friction sees it with the weight."""
    model = machine.with_effects([catalogue()["load_friction"], catalogue()["quadratic_drag"]])
    q = simulate(driven(model, {"load_friction.mu": 0.2, "load_friction.s": 0.9, "quadratic_drag.d": 0.003}), 1.0).q[0]

    def turn(t, state):
        motor = np.interp(t, TIME, TORQUE) - BRAKING * state[1]
        weight = -MASS * STANDARD_GRAVITY * COM * np.sin(state[0])
        drag = 0.003 * state[1] * abs(state[1])
        friction = 0.2 * abs(motor - weight) * np.tanh(state[1] / (0.03 * np.exp(0.9)))
        return [state[1], (motor + weight - friction - drag) / INERTIA]

    found = solve_ivp(turn, TIME[[0, -1]], [1.0, 0.0], t_eval=TIME, rtol=1e-9, atol=1e-9, max_step=DT)
    torch.testing.assert_close(q, torch.from_numpy(found.y[0]), rtol=0, atol=1e-4)


def test_back_emf_is_a_damping_that_is_known(machine):
    damped = machine.with_effects([catalogue()["joint_damping"]])
    with_emf = simulate(driven(machine, {}), 1.0).q
    torch.testing.assert_close(
        with_emf, simulate(driven(damped, {"braking": 0.0, "joint_damping.c": BRAKING}), 1.0).q, rtol=0, atol=1e-9
    )
    assert (with_emf - simulate(driven(machine, {"braking": 0.0}), 1.0).q).abs().max() > 0.1


def test_nothing_drives_a_pendulum_which_keeps_its_energy(machine):
    motion = simulate(Simulation(machine, {}, EMG, DT), 1.0)
    energy = 0.5 * INERTIA * motion.qdot**2 - MASS * STANDARD_GRAVITY * COM * torch.cos(motion.q)
    assert (energy - energy[:, :1]).abs().max() < 1e-4 * energy.abs().max()


def test_derivatives_are_those_of_the_motion(machine):
    model = machine.with_effects([catalogue()["load_friction"]])
    usual = {"load_friction.mu": 0.2, "load_friction.s": 1.2, "inertia": INERTIA, "braking": BRAKING, "tilt": 0.1}
    start = torch.tensor([1.0], dtype=torch.float64), torch.zeros(1, dtype=torch.float64)
    found = solve(driven(model, usual), *start, wrt=dict.fromkeys(usual, 0.01))
    for name, derivative in zip(usual, found.by_parameter, strict=True):
        by = 1e-4 * usual[name]
        more, less = (simulate(driven(model, {**usual, name: usual[name] + s * by}), 1.0).q for s in (1, -1))
        torch.testing.assert_close(derivative, (more - less) / (2 * by), rtol=1e-3, atol=1e-4)


def test_effects_on_muscles_are_refused_and_those_on_the_joint_and_the_sensor_act(machine):
    acting = {name for name, effect in catalogue().items() if not machine.refuses(effect)}
    assert {"joint_damping", "load_friction", "hand_load", "angle_offset"} <= acting
    assert not acting & {"brachialis", "emg_gain", "fatigue", "vmax_change", "millard_curves", "muscle_damping"}
    with pytest.raises(ValueError, match="acts on muscles, and the arm has none"):
        machine.with_effects([catalogue()["emg_gain"]])


def test_a_machine_has_no_constants_of_muscles(machine):
    arm = {"muscles": {}, "joint": {"mass_kg": MASS, "com_m": COM, "inertia_kg_m2": INERTIA, "grip_m": COM}}
    physics = Physics.model_validate(arm)
    assert (
        set(machine.defaults)
        == set(physics.nominal)
        == {*("mass", "com", "inertia", "grip", "load", "tilt", "motor", "braking", "drive")}
    )
    assert set(build_model("base+joint_damping", physics).defaults) == {*machine.defaults, "joint_damping.c"}
