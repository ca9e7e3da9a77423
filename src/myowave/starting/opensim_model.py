"""A musculoskeletal model of OpenSim, sampled over one of its coordinates. The only door to the package opensim."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from myowave.settings.keys import did_you_mean

INSTALL = "pip install 'myowave[opensim]'"
LEAST_ARM_M = 1e-3
"""A muscle whose moment arm stays below this does not cross the joint [m]."""


@dataclass(frozen=True)
class SampledMuscle:
    """A muscle along a coordinate.

    Args:
        name: as the model has it.
        constants: of the muscle, as settings have them, {f0_N: ...}.
        length: of the muscle-tendon unit [m], (N,).
        arm: moment arm [m], positive where it raises the angle, (N,).
    """

    name: str
    constants: Mapping[str, float]
    length: tuple[float, ...]
    arm: tuple[float, ...]


@dataclass(frozen=True)
class SampledModel:
    """Muscles at rising angles [deg], (N,)."""

    angle_deg: tuple[float, ...]
    muscles: tuple[SampledMuscle, ...]


def sample_model(path: Path, coordinate: str, names: Sequence[str], step_deg: float, sign: int = 1) -> SampledModel:
    """Sample the muscles of a model over the range of a coordinate; all others stay at their defaults.

    Args:
        path: the model, a .osim file.
        coordinate: an angle of the model.
        names: muscles; none for all that move it.
        step_deg: largest distance of angles [deg].
        sign: -1 where the coordinate falls in flexion; the angle is sign * coordinate.

    Raises:
        ValueError: if the package opensim is missing, the file is no model, or a name is none in it.
    """
    opensim = _opensim(path)
    if not path.is_file():
        raise ValueError(f"{path}: no such file; expected a model of OpenSim, .osim.")
    try:
        model = opensim.Model(str(path))
        state = model.initSystem()
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[0]
        raise ValueError(
            f"{path}: OpenSim cannot read it as a model ({reason}). Open it in OpenSim to see why."
        ) from None
    moved = _one(path, "coordinate", model.getCoordinateSet(), coordinate)
    if moved.getMotionType() != opensim.Coordinate.Rotational:
        raise ValueError(f"{path}: coordinate {coordinate} is no angle; expected one that turns, in rad.")
    in_model = model.getMuscles()
    chosen = [_one(path, "muscle", in_model, name) for name in names or _names(in_model)]
    moved.setLocked(state, False)
    ends = sorted((sign * moved.getRangeMin(), sign * moved.getRangeMax()))
    count = max(3, math.ceil(math.degrees(ends[1] - ends[0]) / step_deg - 1e-9)) + 1
    angles = np.linspace(ends[0], ends[1], count)
    length, arm = np.zeros((2, len(chosen), count))
    for n, angle in enumerate(angles):
        moved.setValue(state, float(sign * angle))
        model.realizePosition(state)
        for m, muscle in enumerate(chosen):
            length[m, n] = muscle.getLength(state)
            arm[m, n] = sign * muscle.computeMomentArm(state, moved)
    crossing = [m for m in range(len(chosen)) if names or np.abs(arm[m]).max() >= LEAST_ARM_M]
    if not crossing:
        raise ValueError(f"{path}: none of its {len(chosen)} muscles moves {coordinate}; name another coordinate.")
    sampled = [
        SampledMuscle(chosen[m].getName(), _constants(chosen[m]), tuple(length[m].tolist()), tuple(arm[m].tolist()))
        for m in crossing
    ]
    return SampledModel(tuple(np.degrees(angles).tolist()), tuple(sampled))


def _opensim(path: Path) -> Any:
    try:
        opensim = import_module("opensim")
    except ImportError:
        raise ValueError(f"{path}: models of OpenSim need the package opensim: {INSTALL}.") from None
    opensim.Logger.removeFileSink()  # else it leaves a file opensim.log here
    opensim.Logger.setLevelString("Error")
    return opensim


def _names(members: Any) -> list[str]:
    return [members.get(n).getName() for n in range(members.getSize())]


def _one(path: Path, kind: str, members: Any, name: str) -> Any:
    known = _names(members)
    if name not in known:
        hint = did_you_mean(name, known) or "."
        raise ValueError(f"{path}: there is no {kind} {name!r}{hint} It has {', '.join(known) or 'none'}.")
    return members.get(known.index(name))


def _constants(muscle: Any) -> dict[str, float]:
    return {
        "f0_N": muscle.getMaxIsometricForce(),
        "l0_m": muscle.getOptimalFiberLength(),
        "vmax_m_s": muscle.getMaxContractionVelocity() * muscle.getOptimalFiberLength(),
        "slack_m": muscle.getTendonSlackLength(),
        "pennation_rad": muscle.getPennationAngleAtOptimalFiberLength(),
    }
