"""The catalogue: every effect that ships, and users' own effect files, which are its equals."""

from collections.abc import Iterable
from pathlib import Path

from myowave.physics.effect import Effect
from myowave.physics.effect_files import load_effects
from myowave.physics.effects import (
    activation_dynamics,
    activation_shape,
    angle_offset,
    angle_scale,
    brachialis,
    clock_shift,
    compliant_tendon,
    constant_torque,
    coulomb_friction,
    degroote_curves,
    emg_crosstalk,
    emg_gain,
    emg_offset,
    extra_delay,
    fatigue,
    forearm_inertia,
    gravity_tilt,
    hand_load,
    joint_damping,
    joint_stiffness,
    joint_stops,
    millard_curves,
    moment_arm_offset,
    muscle_damping,
    pennation,
    vmax_change,
)

SHIPPED: tuple[Effect, ...] = (
    joint_damping.EFFECT,
    coulomb_friction.EFFECT,
    joint_stiffness.EFFECT,
    joint_stops.EFFECT,
    gravity_tilt.EFFECT,
    forearm_inertia.EFFECT,
    hand_load.EFFECT,
    brachialis.EFFECT,
    constant_torque.EFFECT,
    muscle_damping.EFFECT,
    activation_dynamics.EFFECT,
    extra_delay.EFFECT,
    activation_shape.EFFECT,
    emg_crosstalk.EFFECT,
    emg_gain.EFFECT,
    emg_offset.EFFECT,
    fatigue.EFFECT,
    compliant_tendon.EFFECT,
    millard_curves.EFFECT,
    degroote_curves.EFFECT,
    vmax_change.EFFECT,
    pennation.EFFECT,
    moment_arm_offset.EFFECT,
    angle_offset.EFFECT,
    angle_scale.EFFECT,
    clock_shift.EFFECT,
)


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
            effects[effect.name] = effect
    return effects
