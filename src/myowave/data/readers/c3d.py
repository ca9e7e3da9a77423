"""C3D, the format of motion capture: analog channels, and points such as joint angles. Needs the package ezc3d."""

import struct
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from myowave.data.readers.signals import RawRecording, Signal, cut_short


def read_c3d(path: Path) -> RawRecording:
    """Read one file. Analog channels keep their names; coordinates of a point are `LElbowAngles.x`, `.y` and `.z`."""
    try:
        ezc3d = import_module("ezc3d")
    except ModuleNotFoundError:
        raise ValueError(f"{path}: C3D files need the package ezc3d: pip install 'myowave[c3d]'.") from None
    try:
        content = ezc3d.c3d(str(path))
    except OSError as error:
        raise ValueError(f"{path}: this is not a C3D file ({error}). Export it again.") from None
    parameters, data = content["parameters"], content["data"]
    frames, stated = data["points"].shape[-1], _frames_stated(path.read_bytes())
    if frames < stated:
        raise cut_short(path, f"{frames} frames", stated)
    return RawRecording(path, (*_analog(parameters, data["analogs"]), *_points(parameters, data["points"])))


def _frames_stated(content: bytes) -> int:
    """Frames by the header, of which ezc3d keeps no more than it could read."""
    machine = content[512 * (content[0] - 1) + 3]  # fourth byte of the parameters; 86 where the high byte comes first
    first, last = struct.unpack_from(">2H" if machine == 86 else "<2H", content, 6)
    return last - first + 1


def _analog(parameters: Mapping[str, Any], values: np.ndarray) -> Iterator[Signal]:
    """Analog channels; `values` is (1, channels, samples)."""
    names, units = _texts(parameters, "ANALOG", "LABELS"), _texts(parameters, "ANALOG", "UNITS")
    rate = _rate(parameters, "ANALOG")
    for n, name in enumerate(names[: values.shape[1]]):
        yield Signal.of(name, values[0, n], unit=units[n] if n < len(units) else "", rate=rate)


def _points(parameters: Mapping[str, Any], values: np.ndarray) -> Iterator[Signal]:
    """Coordinates of points; `values` is (4, points, frames). Points that are angles have a unit of their own."""
    angles = _texts(parameters, "POINT", "ANGLES")
    units = {True: _texts(parameters, "POINT", "ANGLE_UNITS"), False: _texts(parameters, "POINT", "UNITS")}
    for n, name in enumerate(_texts(parameters, "POINT", "LABELS")[: values.shape[1]]):
        unit = next(iter(units[name in angles]), "deg" if name in angles else "")
        for axis, letter in enumerate("xyz"):
            yield Signal.of(f"{name}.{letter}", values[axis, n], unit=unit, rate=_rate(parameters, "POINT"))


def _texts(parameters: Mapping[str, Any], group: str, name: str) -> list[str]:
    return [text.strip() for text in parameters[group].get(name, {}).get("value", [])]


def _rate(parameters: Mapping[str, Any], group: str) -> float:
    return float(parameters[group]["RATE"]["value"][0])
