"""A sensor on a spring shows the angle plus a share of the acceleration."""

import numpy as np
import pytest
import torch
from scipy.integrate import solve_ivp

from myowave.physics.effects.elastic_mount import giving_angle

DT, OMEGA = 0.002, 3.0


def giving(q, qdot, s):
    return giving_angle(*(torch.from_numpy(np.asarray(x)) for x in (q, qdot)), DT, s=torch.tensor(s)).numpy()


def test_an_angle_without_acceleration_is_seen_as_it_is():
    t = DT * np.arange(5)
    np.testing.assert_allclose(giving(1 + 2 * t, np.full(5, 2.0), 0.01), 1 + 2 * t, atol=1e-15)


@pytest.mark.parametrize("samples", [2, 3, 200])
def test_of_a_steady_acceleration_it_sees_the_same_share_at_every_sample(samples):
    t = DT * np.arange(samples)
    np.testing.assert_allclose(giving(t**2, 2 * t, 0.003) - t**2, 0.006, atol=1e-12)


def test_a_motor_behind_a_stiff_rod_turns_ahead_of_the_load():
    """Load I on a rod of stiffness K that a motor turns as sin(w t): the motor's encoder sees q + (I / K) qddot."""
    inertia, stiffness = 0.15, 1500.0
    t = DT * np.arange(1500)
    lagging = 1 / (1 - OMEGA**2 * inertia / stiffness)  # of the load's steady motion

    def change(time, state):
        return state[1], stiffness / inertia * (np.sin(OMEGA * time) - state[0])

    load = solve_ivp(change, (0, t[-1]), (0, lagging * OMEGA), t_eval=t, rtol=1e-10, atol=1e-12).y
    np.testing.assert_allclose(giving(*load, inertia / stiffness)[1:-1], np.sin(OMEGA * t)[1:-1], atol=1e-7)
