"""A musculoskeletal model of OpenSim, sampled over one of its coordinates. The only door to the package opensim."""

import math
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from myowave.settings.keys import did_you_mean

INSTALL = "pip install 'myowave[opensim]'"
COLUMNS = ("muscle", "angle_deg", "length_m", "moment_arm_m")
LEAST_ARM_M = 1e-3  # a muscle whose moment arm stays below this does not cross the joint [m]


def sample_model(
    path: Path, coordinate: str, names: Sequence[str], step_deg: float, sign: int = 1
) -> tuple[pd.DataFrame, dict[str, dict[str, float]]]:
    """Sample the muscles of a model over the range of a coordinate; all others stay at their defaults.

    Args:
        coordinate: an angle of the model.
        names: muscles; none for all that move it.
        step_deg: largest distance of angles [deg].
        sign: -1 where the coordinate falls in flexion; the angle is sign * coordinate.

    Returns:
        A row for each muscle and angle, angles rising: the muscle as the model has it, angle_deg, length_m of the
        muscle-tendon unit, and moment_arm_m, positive where it raises the angle. Constants of each muscle as settings
        have them, {f0_N: ...}.

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
    muscles = {name: _one(path, "muscle", in_model, name) for name in names or _names(in_model)}
    moved.setLocked(state, False)
    low, high = sorted((sign * moved.getRangeMin(), sign * moved.getRangeMax()))
    count = max(3, math.ceil(math.degrees(high - low) / step_deg - 1e-9)) + 1
    rows = []
    for angle in np.linspace(low, high, count):
        moved.setValue(state, float(sign * angle))
        model.realizePosition(state)
        for name, muscle in muscles.items():
            arm = sign * muscle.computeMomentArm(state, moved)
            rows.append((name, math.degrees(angle), muscle.getLength(state), arm))
    table = pd.DataFrame(rows, columns=COLUMNS)
    if not names:
        table = table.groupby("muscle").filter(lambda one: one["moment_arm_m"].abs().max() >= LEAST_ARM_M)
    if table.empty:
        raise ValueError(f"{path}: none of its {len(muscles)} muscles moves {coordinate}; name another coordinate.")
    return table, {name: _constants(muscles[name]) for name in table["muscle"].unique()}


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
