"""What a model may lack in general: terms of the joint's motion and of an activation, and of what a sensor adds."""

from collections.abc import Callable, Mapping

import torch
from torch import Tensor

from myowave.physics.effects.coulomb_friction import grown

# Of angle, velocity and an activation, all of one shape, by how they are written.
OfJoint = Callable[[Tensor, Tensor, Tensor], Tensor]
OF_MOTION: Mapping[str, OfJoint] = {
    "1": lambda q, v, a: torch.ones_like(q),
    "q": lambda q, v, a: q,
    "q^2": lambda q, v, a: q * q,
    "sin(2 q)": lambda q, v, a: torch.sin(2 * q),
    "qdot": lambda q, v, a: v,
    "qdot |qdot|": lambda q, v, a: v * v.abs(),
    "the sign of qdot": lambda q, v, a: grown(v),
    "q qdot": lambda q, v, a: q * v,
}
# The effects that some of these are. Where a catalogue has one, what it lacks has not.
OF_EFFECTS: Mapping[str, str] = {
    "1": "constant_torque",
    "q": "joint_stiffness",
    "qdot": "joint_damping",
    "qdot |qdot|": "quadratic_drag",
    "the sign of qdot": "coulomb_friction",
}
# With an activation in it, by what follows the name of that.
OF_ACTIVATION: Mapping[str, OfJoint] = {
    "": lambda q, v, a: a,
    "^2": lambda q, v, a: a * a,
    " q": lambda q, v, a: a * q,
    " q^2": lambda q, v, a: a * q * q,
    " qdot": lambda q, v, a: a * v,
    " qdot |qdot|": lambda q, v, a: a * v * v.abs(),
    " the sign of qdot": lambda q, v, a: a * grown(v),
}

# What a sensor may add to the angle, by the effects that these are.
OF_SENSOR: Mapping[str, OfJoint] = {
    "angle_offset": OF_MOTION["1"],
    "angle_scale": OF_MOTION["q"],
    "observation_lag": lambda q, v, a: -v,
}
