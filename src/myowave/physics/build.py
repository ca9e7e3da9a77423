"""From the section `physics` of config.yaml to a model."""

from myowave.physics.curves import ACTIVE_LENGTH, FORCE_VELOCITY, PASSIVE, Curves
from myowave.physics.effects import catalogue
from myowave.physics.model import Model, parse_model
from myowave.physics.muscle import EXTENSOR, FLEXOR, Muscle
from myowave.settings import Muscle as MuscleSettings
from myowave.settings import Physics

SIDES = {"flexor": FLEXOR, "extensor": EXTENSOR}


def build_model(name: str, physics: Physics) -> Model:
    """The model that a coordinate such as `base+joint_damping` names, with the muscles and effects of the settings.

    Raises:
        ValueError: for an effect that neither ships nor is in `physics.effect_files`, or a faulty effect file.
    """
    base = Model(
        muscles=tuple(_muscle(name, muscle) for name, muscle in physics.muscles.items()),
        joint={"mass": physics.joint.mass_kg, "length": physics.joint.length_m, "load": 0.0, "tilt": 0.0},
        curves=Curves(
            active_length=ACTIVE_LENGTH[physics.curves.active_length],
            passive=PASSIVE[physics.curves.passive],
            force_velocity=FORCE_VELOCITY[physics.curves.force_velocity],
        ),
    )
    return parse_model(name, base, catalogue(physics.effect_files))


def _muscle(name: str, muscle: MuscleSettings) -> Muscle:
    constants = {
        "f0": muscle.f0_N,
        "l0": muscle.l0_m,
        "vmax": muscle.vmax_m_s,
        "slack": muscle.slack_m,
        "pennation": muscle.pennation_rad,
        "l1": muscle.l1_m,
        "l2": muscle.l2_m,
        "delay": muscle.delay_s,
        "shape": muscle.shape_A,
    }
    return Muscle(name, SIDES[muscle.side], muscle.emg, constants)
