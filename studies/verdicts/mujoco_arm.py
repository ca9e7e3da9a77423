"""An arm that MuJoCo moves: its muscles, their curves and activation, its friction, springs and solver.

    python -m pip install --no-deps -r studies/verdicts/requirements.txt

Shapes: T trials, N samples; muscles are biceps and triceps.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from myowave.data.trials import Array
from studies.verdicts.simulator import GRAVITY, REST
from studies.verdicts.simulator import Arm as Paper

EFFECTS = (
    *("joint_damping", "coulomb_friction", "joint_stiffness", "gravity_tilt", "forearm_inertia", "constant_torque"),
    *("emg_crosstalk", "activation_dynamics", "observation_lag"),
)
STEP_S = 0.0005
AT_ONCE_S = 0.001  # time constant of an activation that does not lag in the other direction
IN_REACH = (-1.0, 3.5)  # rad
RANGE = (0.75, 1.05)  # of the lengths of a muscle that MuJoCo is told, in units of its fibre
ARM = """
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step}" gravity="{forward} 0 {down}" integrator="implicitfast"/>
  <worldbody>
    <site name="origin0" pos="0 0 {origins[0]}"/> <site name="origin1" pos="0 0 {origins[1]}"/>
    <body>
      <joint axis="0 1 0" damping="{damping}" frictionloss="{friction}" stiffness="{stiffness}" springref="{rest}"
             armature="{armature}"/>
      <inertial pos="0 0 -1" mass="{mass}" diaginertia="1e-6 1e-6 1e-6"/>
      <site name="insertion0" pos="0 0 {insertions[0]}"/> <site name="insertion1" pos="0 0 {insertions[1]}"/>
    </body>
  </worldbody>
  <tendon>
    <spatial name="muscle0"> <site site="origin0"/> <site site="insertion0"/> </spatial>
    <spatial name="muscle1"> <site site="origin1"/> <site site="insertion1"/> </spatial>
  </tendon>
  <actuator> {muscles[0]} {muscles[1]} </actuator>
</mujoco>
"""
MUSCLE = (
    '<general tendon="muscle{place}" gaintype="muscle" gainprm="{curves}" biastype="muscle" biasprm="{curves}" '
    'lengthrange="{shortest} {longest}" {activation}/>'
)
LAGS = 'dyntype="muscle" dynprm="{rise} {decay} 0" actlimited="true" actrange="0 1"'


@dataclass(frozen=True)
class Arm:
    """Two muscles and a forearm; what is drawn is near the paper's Table 1 and MuJoCo's own curves."""

    origins: Array  # heights over the hinge of a straight arm [m], (2,)
    insertions: Array
    mass: float  # of the forearm, 1 m from the hinge [kg]
    delay: Array  # of each muscle [s], (2,)
    shape: float  # s of the activation a = (1 + s) u / (1 + s u)
    curves: tuple[float, ...]  # MuJoCo's lmin, lmax, vmax, fpmax and fvmax

    @classmethod
    def draw(cls, random: np.random.Generator) -> "Arm":
        """An arm near that of the paper's Table 1."""
        places = np.array([[0.3, -0.2], [-0.8, -0.7]]) * random.normal(1, 0.03, (2, 2))
        bounds = (0.4, 0.6), (1.5, 1.7), (9.0, 11.0), (0.8, 1.6), (1.2, 1.5)
        return cls(
            origins=places[0],
            insertions=places[1],
            mass=random.normal(1, 0.03),
            delay=0.08 + 0.005 * random.standard_normal(2),
            shape=random.uniform(-0.25, 0.0),
            curves=tuple(random.uniform(*each) for each in bounds),
        )

    def moved(self, value: Mapping[str, float], emg: Array, dt: float, start_rad: float) -> Array:
        """See `simulator.Arm.moved`."""
        mujoco: Any = import_module("mujoco")
        model = mujoco.MjModel.from_xml_string(self._written(value))
        samples = np.arange(emg.shape[1]) * dt
        time = np.arange(0.0, samples[-1] + STEP_S / 2, STEP_S)
        seen = np.empty(emg.shape[:2])
        for trial, own in enumerate(emg):
            drive = np.stack([np.interp(time - late, samples, u) for late, u in zip(self.delay, own.T, strict=True)], 1)
            angle = self._angle(mujoco, model, drive, start_rad, value.get("constant_torque.tau", 0.0))
            if lag := value.get("observation_lag.tau"):
                for i in range(1, len(angle)):
                    angle[i] = angle[i - 1] + (angle[i] - angle[i - 1]) * STEP_S / lag
            seen[trial] = np.interp(samples, time, angle)
        return seen

    def _angle(self, mujoco: Any, model: Any, drive: Array, start_rad: float, torque: float) -> Array:
        """Angle at every step [rad], not a number once it is out of reach."""
        activation = (1 + self.shape) * drive / (1 + self.shape * drive)
        data, angle = mujoco.MjData(model), np.full(len(drive), np.nan)
        data.qpos[0], data.qfrc_applied[0] = start_rad, torque
        data.act[:] = activation[0, : model.na]
        for i, excited in enumerate(activation):
            angle[i] = data.qpos[0]
            if not IN_REACH[0] < angle[i] < IN_REACH[1]:
                return np.where(np.arange(len(angle)) < i, angle, np.nan)
            data.ctrl[:] = excited
            mujoco.mj_step(model, data)
        return angle

    def _written(self, value: Mapping[str, float]) -> str:
        """The arm in MuJoCo's words."""
        times = [value.get(f"activation_dynamics.{name}", 0.0) for name in ("rise", "decay")]
        rise, decay = (max(time, AT_ONCE_S) for time in times)
        muscles = [
            MUSCLE.format(
                place=place,
                curves=" ".join(map(str, (*RANGE, force, 1.0, *self.curves))),
                shortest=tendon + RANGE[0] * fibre,
                longest=tendon + RANGE[1] * fibre,
                activation=LAGS.format(rise=rise, decay=decay) if any(times) else "",
            )
            for place, (force, fibre, tendon) in enumerate(zip(Paper.FORCE, Paper.FIBRE, Paper.TENDON, strict=True))
        ]
        lean = value.get("gravity_tilt.phi", 0.0)
        return ARM.format(
            step=STEP_S,
            forward=GRAVITY * np.sin(lean),
            down=-GRAVITY * np.cos(lean),
            origins=self.origins,
            insertions=self.insertions,
            mass=self.mass,
            damping=value.get("joint_damping.c", 0.0),
            friction=value.get("coulomb_friction.tau", 0.0),
            stiffness=value.get("joint_stiffness.k", 0.0),
            rest=REST,
            armature=value.get("forearm_inertia.r", 0.0) * self.mass,
            muscles=muscles,
        )
