"""What a network is told beside EMG: the values that a user gives for a whole run, and whether they can be."""

import math
from collections.abc import Mapping, Sequence

from myowave.learning.inputs import constant_behind, unit_of
from myowave.settings.keys import did_you_mean

WIDEST = 2 * math.pi  # rad, of an angle over time


def read_known(option: str, texts: Sequence[str], names: Sequence[str]) -> dict[str, float]:
    """Values that hold for the whole run, by name.

    Args:
        option: what the user calls it, for messages.
        texts: each `name=value`.
        names: what the network is told.

    Raises:
        ValueError: for a name that it is not told, one given twice, or a value that cannot be.
    """
    values: dict[str, float] = {}
    for text in texts:
        name, _, number = text.partition("=")
        name = name.strip()
        if name not in names:
            told = ", ".join(names) or "nothing"
            raise ValueError(
                f"{option} {text!r}: the network takes no {name!r}{did_you_mean(name, names) or '.'} Beside EMG it "
                f"takes {told}."
            )
        if name in values:
            raise ValueError(f"{option}: {name} is given more than once; keep one.")
        try:
            values[name] = float(number)
        except ValueError:
            values[name] = math.nan
        check_known({name: values[name]}, f"{option} {text!r}")
    return values


def check_known(values: Mapping[str, float], where: str) -> None:
    """Raise a ValueError, naming the place, for a value that what it stands for cannot have."""
    for name, value in values.items():
        low, high = _range(name)
        if not low <= value <= high:
            raise ValueError(f"{where}: {name} is {value:g}, expected {low:.4g} to {high:.4g} {unit_of(name)}.")


def _range(name: str) -> tuple[float, float]:
    constant = constant_behind(name)
    if constant is None:
        return -WIDEST, WIDEST
    bounds = constant.bounds
    return bounds.get("ge", bounds.get("gt", -math.inf)), bounds.get("le", bounds.get("lt", math.inf))
