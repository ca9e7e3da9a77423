"""The catalogue: every effect that ships, and users' own effect files, which are its equals."""

import importlib
from collections.abc import Iterable
from pathlib import Path

from myowave.physics.effect import Effect
from myowave.physics.effect_files import load_effects

# Each is the `EFFECT` of the file of its name; in this order they are tried and listed.
NAMES = (
    "joint_damping",
    "coulomb_friction",
    "stribeck_friction",
    "quadratic_drag",
    "load_friction",
    "joint_stiffness",
    "joint_stops",
    "gravity_tilt",
    "forearm_inertia",
    "hand_load",
    "brachialis",
    "constant_torque",
    "muscle_damping",
    "activation_dynamics",
    "extra_delay",
    "activation_shape",
    "emg_crosstalk",
    "co_contraction",
    "emg_gain",
    "emg_offset",
    "fatigue",
    "compliant_tendon",
    "millard_curves",
    "degroote_curves",
    "thelen_curves",
    "vmax_change",
    "pennation",
    "moment_arm_offset",
    "angle_offset",
    "angle_scale",
    "clock_shift",
    "clock_drift",
    "observation_lag",
    "elastic_mount",
)
SHIPPED: tuple[Effect, ...] = tuple(importlib.import_module(f"{__name__}.{name}").EFFECT for name in NAMES)


def catalogue(effect_files: Iterable[str | Path] = ()) -> dict[str, Effect]:
    """All effects by name: those that ship, then those in users' files.

    Raises:
        ValueError: for a faulty effect file; the message says which, what was found and what to do.
    """
    effects = {effect.name: effect for effect in SHIPPED}
    for path in effect_files:
        for effect in load_effects(path):
            if effect.name in effects:
                raise ValueError(
                    f"{path}: the effect name {effect.name!r} is taken by another effect; give yours a name of its own"
                )
            if alike := [other.name for other in effects.values() if other.title == effect.title]:
                raise ValueError(
                    f"{path}: {effect.name!r} has the title of {alike[0]}, {effect.title!r}; give it words of its own, "
                    "as pages call it by them"
                )
            effects[effect.name] = effect
    return effects
