"""Friction that is largest near rest is found beside damping, and not taken for dry friction and drag."""

import numpy as np
import torch

from myowave.data.trials import Trials
from myowave.diagnosis.search.answer import answer_of
from myowave.diagnosis.search.weigh import weigh_models
from myowave.identification.free_parameters import free_parameters
from myowave.identification.record import make_record
from myowave.identification.stages import fit_in_stages
from myowave.physics.model import Model
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation
from myowave.settings import Identify

DT, SAMPLES, NOISE = 0.02, 100, np.radians(0.1)
HIDDEN = {"joint_damping.c": 0.01, "stribeck_friction.tau": 0.06, "stribeck_friction.s": np.log(0.7 / 0.5)}


def test_friction_near_rest_is_named_beside_damping(effects):
    machine = Model((), {"mass": 1.0, "com": 0.2, "inertia": 0.05, "grip": 0.2})
    hidden = ("joint_damping", "stribeck_friction")
    emg = torch.zeros(3, SAMPLES, 0, dtype=torch.float64)
    start = torch.tensor([1.5, 1.0, 0.7], dtype=torch.float64)
    motion = simulate(Simulation(machine.with_effects([effects[n] for n in hidden]), HIDDEN, emg, DT), start)
    angle = motion.angle.numpy() + NOISE * np.random.default_rng(1).standard_normal((3, SAMPLES))
    record = make_record(Trials("swings", DT, ("a", "b", "c"), (), emg.numpy(), angle, (SAMPLES,) * 3, ()), machine)
    fit = fit_in_stages(machine, record, free_parameters(machine, {"inertia": Identify()}, ()))
    answer = answer_of(weigh_models(fit, [effects[n] for n in (*hidden, "coulomb_friction", "quadratic_drag")]))
    assert answer.kind == "effect" and {name for (name,) in answer.named} == set(hidden)
    mean, covariance = answer.best.estimate
    for p, value, error in zip(answer.best.fit.free, mean, np.sqrt(np.diag(covariance)), strict=True):
        if p.name in HIDDEN:
            assert abs(value - HIDDEN[p.name]) < 3 * error, p.name
