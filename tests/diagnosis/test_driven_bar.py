"""A bar that a motor drives, its torque recorded with noise, which moved nothing."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from myowave.data.trials import MOTOR, Trials
from myowave.diagnosis.comparison.baselines import EMG_ONLY, MOTOR_ONLY, POSTURE
from myowave.diagnosis.comparison.horizons import Restarts, baselines
from myowave.diagnosis.comparison.torque import compare_torque
from myowave.diagnosis.likelihood.hypothesis import Hypothesis, settle
from myowave.diagnosis.likelihood.sensor import Sensor
from myowave.diagnosis.likelihood.waves import View
from myowave.diagnosis.report.facts import fitting, parameters_of
from myowave.diagnosis.report.templates import described
from myowave.diagnosis.search.answer import answer_of
from myowave.diagnosis.search.diagnose import _proposals
from myowave.diagnosis.search.weigh import _looked_filtered, weigh_models
from myowave.identification.along import Along
from myowave.identification.free_parameters import bind_values, free_parameters
from myowave.identification.record import make_record
from myowave.identification.stages import fit_in_stages
from myowave.physics.joint import STANDARD_GRAVITY
from myowave.physics.model import Model
from myowave.settings import Identify, Scatter

DT, SAMPLES, NAMES = 0.02, 200, ("a", "b", "c")
BAR = {"mass": 0.8, "com": 0.3, "inertia": 0.1, "grip": 0.6}
CLOCK = DT * np.arange(SAMPLES)


def driven(damping, noise):
    """Trials of a bar by an independent solver; the recorded torque [N m] is 3 % less than what drives it."""
    random, weight = np.random.default_rng(5), BAR["mass"] * STANDARD_GRAVITY * BAR["com"]
    angle, torque = [], []
    for _ in NAMES:
        hz, phase = random.uniform(0.2, 1.0, 3), random.uniform(0.0, 6.0, 3)

        def push(t, hz=hz, phase=phase):
            return 0.3 * np.sin(2 * np.pi * np.multiply.outer(t, hz) + phase).sum(-1)

        def turn(t, state, push=push):
            return state[1], (push(t) - weight * np.sin(state[0]) - damping * state[1]) / BAR["inertia"]

        begin = random.uniform(-0.5, 0.5, 2)
        moved = solve_ivp(turn, CLOCK[[0, -1]], begin, "DOP853", CLOCK, rtol=1e-9, atol=1e-10).y[0]
        angle.append(moved + np.radians(0.05) * random.standard_normal(SAMPLES))
        torque.append(push(CLOCK) / 1.03 + noise * random.standard_normal(SAMPLES))
    return Trials.from_sequences(
        dataset="bar",
        dt=DT,
        names=list(NAMES),
        channels=[],
        emg=[np.zeros((SAMPLES, 0))] * len(NAMES),
        angle=angle,
        signals={MOTOR: torque},
        over_time={"motor": MOTOR},
        conditions={name: {"motor": float(np.median(own))} for name, own in zip(NAMES, torque, strict=True)},
        test=(),
        constants={"mass": BAR["mass"]},
    )


def fitted(trials):
    machine, known = Model((), BAR), {"drive": Scatter(absolute=0.05)}
    record = make_record(trials, machine)
    return fit_in_stages(machine, record, free_parameters(machine, {"inertia": Identify()}, record.known, known))


@pytest.mark.parametrize("damping, named", [(0.0, ()), (0.09, (("joint_damping",),))])
def test_noise_of_a_recorded_torque_is_no_missing_effect(effects, damping, named):
    """It takes the model's arm ten times as far as the noise of the angle."""
    few = [effects[name] for name in ("joint_damping", "coulomb_friction", "quadratic_drag")]
    answer = answer_of(weigh_models(fitted(driven(damping, noise=0.05)), few))
    assert (answer.kind, answer.named) == ("effect" if named else "adequate", named)
    mean, error = answer.best.averaged["drive"]
    assert abs(mean - 1.03) < 3 * error < 0.05


def test_a_filter_that_drew_a_fit_away_is_judged_by_one_without_it():
    """Through a filter that no sensor has, the right model is led to where something is left that a filter explains."""
    fit = fitted(driven(damping=0.0, noise=0.0))
    plain = View.of(fit)
    drawn = settle(Hypothesis.of(fit, plain.through(Sensor(corner_hz=2.0))))
    assert drawn.fit.rmse() > 10 * fit.rmse()
    assert _looked_filtered(drawn, plain)


def test_no_trial_of_muscles_is_proposed_for_a_machine(effects):
    """The trials of the menu are told by the EMG that they need."""
    fit = fitted(driven(damping=0.0, noise=0.0))
    ladder = SimpleNamespace(fit=fit, fits=[fit])
    verdict = SimpleNamespace(ladder=ladder, named=(("joint_damping", "quadratic_drag"),), maybe=("joint_damping",))
    assert _proposals(verdict, effects) == {}


def test_what_is_compared_with_a_bar_sees_its_motor_and_no_emg():
    fit = fitted(driven(damping=0.0, noise=0.0))
    along = Along(fit.model, fit.record, bind_values(fit.free, fit.values))
    r2 = compare_torque([along]).groupby("model")["r2"].min()
    assert r2[MOTOR_ONLY] > 0.99 > r2[POSTURE] and EMG_ONLY not in r2
    ahead = baselines(fit.record, Restarts.every(fit.record, 0.25))
    assert MOTOR_ONLY in ahead and EMG_ONLY not in ahead
    swinging = replace(fit.record, course=None)
    assert not {MOTOR_ONLY, EMG_ONLY} & {*baselines(swinging, Restarts.every(swinging, 0.25))}


def test_a_machine_is_told_of_in_its_own_words(effects):
    """Titles of effects and meanings of constants speak of an arm."""
    fit = fitted(driven(damping=0.0, noise=0.0))
    machine = [name for name, effect in effects.items() if not effect.needs_muscles]
    words = [fitting(effects[name].title, fit.model) for name in machine]
    words += [of["meaning"] for of in parameters_of(fit, {name.name: (1.0, 0.1) for name in fit.free}).values()]
    assert not re.search(r"EMG|muscle|hand|elbow|\barm|forearm|flexing", " ".join(words)), words
    assert "a load that nobody noted" in words and "moment of inertia about the joint" in words
    assert described("base+hand_load", {"base": "model", "hand_load": words[0]}) == f"model with {words[0]}"
