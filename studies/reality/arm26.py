"""Arm26 simulated by OpenSim itself: its muscles, with elastic tendons, activation dynamics and Thelen's curves.

    python -m pip install -q --no-deps --target /tmp/opensim opensim==4.6
    PYTHONPATH=/tmp/opensim python -m studies.reality.arm26 data/arm26/trials 1

Lengths of the muscles are those of Arm26's own paths over the bones, data/arm26/path_lengths.csv. The EMG precedes a
muscle's excitation as the preset arm26 has it: by 0.08 s, in the shape of Eq. 2. All else is as it is in the model.
"""

import math
import sys
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from myowave.settings.files import read_yaml

Array = NDArray[np.float64]

opensim: Any = import_module("opensim")
PRESET = read_yaml(Path("data/arm26/arm26.yaml"), "arm26")
LENGTHS = pd.read_csv("data/arm26/path_lengths.csv")
DT_S, LENGTH_S, LEAD_S, DELAY_S, SHAPE, NOISE_DEG = 0.01, 7.0, 0.5, 0.08, 0.2, 0.5
TURN_S = 0.6  # between turns of the EMG
RANGE_DEG = (2.0, 128.0)  # within the range of the model
LEVELS = {"emg_biceps": (0.04, 0.22), "emg_triceps": (0.02, 0.16), "emg_brachialis": (0.04, 0.22)}
# What the model says of all its muscles (Thelen 2003).
MUSCLE = {
    **{"activation_time_constant": 0.01, "deactivation_time_constant": 0.04},
    **{"FmaxTendonStrain": 0.033, "FmaxMuscleStrain": 0.6, "KshapeActive": 0.5, "KshapePassive": 4.0},
    **{"Af": 0.3, "Flen": 1.8},
}
# Kilograms in the hand, damping of the joint [N m s/rad], and whether the brachialis goes its own way.
CASES = {
    "plain": (0.0, 0.0, False),
    "loaded": (1.0, 0.0, False),
    "damped": (0.0, 0.6, False),
    "brachialis": (0.0, 0.0, True),
}


def arm(load_kg: float, damping: float) -> Any:
    """The model, upright and with a still shoulder; a load in the hand and a damper at the joint beside it."""
    joint, model = PRESET["joint"], opensim.Model()
    model.setGravity(opensim.Vec3(0, -9.8066, 0))
    mass = joint["mass_kg"] + load_kg
    com = (joint["mass_kg"] * joint["com_m"] + load_kg * joint["grip_m"]) / mass
    about_elbow = joint["inertia_kg_m2"] + load_kg * joint["grip_m"] ** 2
    inertia = opensim.Inertia(0.001, 0.001, about_elbow - mass * com**2)
    forearm = opensim.Body("forearm", mass, opensim.Vec3(0, -com, 0), inertia)
    elbow = opensim.PinJoint("elbow", model.getGround(), forearm)
    elbow.updCoordinate().setName("flexion")
    damper = opensim.SpringGeneralizedForce("flexion")
    damper.setStiffness(0.0)
    damper.setRestLength(0.0)
    damper.setViscosity(damping)
    model.addBody(forearm)
    model.addJoint(elbow)
    model.addForce(damper)
    for name, values in PRESET["muscles"].items():
        rows, length = LENGTHS[LENGTHS["muscle"] == name], opensim.SimmSpline()
        for angle, at in zip(np.radians(rows["angle_deg"]), rows["length_m"], strict=True):
            length.addPoint(angle, at)
        path, muscle = opensim.FunctionBasedPath(), opensim.Thelen2003Muscle()
        path.appendCoordinatePath("/jointset/elbow/flexion")
        path.setLengthFunction(length)
        muscle.setName(name)
        muscle.set_path(path)
        own = {
            "max_isometric_force": values["f0_N"],
            "optimal_fiber_length": values["l0_m"],
            "tendon_slack_length": values["slack_m"],
            "pennation_angle_at_optimal": values["pennation_rad"],
            "max_contraction_velocity": values["vmax_m_s"] / values["l0_m"],
        }
        for key, value in (MUSCLE | own).items():
            getattr(muscle, f"set_{key}")(value)
        model.addForce(muscle)
    return model


def simulate(model: Any, emg: Mapping[str, Array], times: Array, start: float) -> Array:
    """Angle [rad] at every time, from rest at `start` with muscles and tendons in balance; infinite once it has left
    the range of the model for good."""
    model.finalizeConnections()
    controller, muscles = opensim.PrescribedController(), model.getMuscles()
    controller.setName("nerves")
    controller.setActuators(model.updActuators())
    excitation = {name: np.expm1(SHAPE * values) / math.expm1(SHAPE) for name, values in emg.items()}
    for name, values in excitation.items():
        course = opensim.PiecewiseLinearFunction()
        for at, value in zip(times + DELAY_S, values, strict=True):
            course.addPoint(at, value)
        controller.prescribeControlForActuator(name, course)
    model.addController(controller)
    state = model.initSystem()
    flexion = model.getCoordinateSet().get("flexion")
    flexion.setValue(state, start)
    for name, values in excitation.items():
        muscles.get(name).setActivation(state, max(0.01, float(values[0])))
    model.equilibrateMuscles(state)
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(1e-6)
    state.setTime(float(times[0]))
    manager.initialize(state)
    angle = np.full(len(times), np.inf)
    for place, at in enumerate(times):
        state = manager.integrate(float(at)) if place else state
        value = flexion.getValue(state)
        if not math.radians(-5) < value < math.radians(140):
            break
        angle[place] = value
    return angle


def trial(rng: np.random.Generator, load_kg: float, damping: float, own_brachialis: bool) -> pd.DataFrame:
    """A trial that stays within the range of the model; others are drawn anew."""
    channels = {name: values["emg"] for name, values in PRESET["muscles"].items()}
    if own_brachialis:
        channels["BRA"] = "emg_brachialis"
    times = np.arange(-LEAD_S, LENGTH_S - DT_S / 2, DT_S)
    knots, kept = np.arange(times[0] - 1.0, times[-1] + 1.5, TURN_S), times >= -DT_S / 2
    low, high = np.radians(RANGE_DEG)
    while True:
        turns = {c: CubicSpline(knots, rng.uniform(*LEVELS[c], len(knots))) for c in sorted(set(channels.values()))}
        emg = {c: np.clip(turn(times), 0.01, 1.0) for c, turn in turns.items()}
        start = rng.uniform(*np.radians((40.0, 80.0)))
        angle = simulate(arm(load_kg, damping), {n: emg[c] for n, c in channels.items()}, times, start)
        if low < angle[kept].min() and angle[kept].max() < high:
            break
    angle = angle + math.radians(NOISE_DEG) * rng.standard_normal(len(angle))
    table = {"time_s": times, **{c: emg[c] for c in ("emg_biceps", "emg_triceps")}, "angle_rad": angle}
    return pd.DataFrame(table)[kept].round(5)


def main(folder: str, seed: str) -> None:
    """Four trials of each case."""
    opensim.Logger.setLevelString("Off")
    opensim.Logger.removeFileSink()
    Path(folder).mkdir(parents=True, exist_ok=True)
    for place, (name, case) in enumerate(CASES.items()):
        rng = np.random.default_rng([int(seed), place])
        for number in range(1, 5):
            packed = {"method": "gzip", "mtime": 0}
            trial(rng, *case).to_csv(f"{folder}/{name}{number}.csv.gz", index=False, compression=packed)


if __name__ == "__main__":
    main(*sys.argv[1:])
