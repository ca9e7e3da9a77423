"""The equation of motion that muscles, joint and effects add up to (Eqs. 5, 54).

    I(q) qddot = sum of muscle torques + gravity + torques of effects

Shapes: ... batch (hypotheses, starts, perturbations), trials, samples or points within a step; T trials, N samples,
M muscles.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from myowave.physics.joint import gravity_torque
from myowave.physics.muscle import fibre_state
from myowave.physics.valued import Valued


@dataclass(frozen=True)
class Torques:
    """What turns the joint [N m], all of the shape of q; `total` is their sum. `inertia` in kg m^2.

    `driving` is the torque of muscles and of a known motor.
    """

    driving: Tensor
    gravity: Tensor
    effects: Tensor
    inertia: Tensor

    @property
    def total(self) -> Tensor:
        return self.driving + self.gravity + self.effects

    @property
    def acceleration(self) -> Tensor:
        """Of the joint [rad/s^2]. Source: Taneja et al. 2023, Eq. 54."""
        return self.total / self.inertia


def muscle_quantities(valued: Valued, q: Tensor, qdot: Tensor, activation: Tensor) -> dict[str, Any]:
    """Path, fibre and force of every muscle at a joint state, before the effects that have a state.

    Args:
        q, qdot: joint angle and velocity [rad, rad/s], (...).
        activation: (..., M).

    Returns:
        The quantities of the stage `muscle` (see `effect`), plus `moment_arm` and `cosine` of the pennation angle.
    """
    c = valued.muscle
    # One muscle after the other in memory: element-wise work then runs along time, several times faster than along M.
    angle = q.expand(len(valued.model.muscles), *q.shape).contiguous().movedim(0, -1)
    length, arm = valued.path.length_and_arm(angle)
    for effect in valued.acting["path"]:
        length, arm = effect({**c, "q": angle, "length_mt": length, "moment_arm": arm})
    velocity = -arm * qdot.unsqueeze(-1)
    fibre_length, fibre_velocity, cosine = fibre_state(
        length, velocity, l0=c["l0"], vmax=c["vmax"], slack=c["slack"], height=valued.height
    )
    known = {**c, "curves": valued.curves}

    def forces(a: Tensor, length: Tensor, velocity: Tensor) -> tuple[Tensor, Tensor]:
        """Of fibres, as the curves have it and behind the effects without a state."""
        base = force = valued.curves.force(a, length, velocity)
        fibre = {"base_force": base, "activation": a, "fibre_length": length, "fibre_velocity": velocity}
        for effect in valued.acting["fibre"]:
            force = effect({**known, **fibre, "force": force})
        return base, force

    base, force = forces(activation, fibre_length, fibre_velocity)
    return {
        **known,
        "activation": activation,
        "fibre_length": fibre_length,
        "fibre_velocity": fibre_velocity,
        "hill": lambda a, length, velocity: forces(a, length, velocity)[1],
        "base_force": base,
        "force": force,
        "moment_arm": arm,
        "cosine": cosine,
    }


def torques(valued: Valued, q: Tensor, qdot: Tensor, activation: Tensor, states: Mapping[str, Tensor]) -> Torques:
    """All torques about the elbow at a state.

    Args:
        q, qdot: [rad, rad/s], (...).
        activation: (..., M).
        states: of the effects on the stage `muscle` that have one, by effect name, (..., M).

    Source: Taneja et al. 2023, Eqs. 54-59.
    """
    return torques_with(valued, q, qdot, muscle_quantities(valued, q, qdot, activation), states)


def torques_with(
    valued: Valued, q: Tensor, qdot: Tensor, muscles: Mapping[str, Any], states: Mapping[str, Tensor]
) -> Torques:
    """The same where the quantities of the muscles at this state are known."""
    force = muscles["force"]
    for tendon in valued.acting["tendon"]:
        force = tendon({**muscles, "force": force, "state": states[tendon.effect.name]})
    pull = valued.muscle["f0"] * force * muscles["cosine"]
    joint = valued.joint
    # ASSUME: a motor's current follows its voltage at once (no inductance), so its torque falls with speed.
    motor = joint["drive"] * (joint["motor"] - joint["braking"] * qdot)
    driving = (pull * muscles["moment_arm"]).sum(-1) + motor
    gravity = gravity_torque(q, joint["weight"], joint["tilt"])
    extra = torch.zeros_like(driving)
    state = {"q": q, "qdot": qdot, "activation": muscles["activation"], "torque": driving, "gravity": gravity}
    for effect in valued.acting["joint"]:
        extra = extra + effect({**valued.muscle, **joint, **state, "curves": valued.joint_curves})
    return Torques(driving, gravity, extra, moment_of_inertia(valued, q))


def moment_of_inertia(valued: Valued, q: Tensor) -> Tensor:
    """Moment of inertia about the elbow at an angle (...) [rad], with effects that act on it, broadcastable to (...)
    [kg m^2].

    Source: Taneja et al. 2023, Eq. 55.
    """
    inertia = valued.inertia
    for effect in valued.acting["inertia"]:
        inertia = inertia + effect({**valued.joint, "q": q})
    return inertia
