"""The motion solved for all samples at once: the integrator's own motion and its derivatives."""

import pytest
import torch

from myowave.physics.effects import catalogue
from myowave.physics.motion import simulate
from myowave.physics.trajectory import solve

CASES = {
    "base": {},
    "state": {"activation_dynamics": 0.04, "compliant_tendon": 0.05},
    "observation": {"angle_offset": 0.05, "clock_shift": 0.02},
    "joint": {"joint_damping": 0.5, "extra_delay": 0.013},
}


@pytest.mark.parametrize("case", CASES)
def test_solution_is_the_integrated_motion_and_its_derivatives(case, elbow, noisy_emg, dt):
    effects = [catalogue()[name] for name in CASES[case]]
    model = elbow.with_effects(effects)
    emg = noisy_emg[0.10][:2, :15]
    params = {full: CASES[case][e.name] for e in effects for full in model.parameters_of(e)}
    params["f0_Bi"] = torch.tensor([[300.0], [320.0]], dtype=torch.float64)  # a batch of two
    q0, qdot0 = torch.tensor([1.0, 0.9], dtype=torch.float64), torch.tensor([0.0, 0.2], dtype=torch.float64)
    wrt = {"f0_Bi": 30.0, "l0_Tri": 0.02} | {n: p.typical for e in effects for n, p in model.parameters_of(e).items()}

    reference = simulate(model, params, emg, dt, q0, qdot0)
    guess = reference.state + 0.01
    found = solve(model, params, emg, dt, q0, qdot0, guess=guess, wrt=wrt)
    torch.testing.assert_close(found.motion.angle, reference.angle, rtol=0, atol=1e-8)

    def moved(name, step):
        nudged = {**params, name: params.get(name, model.defaults[name]) + step}
        return simulate(model, nudged, emg, dt, q0, qdot0).angle

    for derivative, (name, scale) in zip(found.by_parameter, wrt.items(), strict=True):
        step = 1e-4 * scale
        difference = (moved(name, step) - moved(name, -step)) / (2 * step)
        torch.testing.assert_close(derivative * scale, difference * scale, rtol=2e-3, atol=2e-5)

    def started(dq, dqdot):
        return simulate(model, params, emg, dt, q0 + dq, qdot0 + dqdot).angle

    step = 1e-5
    by_start = [(started(a, b) - started(-a, -b)) / (2 * step) for a, b in ((step, 0.0), (0.0, step))]
    torch.testing.assert_close(found.by_start, torch.stack(by_start), rtol=1e-3, atol=1e-4)
