"""From settings to a model: the only place that knows both an arm's settings and the physics they name."""

from dataclasses import replace

import torch

from myowave.physics.constants import JOINT_CONSTANTS, MUSCLE_CONSTANTS, values_of
from myowave.physics.curves import FAMILIES
from myowave.physics.effects import catalogue
from myowave.physics.model import Model, parse_model
from myowave.physics.muscle import EXTENSOR, FLEXOR, Muscle
from myowave.physics.path import Path, StraightPath, read_path
from myowave.settings import MuscleSettings, Physics

SIDES = {"flexor": FLEXOR, "extensor": EXTENSOR}


def build_model(name: str, physics: Physics) -> Model:
    """The model that a coordinate such as `base+joint_damping` names, with the muscles and effects of the settings. A
    ValueError for an effect that neither ships nor is in `physics.effect_files`, one that cannot act on the muscles'
    paths, a faulty effect file, or a faulty table of a path."""
    curves = physics.curves
    length, passive = FAMILIES[curves.active_length].active_length, FAMILIES[curves.passive].passive
    base = Model(
        muscles=tuple(
            Muscle(n, SIDES[m.side], m.emg, values_of(MUSCLE_CONSTANTS, m, ""), _path(n, m), m.group or "")
            for n, m in physics.muscles.items()
        ),
        joint=values_of(JOINT_CONSTANTS, physics.joint, "", physics.joint.kind),
        curves=replace(FAMILIES[curves.force_velocity], active_length=length, passive=passive),  # with its slowing
    )
    return parse_model(name, base, catalogue(physics.effect_files))


def _path(name: str, muscle: MuscleSettings) -> Path:
    side, table = SIDES[muscle.side], muscle.path
    if table is None:
        assert muscle.l1_m is not None and muscle.l2_m is not None
        return StraightPath(muscle.l1_m, muscle.l2_m, side)
    path = read_path(table.file, table.muscle)
    first, last = (path.length_and_arm(torch.tensor(angle))[0].item() for angle in path.range)
    if side * (first - last) <= 0:
        expected = "shorter" if muscle.side == "flexor" else "longer"
        raise ValueError(
            f"muscle {name}: with flexion, the length in {table.file} goes from {first:.4g} to {last:.4g} "
            f"m, but a {muscle.side} gets {expected}. Angles are 0 with the arm straight, positive in flexion; correct "
            "them, or the side."
        )
    return path
