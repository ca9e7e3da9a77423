"""Muscle paths of a model of OpenSim: a table of lengths, and the settings of an arm that uses it.

The only door to the package opensim.
"""

import math
import re
import shlex
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch

from myowave.data.json_files import replacing
from myowave.physics.path import read_path
from myowave.settings.keys import did_you_mean
from myowave.settings.physics import read_preset
from myowave.starting.block import flow, shown
from myowave.starting.subject import PRESET, check_name

TABLE, SETTINGS = "path_lengths.csv", "arm.yaml"
_MOST_APART_M = 1e-3  # of the moment arm of a table and the model's own
LEAST_ARM_M = 1e-3  # a muscle whose moment arm stays below this does not cross the joint [m]


def write_geometry(
    model: Path, coordinate: str, muscles: Sequence[str], folder: Path, name: str, step_deg: float, sign: int
) -> str:
    """Write `path_lengths.csv` and `arm.yaml`, whose arm is called `name`, and return what to say on the terminal. A
    ValueError as `sample_model`, which has the other arguments; for a name that settings do not take; and for an
    `arm.yaml` that is there."""
    check_name(name, "the arm")
    if not 0 < step_deg <= 45:
        raise ValueError(f"--step is {step_deg:g}; expected above 0, at most 45 deg.")
    if sign not in (1, -1):
        raise ValueError(f"--sign is {sign}; expected 1, or -1 where the coordinate falls in flexion.")
    table, settings = folder / TABLE, folder / SETTINGS
    if settings.exists():
        raise ValueError(f"{settings} is there already, and somebody may have filled it in; name another --output.")
    paths, constants = sample_model(model, coordinate, muscles, step_deg, sign)
    named = {muscle: setting_name(muscle) for muscle in constants}
    if len(twice := set(named.values())) < len(named):
        raise ValueError(f"{model}: names of muscles differ in signs only ({', '.join(sorted(twice))}); rename them.")
    paths["muscle"] = paths["muscle"].map(named)
    with replacing(table) as temporary:
        paths.to_csv(temporary, index=False, float_format="%.9g")
    of_muscle = dict(list(paths.groupby("muscle", sort=False)))
    sides = {muscle: "flexor" if of_muscle[muscle]["moment_arm_m"].mean() >= 0 else "extensor" for muscle in of_muscle}
    arm = arm_settings({named[muscle]: values for muscle, values in constants.items()}, sides, table, name)
    with replacing(settings) as temporary:
        source = f"{model.name}, coordinate {coordinate}"
        temporary.write_text(f"# Muscles of {source}, sampled with OpenSim.\n{arm}", encoding="utf-8")
    angles, laid = paths["angle_deg"], shlex.join(["config.yaml", str(settings), "mine.yaml"])
    return "\n".join(
        [
            f"{len(sides)} muscles at {angles.nunique()} angles from {angles.min():.0f} to {angles.max():.0f} deg:",
            *(f"  {one}: {side}, moment arm {_moment_arm(of_muscle[one], table)}" for one, side in sides.items()),
            f"Wrote {table} and {settings}. For you, in {settings}: which electrode drives each muscle (emg).",
            f"Lay it over the settings: --configfile {laid}, with arm: {name} there.",
        ]
    )


def sample_model(
    path: Path, coordinate: str, names: Sequence[str], step_deg: float, sign: int
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
    try:
        opensim = import_module("opensim")
    except ImportError:
        raise ValueError(f"{path}: models need the package opensim: pip install 'myowave[opensim]'.") from None
    opensim.Logger.removeFileSink()  # else it leaves a file opensim.log here
    opensim.Logger.setLevelString("Error")
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
    table = pd.DataFrame(rows, columns=["muscle", "angle_deg", "length_m", "moment_arm_m"])
    if not names:
        table = table.groupby("muscle").filter(lambda one: one["moment_arm_m"].abs().max() >= LEAST_ARM_M)
    if table.empty:
        raise ValueError(f"{path}: none of its {len(muscles)} muscles moves {coordinate}; name another coordinate.")
    return table, {name: _constants(muscles[name]) for name in table["muscle"].unique()}


def arm_settings(constants: Mapping[str, Mapping[str, float]], sides: Mapping[str, str], table: Path, name: str) -> str:
    """A block `physics.arms.NAME` with muscles of these constants, on paths from a table."""
    lines = [
        "# ASSUME: 0 is the forearm in line with the upper arm, positive in flexion; else sample it with another sign.",
        "# ASSUME: delay and shape are those of Taneja et al. 2023, Table 1; the model has none.",
        "physics:",
        "  arms:",
        f"    {name}:",
        f"      preset: {PRESET} # its forearm and curves; `myowave subject` prints the forearm of a person",
        "      muscles:",
        *(f"        {muscle}: null # of {PRESET}" for muscle in read_preset(PRESET)["muscles"] if muscle not in sides),
    ]
    for muscle, side in sides.items():
        keys = [
            f"side: {side}",
            f"emg: {'emg_biceps' if side == 'flexor' else 'emg_triceps'} # FILL IN the electrode that drives it",
            f"group: {side}s",
            *(f"{constant}: {value:.6g}" for constant, value in constants[muscle].items()),
            f"path: {flow({'file': shown(table), 'muscle': muscle, 'margin_deg': 5})}",
            "delay_s: 0.08",
            "shape_A: 0.2",
        ]
        lines += [f"        {muscle}:", *(f"          {line}" for line in keys)]
    return "\n".join(lines) + "\n"


def setting_name(name: str) -> str:
    """A muscle's name as settings take it: `biceps.r` is `biceps_r`."""
    plain = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    return plain if plain[:1].isalpha() else f"m_{plain}"


def _moment_arm(muscle: pd.DataFrame, table: Path) -> str:
    """Its range, and whether the muscle is on both sides of the joint or the table too coarse for its path."""
    arm = muscle["moment_arm_m"].to_numpy()
    said = f"{1e3 * arm.min():.1f} to {1e3 * arm.max():.1f} mm"
    path = read_path(str(table), muscle["muscle"].iloc[0])
    tabled = path.length_and_arm(torch.linspace(*path.range, len(arm), dtype=torch.float64))[1].numpy()
    if arm.min() * arm.max() < 0:
        said += " (on both sides of the joint)"
    if (apart := np.abs(tabled - arm).max()) > _MOST_APART_M:
        said += f"; the table's differs from the model's by up to {1e3 * apart:.1f} mm: sample it more finely (--step)"
    return said


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
