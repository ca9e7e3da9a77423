"""From settings to a model: the only place that knows both an arm's settings and the physics they name."""

from dataclasses import replace

import torch

from myowave.physics.constants import JOINT_CONSTANTS, MUSCLE_CONSTANTS, names_of
from myowave.physics.curves import ACTIVE_LENGTH, FORCE_VELOCITY, PASSIVE, THELEN, Curves
from myowave.physics.effects import catalogue
from myowave.physics.model import Model, parse_model
from myowave.physics.muscle import EXTENSOR, FLEXOR, Muscle
from myowave.physics.path import Path, StraightPath, read_path
from myowave.settings import Joint as JointSettings
from myowave.settings import Muscle as MuscleSettings
from myowave.settings import Physics
from myowave.settings import StraightPath as StraightPathSettings

SIDES = {"flexor": FLEXOR, "extensor": EXTENSOR}


def build_model(name: str, physics: Physics) -> Model:
    """The model that a coordinate such as `base+joint_damping` names, with the muscles and effects of the settings.

    Raises:
        ValueError: for an effect that neither ships nor is in `physics.effect_files`, one that cannot act on the
            muscles' paths, a faulty effect file, or a faulty table of a path.
    """
    base = Model(
        muscles=tuple(_muscle(name, muscle) for name, muscle in physics.muscles.items()),
        joint=_joint(physics.joint),
        curves=Curves(
            active_length=ACTIVE_LENGTH[physics.curves.active_length],
            passive=PASSIVE[physics.curves.passive],
            force_velocity=FORCE_VELOCITY[physics.curves.force_velocity],
            slowing=THELEN.slowing if physics.curves.force_velocity == "thelen" else 0.0,
        ),
    )
    return parse_model(name, base, catalogue(physics.effect_files))


def _joint(joint: JointSettings) -> dict[str, float]:
    constants = {name: JOINT_CONSTANTS[name] for name in names_of(JOINT_CONSTANTS, "", joint.kind)}
    return {name: float(getattr(joint, c.key) if c.key else c.default or 0.0) for name, c in constants.items()}


def _muscle(name: str, muscle: MuscleSettings) -> Muscle:
    constants = {c: getattr(muscle, MUSCLE_CONSTANTS[c].key) for c in names_of(MUSCLE_CONSTANTS, "")}
    return Muscle(name, SIDES[muscle.side], muscle.emg, constants, _path(name, muscle), muscle.group or "")


def _path(name: str, muscle: MuscleSettings) -> Path:
    settings = muscle.geometry
    if isinstance(settings, StraightPathSettings):
        return StraightPath(settings.l1_m, settings.l2_m, SIDES[muscle.side])
    path = replace(read_path(settings.file, settings.muscle), scale=settings.scale)
    expected = "shorter" if muscle.side == "flexor" else "longer"
    first, last = (path.length_and_arm(torch.tensor(angle))[0].item() for angle in path.range)
    if SIDES[muscle.side] * (first - last) <= 0:
        raise ValueError(
            f"muscle {name}: with flexion, the length in {settings.file} goes from {first:.4g} to {last:.4g} "
            f"m, but a {muscle.side} gets {expected}. Angles are 0 with the arm straight, positive in flexion; correct "
            "them, or the side."
        )
    return path
