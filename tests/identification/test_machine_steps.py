"""A fit simulates a machine in steps that are short enough for dry friction that brakes it at once."""

import numpy as np
import torch
from scipy.integrate import solve_ivp

from myowave.data.trials import Trials
from myowave.identification.record import make_record
from myowave.physics.joint import STANDARD_GRAVITY
from myowave.physics.model import Model
from myowave.physics.motion import simulate

DT, SAMPLES = 0.01, 300
PENDULUM = {"mass": 0.3, "com": 0.1, "inertia": 0.012, "grip": 0.15}


def test_a_light_pendulum_stops_as_an_independent_solver_has_it(effects):
    """Friction that brakes by 2.5 rad/s^2, all there at 0.01 rad/s."""
    clock, weight, tau, near = DT * np.arange(SAMPLES), 0.03 * STANDARD_GRAVITY, 0.03, 0.01

    def turn(t, state):
        return state[1], -(weight * np.sin(state[0]) + tau * np.tanh(state[1] / near)) / PENDULUM["inertia"]

    angle = solve_ivp(turn, clock[[0, -1]], (1.5, 0.0), "Radau", clock, rtol=1e-9, atol=1e-11).y[0]
    model = Model((), PENDULUM).with_effects([effects["coulomb_friction"]])
    record = make_record(Trials("swing", DT, ("a",), (), np.zeros((1, SAMPLES, 0)), angle[None], (SAMPLES,), ()), model)
    values = {"coulomb_friction.tau": tau, "coulomb_friction.s": float(np.log(near / 0.03))}
    found = simulate(record.simulation(model, values), torch.tensor([1.5], dtype=torch.float64)).angle[0].numpy()
    assert np.degrees(np.abs(found - angle).max()) < 0.02
