"""The lag of an angle sensor is the solution of its equation, and none where its time constant is 0."""

import numpy as np
import pytest
import torch
from scipy.signal import lsim

from myowave.physics.effects.observation_lag import lagging_angle

DT = 0.01


def motion(samples):
    t = DT * np.arange(samples)
    return np.sin(3 * t) + 0.2 * np.sin(11 * t + 1), 3 * np.cos(3 * t) + 2.2 * np.cos(11 * t + 1)


def lagging(tau, samples=200):
    q, qdot = (torch.from_numpy(x) for x in motion(samples))
    return lagging_angle(q, qdot, DT, tau=torch.tensor(tau, dtype=torch.float64))


@pytest.mark.parametrize("samples", [2, 3, 8, 200])
@pytest.mark.parametrize("tau", [0.002, 0.02, 0.3])
def test_the_lag_solves_its_equation(tau, samples):
    """tau dy/dt = q - y, by another solver, from where a sensor is that followed the same slope for long."""
    q, qdot = motion(samples)
    start = q[0] - tau * qdot[0]
    _, expected, _ = lsim(([1.0], [tau, 1.0]), q, DT * np.arange(samples), X0=[start * tau])
    np.testing.assert_allclose(lagging(tau, samples), expected, atol=1e-10)


def test_a_sensor_without_lag_shows_the_angle():
    np.testing.assert_allclose(lagging(0.0), motion(200)[0], rtol=0, atol=1e-10)


def test_a_short_lag_is_a_delay():
    q, qdot = motion(200)
    tau = 1e-5
    slope = (lagging(tau).numpy() - q) / tau
    np.testing.assert_allclose(slope[1:], -np.diff(q) / DT, rtol=0, atol=1e-3)
    assert slope[0] == pytest.approx(-qdot[0], rel=1e-6)


def test_sensors_of_a_batch_do_not_mix():
    q, qdot = (torch.from_numpy(np.stack([x, 2 * x])) for x in motion(50))
    taus = torch.tensor([[0.02], [0.1]], dtype=torch.float64)
    together = lagging_angle(q, qdot, DT, tau=taus)
    for row, tau, factor in zip(together, (0.02, 0.1), (1, 2), strict=True):
        torch.testing.assert_close(row, factor * lagging(tau, 50))
