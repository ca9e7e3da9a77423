"""Effects with a state of their own: equilibrium without lag, second order, and lags in the right direction."""

import numpy as np
import pytest
import torch

from myowave.physics.curves import FAMILIES
from myowave.physics.effects import catalogue
from myowave.physics.effects.compliant_tendon import balanced, compliance, elongation
from myowave.physics.motion import Pull, simulate
from myowave.physics.simulation import Simulation

DOUBLE = torch.float64


def settle(time_constants, steps, *, stiffness=0.3, end=1.0, start=0.2):
    """State after `end` seconds of dy/dt = (target - y) / T; target and T move and depend on the state."""
    rise, fall = (torch.tensor(t, dtype=DOUBLE) for t in time_constants)
    state, h = torch.tensor(start, dtype=DOUBLE), end / steps

    def relaxation(quantities):
        target = 0.5 + 0.4 * torch.sin(3 * quantities["time"]) - stiffness * torch.sin(quantities["state"])
        lag = (1 + 0.3 * torch.cos(2 * quantities["time"])) * (0.5 + quantities["state"])
        return target, rise * lag, fall * lag

    for n in range(steps):
        begin, stop = ({"time": torch.tensor(t, dtype=DOUBLE)} for t in (n * h, (n + 1) * h))
        state = Pull.at(relaxation, state, begin).relax(torch.tensor(h, dtype=DOUBLE), stop)
    return state.item()


def test_relaxation_is_second_order():
    exact = settle((0.4, 0.4), 4096)
    errors = [abs(settle((0.4, 0.4), n) - exact) for n in (16, 32, 64)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (abs(orders - 2) < 0.3).all(), orders


@pytest.mark.parametrize("step", [0.01, 0.5, 3.0])
def test_a_relaxation_to_what_is_linear_in_state_and_time_is_exact_however_long(step):
    """y' = (0.3 + 0.2 t - 0.8 y - y) / 0.4 from 0.1: a line, and what fades from where it began."""

    def relaxation(quantities):
        lag = torch.tensor(0.4, dtype=DOUBLE)
        return 0.3 + 0.2 * quantities["time"] - 0.8 * quantities["state"], lag, lag

    begin, end = ({"time": torch.tensor(time, dtype=DOUBLE)} for time in (0.0, step))
    pull = Pull.at(relaxation, torch.tensor(0.1, dtype=DOUBLE), begin)
    rising = 0.2 / 1.8
    line = (0.3 - rising * 0.4) / 1.8
    exact = line + rising * step + (0.1 - line) * np.exp(-1.8 * step / 0.4)
    assert pull.relax(torch.tensor(step, dtype=DOUBLE), end).item() == pytest.approx(exact, rel=1e-6)


def test_without_lag_the_state_is_at_its_target():
    state = settle((0.0, 0.0), 8, stiffness=0.0)
    assert state == pytest.approx(0.5 + 0.4 * np.sin(3.0), abs=1e-12)


@pytest.mark.parametrize("time_constant", [1e-12, 1e-6, 1e-2, 1.0, 1e6])
def test_a_state_never_passes_its_target_however_stiff(time_constant):
    def relaxation(_):
        return (torch.tensor(1.0, dtype=DOUBLE), *(torch.tensor(time_constant, dtype=DOUBLE),) * 2)

    state = Pull.at(relaxation, torch.tensor(0.0, dtype=DOUBLE), {}).relax(torch.tensor(0.01, dtype=DOUBLE), {})
    assert state.item() == pytest.approx(-np.expm1(-0.01 / time_constant), rel=1e-9)


def test_a_lagging_activation_moves_the_joint_by_what_it_is_in_the_middle_of_a_step(elbow, dt):
    emg = (0.2 + 0.6 * torch.linspace(0, 1, 60, dtype=DOUBLE) ** 2).reshape(1, -1, 1).repeat(1, 1, 2)
    model = elbow.with_effects([catalogue()["activation_dynamics"]])
    lags = {"activation_dynamics.rise": 0.05, "activation_dynamics.decay": 0.05}
    exact, one, two = (simulate(Simulation(model, lags, emg, dt, substeps=n), 1.0).q for n in (32, 1, 2))
    order = torch.log2((one - exact).abs().max() / (two - exact).abs().max())
    assert order > 1.7, order


def test_rise_lags_rising_and_decay_lags_falling_activation(elbow, dt):
    ramp = torch.cat([torch.full((10,), 0.3), torch.linspace(0.3, 0.8, 30), torch.linspace(0.8, 0.3, 30)]).to(DOUBLE)
    emg = torch.stack([ramp, torch.full_like(ramp, 0.2)], -1)[None]
    model = elbow.with_effects([catalogue()["activation_dynamics"]])
    plain = simulate(Simulation(model, {}, emg, dt), 1.0).state[0, :, 2]
    rise = simulate(Simulation(model, {"activation_dynamics.rise": 0.1}, emg, dt), 1.0).state[0, :, 2]
    decay = simulate(Simulation(model, {"activation_dynamics.decay": 0.1}, emg, dt), 1.0).state[0, :, 2]
    going_up, going_down = slice(18, 38), slice(50, 68)
    assert (rise[going_up] < plain[going_up] - 0.01).all()
    torch.testing.assert_close(decay[going_up], plain[going_up], rtol=0, atol=1e-9)
    assert (decay[going_down] > plain[going_down] + 0.01).all()


@pytest.mark.parametrize(
    ("name", "time_constant"), [("rise", lambda a: 0.1 * (0.5 + 1.5 * a)), ("decay", lambda a: 0.1 / (0.5 + 1.5 * a))]
)
def test_time_constants_change_with_the_activation_as_thelens_do(name, time_constant):
    effect, state = catalogue()["activation_dynamics"], torch.tensor([0.05, 0.6], dtype=DOUBLE)
    _, rise, decay = effect.relaxation(
        torch.tensor(0.3, dtype=DOUBLE), state, rise=torch.tensor(0.1), decay=torch.tensor(0.1)
    )
    torch.testing.assert_close({"rise": rise, "decay": decay}[name], time_constant(state), rtol=1e-6, atol=0)


def test_a_stretching_tendon_carries_the_force_of_a_shorter_fibre_at_rest(elbow, dt):
    """Constant EMG: when all has come to rest, the tendon's force is the fibre's at its stretched-out length."""
    emg = torch.tensor([0.5, 0.3], dtype=DOUBLE).expand(1, 130, 2)
    model = elbow.with_effects([catalogue()["compliant_tendon"], catalogue()["joint_damping"]])
    strain = 0.1
    motion = simulate(Simulation(model, {"compliant_tendon.strain": strain, "joint_damping.c": 8.0}, emg, dt), 1.0)
    q, force = motion.q[0, -1], motion.state[0, -1, 2:]
    assert motion.qdot[0, -1].abs() < 1e-6
    path = torch.sqrt(0.3**2 + 0.8**2 + 2 * 0.3 * 0.8 * torch.cos(q))
    fibre = (path - 0.55 * (1 + strain * _thelens_elongation(force[0].item()))) / 0.6
    a = np.expm1(0.2 * 0.5) / np.expm1(0.2)
    expected = a * elbow.curves.active_length(fibre) + elbow.curves.passive(fibre)
    assert force[0].item() == pytest.approx(expected.item(), abs=1e-6)


@pytest.mark.parametrize("curves", FAMILIES)
def test_a_tendon_begins_with_the_force_of_its_fibre_however_long_and_soft_it_is(curves):
    a, length, velocity, slack, strain = torch.rand(5, 20_000, dtype=DOUBLE, generator=torch.manual_seed(0))
    a, length, velocity, slack, strain = 0.01 + 0.99 * a, 0.4 + 1.3 * length, velocity - 0.6, 3 * slack, 0.15 * strain
    strain.requires_grad_()
    hill = FAMILIES[curves].force

    def begun(strain):
        rigid = hill(a, length, velocity)
        return balanced(a, hill, length, velocity, rigid, torch.ones(1, dtype=DOUBLE), slack, strain=strain)

    force = begun(strain)
    torch.testing.assert_close(hill(a, length - strain * slack * elongation(force), velocity), force, rtol=0, atol=1e-9)
    (by_strain,) = torch.autograd.grad(force.sum(), strain)
    with torch.no_grad():
        ahead, behind = begun(strain + 1e-7) - force, force - begun(strain - 1e-7)
    smooth = (ahead - behind).abs() < 1e-3 * 1e-7  # not at a kink
    assert smooth.double().mean() > 0.95
    torch.testing.assert_close(by_strain[smooth], (ahead + behind)[smooth] / 2e-7, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("force", [0.02, 0.1, 0.33, 0.6, 1.0])
def test_a_tendon_is_soft_where_it_carries_little(force):
    step, force = 1e-6, torch.tensor(force, dtype=DOUBLE)
    assert elongation(force).item() == pytest.approx(_thelens_elongation(force.item()), rel=1e-9)
    slope = (elongation(force + step) - elongation(force - step)) / (2 * step)
    assert compliance(force).item() == pytest.approx(slope.item(), rel=5e-3)


def _thelens_elongation(force):
    """Thelen 2003, Eq. 5 solved for the strain, in units of that at f0: 1 there, and above the toe the line that
    leads to it, whose slope (1 - 0.33) / (1 - 0.609) he prints as 1.712."""
    if force < 0.33:
        return 0.609 / 3 * np.log(1 + force / 0.33 * (np.exp(3) - 1))
    return 1.0 - (1.0 - force) * (1 - 0.609) / (1 - 0.33)


@pytest.mark.parametrize("delays", [(0.08, 0.08), (0.08, 0.073)])
def test_a_motion_begins_with_the_activation_that_earlier_emg_has_left(elbow, noisy_emg, dt, delays):
    """Cut off what came before and keep its EMG: the motion goes on as it was."""
    emg, lead = noisy_emg[0.10][:2, :120], 40
    model = elbow.with_effects([catalogue()["activation_dynamics"], catalogue()["fatigue"]])
    values = {"activation_dynamics.rise": 0.05, "activation_dynamics.decay": 0.09, "fatigue.k": 0.5}
    values |= dict(zip(("delay_Bi", "delay_Tri"), delays, strict=True))
    whole = simulate(Simulation(model, values, emg, dt), 1.0)
    later = simulate(Simulation(model, values, emg, dt, lead=lead), whole.q[:, lead], whole.qdot[:, lead])
    torch.testing.assert_close(later.state, whole.state[:, lead:], rtol=0, atol=1e-12)


def test_fatigue_weakens_a_muscle_that_works(elbow, dt):
    emg = torch.tensor([0.7, 0.2], dtype=DOUBLE).expand(1, 300, 2)
    model = elbow.with_effects([catalogue()["fatigue"]])
    q = simulate(Simulation(model, {"fatigue.k": 0.5}, emg, dt), 1.2).q[0]
    assert q[280:].mean() < q[100:120].mean() - 0.01


def test_a_piece_of_a_step_without_length_leaves_a_state_where_it_is(elbow, dt):
    """Copies whose delays coincide have such pieces, if they are simulated beside copies whose delays do not."""
    emg = torch.tensor([0.5, 0.3], dtype=DOUBLE).expand(1, 10, 2) * torch.linspace(0.5, 1.0, 10, dtype=DOUBLE)[:, None]
    model = elbow.with_effects([catalogue()["activation_dynamics"]])
    lag = {"activation_dynamics.rise": 0.03, "activation_dynamics.decay": 0.06}
    delays = torch.tensor([[0.08], [0.07]], dtype=DOUBLE)
    both = simulate(Simulation(model, lag | {"delay_Tri": delays}, emg, dt), 1.0)
    for row, delay in zip(both.state, delays.flatten().tolist(), strict=True):
        one = simulate(Simulation(model, lag | {"delay_Tri": delay}, emg, dt), 1.0)
        torch.testing.assert_close(row, one.state, rtol=0, atol=1e-9)
