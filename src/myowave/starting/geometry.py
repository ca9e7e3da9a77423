"""Muscle paths of a model of OpenSim: a table of lengths, and the settings of an arm that uses it."""

import csv
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch

from myowave.physics.path import read_path
from myowave.settings.physics import read_preset
from myowave.starting.block import shown
from myowave.starting.new import PRESET
from myowave.starting.opensim_model import SampledModel, SampledMuscle, sample_model
from myowave.starting.subject import check_name
from myowave.starting.writing import scalar

TABLE, SETTINGS = "path_lengths.csv", "arm.yaml"
_COLUMNS = ("muscle", "angle_deg", "length_m", "moment_arm_m")
_MOST_APART_M = 1e-3  # of the moment arm of a table and the model's own


def write_geometry(
    model: Path,
    coordinate: str,
    muscles: Sequence[str],
    folder: Path,
    name: str = "mine",
    step_deg: float = 5.0,
    sign: int = 1,
) -> str:
    """Write `path_lengths.csv` and `arm.yaml` for the muscles of a model.

    Args:
        model: a .osim file.
        coordinate: the elbow's angle in it.
        muscles: their names; none for all that move it.
        folder: to write into.
        name: of the arm in the settings.
        step_deg: largest distance of angles [deg].
        sign: -1 where the coordinate falls in flexion.

    Returns:
        What to say on the terminal.

    Raises:
        ValueError: as `sample_model`, and for a name that settings do not take.
    """
    check_name(name, "the arm")
    if not 0 < step_deg <= 45:
        raise ValueError(f"--step is {step_deg:g}; expected above 0, at most 45 deg.")
    if sign not in (1, -1):
        raise ValueError(f"--sign is {sign}; expected 1, or -1 where the coordinate falls in flexion.")
    sampled = sample_model(model, coordinate, muscles, step_deg, sign)
    if len(twice := {setting_name(muscle.name) for muscle in sampled.muscles}) < len(sampled.muscles):
        raise ValueError(f"{model}: names of muscles differ in signs only ({', '.join(sorted(twice))}); rename them.")
    folder.mkdir(parents=True, exist_ok=True)
    table, settings = folder / TABLE, folder / SETTINGS
    _write_table(table, sampled)
    settings.write_text(arm_settings(sampled, table, name, f"{model.name}, coordinate {coordinate}"), encoding="utf-8")
    low, high = sampled.angle_deg[0], sampled.angle_deg[-1]
    lines = [f"{len(sampled.muscles)} muscles at {len(sampled.angle_deg)} angles from {low:.0f} to {high:.0f} deg:"]
    lines += [f"  {m.name}: {_side(m)}, moment arm {_moment_arm(m, table)}" for m in sampled.muscles]
    lines.append(f"Wrote {table} and {settings}. For you, in {settings}: which electrode drives each muscle (emg).")
    lines.append(f"Lay it over the settings: --configfile config.yaml {settings} mine.yaml, with arm: {name} there.")
    return "\n".join(lines)


def arm_settings(sampled: SampledModel, table: Path, name: str, source: str) -> str:
    """A block `physics.arms.NAME` with these muscles on paths from a table."""
    named = [setting_name(muscle.name) for muscle in sampled.muscles]
    preset = [muscle for muscle in read_preset(PRESET)["muscles"] if muscle not in named]
    lines = [
        f"# Muscles of {source}, sampled with OpenSim.",
        "# ASSUME: 0 is the forearm in line with the upper arm, positive in flexion; else sample it with another sign.",
        "# ASSUME: delay and shape are those of Taneja et al. 2023, Table 1; the model has none.",
        "physics:",
        "  arms:",
        f"    {name}:",
        f"      preset: {PRESET} # its forearm and curves; `myowave subject` prints the forearm of a person",
        "      muscles:",
        *(f"        {muscle}: null # of {PRESET}" for muscle in preset),
    ]
    for key, muscle in zip(named, sampled.muscles, strict=True):
        side = _side(muscle)
        keys = [
            f"side: {side}",
            f"emg: {'emg_biceps' if side == 'flexor' else 'emg_triceps'} # FILL IN the electrode that drives it",
            f"group: {side}s",
            *(f"{constant}: {value:.6g}" for constant, value in muscle.constants.items()),
            f"path: {{file: {scalar(shown(table))}, muscle: {key}, margin_deg: 5}}",
            "delay_s: 0.08",
            "shape_A: 0.2",
        ]
        lines += [f"        {key}:", *(f"          {line}" for line in keys)]
    return "\n".join(lines) + "\n"


def setting_name(name: str) -> str:
    """A muscle's name as settings take it: `biceps.r` is `biceps_r`."""
    plain = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    return plain if plain[:1].isalpha() else f"m_{plain}"


def _write_table(path: Path, sampled: SampledModel) -> None:
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(_COLUMNS)
        for muscle in sampled.muscles:
            name = setting_name(muscle.name)
            rows = zip(sampled.angle_deg, muscle.length, muscle.arm, strict=True)
            writer.writerows((name, f"{angle:.8g}", f"{length:.9g}", f"{arm:.7g}") for angle, length, arm in rows)


def _side(muscle: SampledMuscle) -> str:
    return "flexor" if np.mean(muscle.arm) >= 0 else "extensor"


def _moment_arm(muscle: SampledMuscle, table: Path) -> str:
    """Its range, and whether the muscle is on both sides of the joint or the table too coarse for its path."""
    said = f"{1e3 * min(muscle.arm):.1f} to {1e3 * max(muscle.arm):.1f} mm"
    path = read_path(str(table), setting_name(muscle.name))
    angles = torch.linspace(*path.range, len(muscle.arm), dtype=torch.float64)
    _, arm = path.length_and_arm(angles)
    apart = float(np.abs(arm.numpy() - np.array(muscle.arm)).max())
    if min(muscle.arm) * max(muscle.arm) < 0:
        said += " (on both sides of the joint)"
    if apart > _MOST_APART_M:
        said += f"; the table's differs from the model's by up to {1e3 * apart:.1f} mm: sample it more finely (--step)"
    return said
