"""Units in which recorders write, and the ones everything else uses."""

import math

ARBITRARY = "au"  # unit of EMG that is no voltage, which is normalised like any other; and of what has none
PERCENT = "%"  # unit of a fraction that was multiplied by 100; as EMG it counts as arbitrary unless it is a fraction
# Factors of the units that a signal of a kind may be written in.
TO_RADIANS = {"rad": 1.0, "deg": math.pi / 180}
TO_MICROVOLTS = {"uV": 1.0, "mV": 1e3, "V": 1e6, "nV": 1e-3}
TO_EMG = {**TO_MICROVOLTS, ARBITRARY: 1.0, PERCENT: 1.0}
TO_FRACTION = {ARBITRARY: 1.0, PERCENT: 1e-2}
TO_NEWTON_METRES = {"Nm": 1.0, "Ncm": 1e-2, "Nmm": 1e-3}
_OTHERS = ("s", "ms", "g", "G", "N", "kg", "m", "cm", "mm", "Hz", "m/s", "m/s^2", "deg/s", "rad/s")
UNITS = {*TO_EMG, *TO_RADIANS, *TO_NEWTON_METRES, *_OTHERS}  # all that are known, whatever a signal is of
TO_NUMBER = dict.fromkeys((ARBITRARY, *sorted(UNITS)), 1.0)  # as it is written
_SPELLINGS = {
    "uV": ("µV", "μV", "uv", "microvolts", "microvolt"),  # micro sign and Greek mu
    "mV": ("mv", "millivolts", "millivolt"),
    "V": ("v", "volts", "volt"),
    "deg": ("deg", "deg.", "degrees", "degree", "grad", "°"),
    "rad": ("rad", "radians", "radian"),
    "s": ("s", "sec", "seconds", "second"),
    "ms": ("ms", "msec", "milliseconds", "millisecond"),
    "Nm": ("N m", "N*m", "N.m", "N·m", "newton metres", "newton-meters"),
    "Ncm": ("N cm",),
    "Nmm": ("N mm",),
    ARBITRARY: ("a.u.", "-"),
    PERCENT: ("percent", "%mvc", "% mvc"),
    "deg/s": ("°/s",),
    "m/s^2": ("m/s²",),
}
_PLAIN = {spelling: unit for unit, spellings in _SPELLINGS.items() for spelling in spellings}


def plain_unit(unit: str) -> str:
    """The one spelling of a unit that is used here: `Volts`, `µV` and `Deg` are `V`, `uV` and `deg`."""
    unit = unit.strip().strip("[]()")
    return _PLAIN.get(unit, _PLAIN.get(unit.lower(), unit))


def unit_here(unit: str) -> str:
    """What a plain unit is converted to: rad, uV or Nm, and arbitrary ones stay that."""
    return next((next(iter(to)) for to in (TO_RADIANS, TO_MICROVOLTS, TO_NEWTON_METRES) if unit in to), ARBITRARY)
