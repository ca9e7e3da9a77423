"""Units in which recorders write, and the ones everything else uses."""

import math

import numpy as np
from numpy.typing import NDArray

TO_RADIANS = {"rad": 1.0, "deg": math.pi / 180}
"""Factor of each unit of angle."""
TO_MICROVOLTS = {"uV": 1.0, "mV": 1e3, "V": 1e6, "nV": 1e-3}
"""Factor of each unit of EMG."""
TO_NEWTON_METRES = {"Nm": 1.0, "Ncm": 1e-2, "Nmm": 1e-3}
"""Factor of each unit of torque."""
ARBITRARY = "au"
"""Unit of EMG that is no voltage; it is normalised like any other."""
PERCENT = "%"
"""Unit of a fraction that was multiplied by 100; as EMG it counts as arbitrary unless it is a fraction."""
_SPELLINGS = {
    "uV": ("µV", "μV", "microvolts"),  # micro sign and Greek mu
    "mV": ("millivolts",),
    "V": ("volts", "volt"),
    "deg": ("degrees", "degree", "°"),
    "rad": ("radians", "radian"),
    "Nm": ("N m", "N*m", "N.m", "N·m", "newton metres", "newton-meters"),
    "Ncm": ("N cm",),
    "Nmm": ("N mm",),
    ARBITRARY: ("a.u.", "-"),
}
_PLAIN = {spelling: unit for unit, spellings in _SPELLINGS.items() for spelling in spellings}


def plain_unit(unit: str) -> str:
    """The one spelling of a unit that is used here: `Volts` and `µV` are `V` and `uV`."""
    unit = unit.strip().strip("[]()")
    return _PLAIN.get(unit, _PLAIN.get(unit.lower(), unit))


def to_radians(angle: NDArray[np.float64], unit: str) -> NDArray[np.float64]:
    """An angle [rad]; `unit` is one of `TO_RADIANS`."""
    return angle * TO_RADIANS[unit]


def to_microvolts(emg: NDArray[np.float64], unit: str) -> NDArray[np.float64]:
    """EMG [uV], or as it is where the unit is arbitrary."""
    return emg if unit in (ARBITRARY, PERCENT) else emg * TO_MICROVOLTS[unit]
