"""The integrator against an independent one: numpy equations written anew from the paper, scipy's DOP853."""

from dataclasses import replace

import numpy as np
import torch
from scipy.integrate import solve_ivp

from myowave.physics.curves import DEGROOTE
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation

MASS, LENGTH, GRAVITY = 1.0, 1.0, 9.80665
FLEXOR = {"f0": 300.0, "l0": 0.6, "vmax": 6.0, "slack": 0.55, "l1": 0.3, "l2": 0.8}
EXTENSOR = {"f0": 300.0, "l0": 0.4, "vmax": 4.0, "slack": 0.33, "l1": 0.2, "l2": 0.7}
DELAY, SHAPE = 0.08, 0.2
SUBSTEPS = 4  # the kinks of the curves at fibre length 0.6 and at velocity 0 ask for them


def muscle_torque(q, qdot, a, muscle, sign):
    """Eqs. 45-50 and 57-59 for one muscle; `sign` is +1 for the biceps and -1 for the triceps."""
    l1, l2 = muscle["l1"], muscle["l2"]
    path = np.sqrt(l1**2 + l2**2 + sign * 2 * l1 * l2 * np.cos(q))
    arm = l1 * l2 * np.sin(q) / path
    length = (path - muscle["slack"]) / muscle["l0"]
    velocity = -sign * arm * qdot / muscle["vmax"]
    if not 0.4 <= length <= 1.6:
        active = 0.0
    elif length < 0.6:
        active = 9 * (length - 0.4) ** 2
    elif length <= 1.4:
        active = 1 - 4 * (1 - length) ** 2
    else:
        active = 9 * (length - 1.6) ** 2
    if length <= 1:
        passive = 0.0
    elif length <= 1.4:
        passive = 0.075 * (np.exp(6.6 * (length - 1)) - 1)
    else:
        passive = 0.075 * (np.exp(6.6 * 0.4) * (1 + 6.6 * (length - 1.4)) - 1)
    return sign * muscle["f0"] * (a * active * hill(velocity) + passive) * arm


def hill(velocity):
    """Force at a velocity, from Hill's hyperbola (F + a)(b - v) = b (1 + a) on the shortening side, where a = b leaves
    no force at v = -1; lengthening, the hyperbola (F_max - F)(c + v) = c (F_max - 1) with the same slope at v = 0."""
    a = b = 0.25
    largest = 1.4
    if velocity <= 0:
        return max(b * (1 + a) / (b - velocity) - a, 0.0)
    c = (largest - 1) * b / (1 + a)
    return largest - c * (largest - 1) / (c + velocity)


def reference(emg, dt, q0):
    """q (N,) by DOP853, restarted at every kink of the delayed EMG."""
    samples, emg = np.arange(len(emg)) * dt, np.maximum(emg, 0.0)

    def excitation(t, channel):
        return np.interp(t - DELAY, samples, emg[:, channel])

    def slope(t, x):
        q, qdot = x
        biceps, triceps = ((np.exp(SHAPE * excitation(t, c)) - 1) / (np.exp(SHAPE) - 1) for c in (0, 1))
        torque = muscle_torque(q, qdot, biceps, FLEXOR, 1) + muscle_torque(q, qdot, triceps, EXTENSOR, -1)
        return [qdot, (torque - MASS * GRAVITY * LENGTH * np.sin(q)) / (MASS * LENGTH**2)]

    kinks = np.unique(np.concatenate([samples, samples + DELAY]))
    state, angles = np.array([q0, 0.0]), {0.0: q0}
    for begin, end in zip(kinks[:-1], kinks[1:], strict=True):
        if begin >= samples[-1]:
            break
        state = solve_ivp(slope, (begin, end), state, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
        angles[end] = state[0]
    return np.array([angles[t] for t in samples])


def test_motion_agrees_with_an_independent_solver_on_noisy_emg(elbow, noisy_emg, dt):
    emg = torch.stack([emg[0] for emg in noisy_emg.values()])
    q = simulate(Simulation(elbow, {}, emg, dt, SUBSTEPS), 1.0).q.numpy()
    assert q.min() > 0.1 and q.max() < 1.7
    expected = np.stack([reference(trial, dt, 1.0) for trial in emg.numpy()])
    np.testing.assert_allclose(q, expected, rtol=0, atol=1e-6)


def test_integrator_converges_with_fourth_order_where_the_equations_are_smooth(elbow, dt):
    """Curves without kinks, and EMG straight but for the kink where the delay ends, which a step boundary meets."""
    smooth = replace(elbow, curves=DEGROOTE)
    time = torch.arange(8, dtype=torch.float64) * dt
    emg = torch.stack([0.5 + time, 0.2 + 0.1 * time], dim=-1)[None]

    def end(substeps):
        return simulate(Simulation(smooth, {}, emg, dt, substeps), 0.7, 1.5).q[0, -1].item()

    exact = end(40)
    errors = [abs(end(n) - exact) for n in (2, 4, 8)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 3.7).all(), (orders, errors)


def test_motion_derivatives_are_those_of_the_motion(elbow, noisy_emg, dt):
    emg = noisy_emg[0.10][:1, :15]
    f0 = torch.tensor(300.0, dtype=torch.float64, requires_grad=True)
    l0 = torch.tensor(0.4, dtype=torch.float64, requires_grad=True)

    def last(f0, l0):
        return simulate(Simulation(elbow, {"f0_Bi": f0, "l0_Tri": l0}, emg, dt), 1.0).q[0, -1]

    torch.autograd.gradcheck(last, (f0, l0), eps=1e-6, atol=1e-7)
