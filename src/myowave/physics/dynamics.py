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

from myowave.physics import muscle as muscle_physics
from myowave.physics.joint import gravity_torque
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


def muscle_quantities(valued: Valued, q: Tensor, qdot: Tensor, activation: Tensor) -> dict[str, Any]:
    """Path, fibre and force of every muscle at a joint state, before the effects that have a state.

    Args:
        q, qdot: joint angle and velocity [rad, rad/s], (...).
        activation: (..., M).

    Returns:
        The quantities of the stage `muscle` (see `effect`), plus `moment_arm` and `cosine` of the pennation angle.
    """
    c, combined = valued.muscle, valued.combined
    # One muscle after the other in memory: element-wise work then runs along time, several times faster than along M.
    angle = q.expand(len(valued.model.muscles), *q.shape).contiguous().movedim(0, -1)
    length, arm = combined.path.length_and_arm(angle)
    for effect in valued.acting["path"]:
        length, arm = effect({**c, "q": angle, "length_mt": length, "moment_arm": arm})
    velocity = -arm * qdot.unsqueeze(-1)
    fibre_length, fibre_velocity, cosine = muscle_physics.fibre_state(
        length, velocity, l0=c["l0"], vmax=c["vmax"], slack=c["slack"], height=combined.height
    )

    def hill(a: Tensor, length: Tensor, velocity: Tensor) -> Tensor:
        force = muscle_physics.hill_force(valued.curves, a, length, velocity)
        for effect in valued.acting["fibre"]:
            fibre = {"activation": a, "fibre_length": length, "fibre_velocity": velocity, "force": force}
            force = effect({**c, **fibre, "curves": valued.curves})
        return force

    return {
        **c,
        "activation": activation,
        "fibre_length": fibre_length,
        "fibre_velocity": fibre_velocity,
        "curves": valued.curves,
        "hill": hill,
        "force": hill(activation, fibre_length, fibre_velocity),
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
    muscles = muscle_quantities(valued, q, qdot, activation)
    force = muscles["force"]
    for tendon in valued.acting["tendon"]:
        force = tendon({**muscles, "force": force, "state": states[tendon.effect.name]})
    pull = valued.muscle["f0"] * force * muscles["cosine"]
    driving = (pull * muscles["moment_arm"]).sum(-1)
    if valued.combined.motor is not None:
        driving = driving + valued.combined.motor
    if valued.combined.braking is not None:
        # ASSUME: a motor's current follows its voltage at once (no inductance), so its torque falls with speed.
        driving = driving - valued.combined.braking * qdot
    gravity = gravity_torque(q, valued.combined.weight, valued.combined.tilt)
    extra = torch.zeros_like(driving)
    for effect in valued.acting["joint"]:
        quantities = {
            **valued.muscle,
            **valued.forearm,
            "curves": valued.curves_of_joint,
            "q": q,
            "qdot": qdot,
            "activation": activation,
            "torque": driving,
            "gravity": gravity,
        }
        extra = extra + effect(quantities)
    return Torques(driving, gravity, extra, moment_of_inertia(valued, q))


def moment_of_inertia(valued: Valued, q: Tensor) -> Tensor:
    """Moment of inertia about the elbow at an angle (...) [rad], with effects that act on it, broadcastable to (...)
    [kg m^2].

    Source: Taneja et al. 2023, Eq. 55.
    """
    inertia = valued.combined.inertia
    for effect in valued.acting["inertia"]:
        inertia = inertia + effect({**valued.forearm, "q": q})
    return inertia


def acceleration(valued: Valued, q: Tensor, qdot: Tensor, activation: Tensor, states: Mapping[str, Tensor]) -> Tensor:
    """Angular acceleration [rad/s^2]; arguments as for `torques`. Source: Taneja et al. 2023, Eq. 54."""
    result = torques(valued, q, qdot, activation, states)
    return result.total / result.inertia
