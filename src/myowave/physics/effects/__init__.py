"""The catalogue: every effect that ships, and users' own effect files, which are its equals."""

import importlib.util
from collections.abc import Iterable, Mapping
from pathlib import Path

from myowave.physics.effect import Effect
from myowave.physics.effects import joint_damping

SHIPPED: tuple[Effect, ...] = (
    joint_damping.EFFECT,
)


def catalogue(effect_files: Iterable[str | Path] = ()) -> Mapping[str, Effect]:
    """All effects by name: those that ship, then those in users' files."""
    return {effect.name: effect for effect in SHIPPED}
