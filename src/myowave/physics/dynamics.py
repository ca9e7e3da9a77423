"""The equation of motion that muscles, joint and effects add up to (Eqs. 5, 54), and what a sensor sees of it.

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
from myowave.physics.effect import call
from myowave.physics.joint import gravity_torque
from myowave.physics.valued import Valued


@dataclass(frozen=True)
class Torques:
    """What turns the joint [N m], all of the shape of q; `total` is their sum. `inertia` in kg m^2."""

    muscles: Tensor
    gravity: Tensor
    effects: Tensor
    inertia: Tensor

    @property
    def total(self) -> Tensor:
        return self.muscles + self.gravity + self.effects


def muscle_quantities(valued: Valued, q: Tensor, qdot: Tensor, activation: Tensor) -> dict[str, Any]:
    """Path, fibre and force of every muscle at a joint state, before the effects that have a state.

    Args:
        q, qdot: joint angle and velocity [rad, rad/s], (...).
        activation: (..., M).

    Returns:
        The quantities of the stage `muscle` (see `effect`), plus `moment_arm` and `cosine` of the pennation angle.
    """
    model, c, combined = valued.model, valued.muscle, valued.combined
    # One muscle after the other in memory: element-wise work then runs along time, several times faster than along M.
    angle = q.expand(len(model.muscles), *q.shape).contiguous().movedim(0, -1)
    length, arm = combined.path.length_and_arm(angle)
    for effect in model.on("path"):
        quantities = {**c, "q": angle, "length_mt": length, "moment_arm": arm}
        length, arm = call(effect.function, quantities, valued.values(effect))
    velocity = -arm * qdot.unsqueeze(-1)
    fibre_length, fibre_velocity, cosine = muscle_physics.fibre_state(
        length, velocity, l0=c["l0"], vmax=c["vmax"], slack=c["slack"], height=combined.height
    )

    def hill(a: Tensor, length: Tensor, velocity: Tensor) -> Tensor:
        force = muscle_physics.hill_force(valued.curves, a, length, velocity)
        for effect in model.fibre_effects:
            fibre = {"activation": a, "fibre_length": length, "fibre_velocity": velocity, "force": force}
            force = call(effect.function, {**c, **fibre, "curves": valued.curves}, valued.values(effect))
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
    model = valued.model
    muscles = muscle_quantities(valued, q, qdot, activation)
    force = muscles["force"]
    for effect in model.tendon_effects:
        quantities = {**muscles, "force": force, "state": states[effect.name]}
        force = call(effect.function, quantities, valued.values(effect))
    pull = valued.muscle["f0"] * force * muscles["cosine"]
    muscle_torque = (pull * muscles["moment_arm"]).sum(-1)
    gravity = gravity_torque(q, valued.combined.weight, valued.combined.tilt)
    extra = torch.zeros_like(muscle_torque)
    for effect in model.on("joint"):
        quantities = {
            **valued.muscle,
            **valued.forearm,
            "curves": valued.curves_of_joint,
            "q": q,
            "qdot": qdot,
            "activation": activation,
            "torque": muscle_torque,
        }
        extra = extra + call(effect.function, quantities, valued.values(effect))
    return Torques(muscle_torque, gravity, extra, moment_of_inertia(valued, q))


def moment_of_inertia(valued: Valued, q: Tensor) -> Tensor:
    """Moment of inertia about the elbow at an angle (...) [rad], with effects that act on it, broadcastable to (...)
    [kg m^2].

    Source: Taneja et al. 2023, Eq. 55.
    """
    inertia = valued.combined.inertia
    for effect in valued.model.on("inertia"):
        inertia = inertia + call(effect.function, {**valued.forearm, "q": q}, valued.values(effect))
    return inertia


def acceleration(valued: Valued, q: Tensor, qdot: Tensor, activation: Tensor, states: Mapping[str, Tensor]) -> Tensor:
    """Angular acceleration [rad/s^2]; arguments as for `torques`. Source: Taneja et al. 2023, Eq. 54."""
    result = torques(valued, q, qdot, activation, states)
    return result.total / result.inertia


def observe(valued: Valued, q: Tensor, qdot: Tensor, dt: float) -> Tensor:
    """The angle that a sensor reports [rad] for a motion (..., T, N), through the effects on `observation`."""
    assert valued.axes == 1
    for effect in valued.model.on("observation"):
        q = call(effect.function, {"q": q, "qdot": qdot, "dt": dt}, valued.values(effect))
    return q
