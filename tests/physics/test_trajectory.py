"""The motion solved for all samples at once: the integrator's own motion and its derivatives."""

from dataclasses import replace

import pytest
import torch

from myowave.physics import tangent, trajectory
from myowave.physics.effects import SHIPPED, catalogue
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation
from myowave.physics.trajectory import Newton, derivatives_of, solve

CASES = {
    "base": {},
    "state": {"activation_dynamics": 0.04, "compliant_tendon": 0.05},
    "observation": {"angle_offset": 0.05, "clock_shift": 0.02, "clock_drift": 0.01},
    "joint": {"joint_damping": 0.5, "extra_delay": 0.013},
}
START = torch.tensor([1.0, 0.9], dtype=torch.float64), torch.tensor([0.0, 0.2], dtype=torch.float64)


@pytest.fixture(scope="module")
def everything(elbow, noisy_emg, dt):
    """Every effect at once, at a quarter of its typical strength, and delays that differ between the muscles.

    Activation lags as much as is usual: by less than a part of a step, and the integrator's error covers the derivative
    by a delay.
    """
    model = elbow.with_effects(SHIPPED)
    params = {name: 0.25 * p.typical for name, p in model.effect_parameters.items()}
    params |= {"delay_Tri": 0.07, "activation_dynamics.rise": 0.03, "activation_dynamics.decay": 0.06}
    return Simulation(model, params, noisy_emg[0.10][:2, :8], dt)


def value(simulation, name):
    return simulation.params.get(name, simulation.model.defaults[name])


def one_of(count, i, axes):
    """1 at place i of `count`, else 0, with `axes` axes of length 1 behind, (count, 1, ...)."""
    return torch.eye(count, dtype=torch.float64)[i].reshape(-1, *(1,) * axes)


def sizes(model):
    """A usual change of every parameter of a model."""
    constants = {name: 0.3 * abs(value) or 0.05 for name, value in model.defaults.items()}
    return constants | {name: abs(p.typical) for name, p in model.effect_parameters.items()}


@pytest.mark.parametrize("case", CASES)
def test_solution_is_the_integrated_motion_and_its_derivatives(case, elbow, noisy_emg, dt):
    effects = [catalogue()[name] for name in CASES[case]]
    model = elbow.with_effects(effects)
    params = {full: CASES[case][e.name] for e in effects for full in model.parameters_of(e)}
    params["f0_Bi"] = torch.tensor([[300.0], [320.0]], dtype=torch.float64)  # a batch of two
    params["delay_Tri"] = 0.07  # where delays are the same, steps are split in another way before and behind that
    sway = torch.linspace(-0.3, 0.4, 30, dtype=torch.float64).reshape(2, 15)
    simulation = Simulation(model, params, noisy_emg[0.10][:2, :15], dt, course=sway[..., None])
    wrt = {name: size for name, size in sizes(model).items() if name in ("f0_Bi", "l0_Tri", *model.effect_parameters)}
    q0, qdot0 = START

    reference = simulate(simulation, q0, qdot0)
    found = solve(simulation, q0, qdot0, guess=reference.state + 0.01, wrt=wrt)
    torch.testing.assert_close(found.motion.angle, reference.angle, rtol=0, atol=1e-8)

    step = 1e-4 * torch.tensor([*wrt.values()], dtype=torch.float64)

    def moved(sign):
        copies = {n: value(simulation, n) + sign * step[i] * one_of(len(wrt), i, 2) for i, n in enumerate(wrt)}
        return simulate(simulation.with_params(copies), q0, qdot0).angle

    scale = 1e4 * step[:, None, None, None]
    difference = (moved(1) - moved(-1)) / 2e-4
    # Another delay splits the integrator's steps elsewhere, which changes its error; the derivative leaves that out.
    torch.testing.assert_close(found.by_parameter * scale, difference, rtol=2e-3, atol=5e-5)

    def started(dq, dqdot):
        return simulate(simulation, q0 + dq, qdot0 + dqdot).angle

    h = 1e-5
    by_start = [(started(a, b) - started(-a, -b)) / (2 * h) for a, b in ((h, 0.0), (0.0, h))]
    torch.testing.assert_close(found.by_start, torch.stack(by_start), rtol=1e-3, atol=1e-4)


def test_derivatives_by_every_parameter_of_every_effect_are_those_of_the_simulated_motion(everything):
    """The simulated motions know nothing of which parameters share the drive: each copy computes its own."""
    everything, wrt = replace(everything, substeps=4), sizes(everything.model)
    still = simulate(everything, *START)
    found = solve(everything, *START, guess=still.state, wrt=wrt)
    step = 1e-5
    copies = {
        name: value(everything, name) + step * size * one_of(len(wrt), i, 1)
        for i, (name, size) in enumerate(wrt.items())
    }
    moved = simulate(everything.with_params(copies), *START)
    difference = (moved.angle - still.angle) / step
    derivative = found.by_parameter * torch.tensor([*wrt.values()], dtype=torch.float64)[:, None, None]
    for name, one, other in zip(wrt, derivative, difference, strict=True):
        # Another delay splits the integrator's steps elsewhere, which changes its error (states are of second order).
        close = 1e-4 if "delay" in name else 1e-5
        torch.testing.assert_close(one, other, rtol=5e-3, atol=close, msg=lambda text, name=name: f"{name}: {text}")


@pytest.fixture(scope="module")
def stateless(elbow, noisy_emg, dt):
    """Every effect without a state at once, all constants where they often are, curves as published, no pennation."""
    model = elbow.with_effects([e for e in SHIPPED if not e.stateful])
    params = {name: 0.25 * p.typical for name, p in model.effect_parameters.items()} | {"delay_Tri": 0.07}
    return Simulation(model, params, noisy_emg[0.10][:2, 20:60], dt)


def differences(simulation, wrt, step=1e-6):
    """d angle / d parameter in units of usual changes, (P, T, N), from simulated motions."""

    def moved(sign):
        copies = {
            name: value(simulation, name) + sign * step * size * one_of(len(wrt), i, 1)
            for i, (name, size) in enumerate(wrt.items())
        }
        return simulate(simulation.with_params(copies), *START).angle

    return (moved(1) - moved(-1)) / (2 * step)


def in_usual_changes(found, wrt):
    return found.by_parameter * torch.tensor([*wrt.values()], dtype=torch.float64)[:, None, None]


@pytest.mark.parametrize("late", [(), ("activation_dynamics", "fatigue")], ids=["no states", "states of activation"])
def test_derivatives_by_every_parameter_that_a_model_with_stiff_tendons_has(stateless, late):
    model = stateless.model.with_effects([e for e in SHIPPED if e.name in late])
    params = {name: p.typical for name, p in model.effect_parameters.items()}
    simulation = replace(stateless, model=model, params=params | stateless.params)
    # A lag has a kink where activation is at rest: there two-sided differences by what moves its target say little.
    wrt = {n: size for n, size in sizes(model).items() if not late or not model.drives(n) or n.startswith(late)}
    found = in_usual_changes(solve(simulation, *START, wrt=wrt), wrt)
    for name, one, other in zip(wrt, found, differences(simulation, wrt), strict=True):
        # Another delay splits the integrator's steps elsewhere, which changes its error.
        close = 5e-3 if model.drives(name) else 2e-3
        bound = 2e-2 * float(other.abs().max()) if model.drives(name) else 2e-5
        torch.testing.assert_close(one, other, rtol=close, atol=bound, msg=lambda text, name=name: f"{name}: {text}")


def test_long_trials_are_differentiated_in_parts(stateless, monkeypatch):
    wrt = {name: sizes(stateless.model)[name] for name in ("f0_Bi", "delay_Bi", "joint_damping.c")}
    whole = solve(stateless, *START, wrt=wrt).by_parameter
    monkeypatch.setattr("myowave.physics.tangent.MOST_POINTS", 100)
    calls = []
    by_steps = tangent._by_steps
    monkeypatch.setattr(tangent, "_by_steps", lambda *given: calls.append(given[1][..., 0].numel()) or by_steps(*given))
    torch.testing.assert_close(solve(stateless, *START, wrt=wrt).by_parameter, whole, rtol=1e-9, atol=1e-12)
    assert len(calls) > 5 and max(calls) <= 100


def test_derivatives_follow_an_upper_arm_that_leans_over_time(elbow, noisy_emg, dt):
    emg = noisy_emg[0.10][:2, 20:60]
    sway = 0.5 * torch.sin(torch.arange(40, dtype=torch.float64) * dt * 3).expand(2, -1)
    leaning = Simulation(elbow, {}, emg, dt, course=sway[..., None])
    wrt = {name: sizes(elbow)[name] for name in ("f0_Bi", "mass", "tilt")}
    found = in_usual_changes(solve(leaning, *START, wrt=wrt), wrt)
    torch.testing.assert_close(found, differences(leaning, wrt), rtol=2e-3, atol=2e-5)


def test_a_shared_drive_is_the_drive_of_the_changed_parameters(everything):
    assert everything.drive.activation.shape[-1] == 2
    shared = set()
    for name, size in sizes(everything.model).items():
        changed = everything.with_params({name: value(everything, name) + size})
        if changed.drive is everything.drive:
            shared.add(name)
        alone = Simulation(changed.model, changed.params, changed.emg, changed.dt).drive
        torch.testing.assert_close(changed.drive.excitation, alone.excitation, rtol=0, atol=0)
        torch.testing.assert_close(changed.drive.activation, alone.activation, rtol=0, atol=0)
        torch.testing.assert_close(changed.drive.pieces, alone.pieces, rtol=0, atol=0)
    assert {"f0_Bi", "mass", "joint_damping.c"} <= shared
    assert not {"delay_Bi", "shape_Tri", "emg_gain.g_emg_biceps", "extra_delay.d_emg_biceps"} & shared


def test_an_effect_at_zero_has_the_derivatives_that_it_has_in_its_own_model(elbow, noisy_emg, dt):
    emg = noisy_emg[0.10][:2, :15]
    base = solve(Simulation(elbow, {}, emg, dt), *START)
    effects = [catalogue()[name] for name in ("joint_damping", "emg_crosstalk", "vmax_change", "angle_scale")]
    richer = Simulation(elbow.with_effects(effects), {}, emg, dt)
    wrt = {name: p.typical for name, p in richer.model.effect_parameters.items()}
    by_parameter, tangent = derivatives_of(richer, base.linear, wrt)
    own = solve(richer, *START, wrt=wrt)
    torch.testing.assert_close(by_parameter, own.by_parameter, rtol=1e-4, atol=1e-6)
    torch.testing.assert_close(tangent, own.tangent[..., : len(wrt)], rtol=1e-4, atol=1e-6)


def test_a_hopeless_guess_is_rescued_by_the_integrator_only_if_asked(elbow, noisy_emg, dt):
    simulation = Simulation(elbow, {}, noisy_emg[0.10][:2, :15], dt)
    reference = simulate(simulation, *START)
    guess = torch.full_like(reference.state, 40.0)
    few = Newton(iterations=2)
    torch.testing.assert_close(solve(simulation, *START, guess=guess, newton=few).motion.angle, reference.angle)
    left = solve(simulation, *START, guess=guess, newton=Newton(iterations=2, rescue=False))
    assert not left.gap < few.tolerance


def test_a_motion_that_runs_out_of_all_numbers_is_none(elbow, noisy_emg, dt):
    """Where a step of the parameters makes the motion diverge, its size is a number whose square is none."""
    simulation = Simulation(
        elbow.with_effects([catalogue()["joint_damping"]]), {"joint_damping.c": -1e4}, noisy_emg[0.10][:2, :15], dt
    )
    guess = torch.ones(2, 15, 2, dtype=torch.float64)
    left = solve(simulation, *START, guess=guess, newton=Newton(iterations=2, rescue=False))
    assert not left.gap < 1.0


def test_a_motion_that_runs_away_is_given_up_early(elbow, noisy_emg, dt, monkeypatch):
    simulation = Simulation(
        elbow.with_effects([catalogue()["joint_damping"]]), {"joint_damping.c": -1e4}, noisy_emg[0.10][:2, :15], dt
    )
    tried = []
    linearise = tangent.linearise
    monkeypatch.setattr(trajectory, "linearise", lambda *a: tried.append(1) or linearise(*a))
    left = solve(simulation, *START, guess=torch.ones(2, 15, 2).double(), newton=Newton(rescue=False))
    assert not left.gap < 1.0 and len(tried) <= 4


def test_a_solution_is_as_near_to_the_motion_as_it_says(elbow, noisy_emg, dt):
    simulation = Simulation(elbow, {}, noisy_emg[0.10][:2, :40], dt)
    reference, rough = simulate(simulation, *START), Newton(tolerance=1e-3, rescue=False)
    nearby = solve(simulation.with_params({"f0_Bi": 250.0}), *START, wrt={"f0_Bi": 1.0})
    for near in (None, nearby.linear.jacobian):
        found = solve(simulation, *START, guess=nearby.motion.state, newton=rough, near=near)
        # The last step is quadratic: it leaves far less than was asked for.
        assert (found.motion.state - reference.state).abs().max() < 1e-12 and found.gap < 1e-10


def test_a_parameter_that_no_part_of_the_model_has_is_refused(elbow, noisy_emg, dt):
    simulation = Simulation(elbow, {}, noisy_emg[0.10][:1, :5], dt)
    for attempt in (
        lambda: simulate(Simulation(elbow, {"f0_Ba": 1.0}, simulation.emg, dt), 1.0),
        lambda: simulation.with_params({"f0_Ba": 1.0}).valued,
    ):
        with pytest.raises(ValueError, match="base: no parameter f0_Ba; it has .*f0_Bi"):
            attempt()
    with pytest.raises(KeyError, match="f0_Ba"):
        solve(simulation, *(x[:1] for x in START), wrt={"f0_Ba": 1.0})
