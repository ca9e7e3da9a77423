"""Samples of EMG from lines of CSV, each read and checked as it comes; and values of known inputs for a whole run."""

import csv
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from myowave.data.trials import ANGLES
from myowave.learning.inputs import constant_behind, unit_of
from myowave.settings.keys import did_you_mean

RATE_TOLERANCE = 0.01  # largest relative difference from the sampling interval of the training that counts as rounding
WIDEST = 2 * math.pi  # rad, of an angle over time


@dataclass(frozen=True)
class Sample:
    """One sample.

    Args:
        time: [s].
        emg: of each channel [-].
        known: inputs beside EMG, SI units.
        where: what messages call its line.
        angle: name and text of the column with a measured angle, where there is one; not looked at.
    """

    time: float
    emg: Sequence[float]
    known: Sequence[float]
    where: str
    angle: tuple[str, str] | None = None

    def measured(self) -> float:
        """The measured angle [rad].

        Raises:
            ValueError: where there is none, or no angle.
        """
        if self.angle is None:
            raise ValueError(f"There is no column {' or '.join(ANGLES)}.")
        name, text = self.angle
        limit = math.pi if name == "angle_rad" else 180.0
        try:
            angle = float(text)
        except ValueError:
            angle = math.nan
        if not abs(angle) <= limit:
            raise ValueError(f"{self.where}: {name} is {text!r}, expected a number from {-limit:.4g} to {limit:.4g}.")
        return angle if name == "angle_rad" else math.radians(angle)


def read_samples(
    lines: Iterable[str],
    channels: Sequence[str],
    dt: float,
    source: str,
    known: Sequence[str] = (),
    tolerance: float = RATE_TOLERANCE,
    *,
    thins: bool = True,
) -> Iterator[Sample]:
    """Samples as soon as their lines are there; of lines at a whole multiple of the rate, those that the import keeps.

    Args:
        lines: CSV, the first line naming the columns: the channels, the known inputs, `time_s` where it is known, and
            `angle_rad` or `angle_deg` where it was measured. Others are not read.
        channels: EMG to read, in this order.
        dt: sampling interval that is expected [s].
        source: what the lines come from, for messages.
        known: further inputs to read, in this order.
        tolerance: relative difference from the sampling interval that counts as rounding.
        thins: whether a whole multiple of the rate is taken.

    Raises:
        ValueError: naming the line, at the first that is no sample of EMG.
    """
    numbered = ((f"{source}, line {n}", line) for n, line in enumerate(lines, 1))
    header = [name.strip().removeprefix("\ufeff") for name in _cells(*next(numbered, (source, "")))]
    if missing := [name for name in channels if name not in header]:
        raise ValueError(
            f"{source}, line 1: no column {', '.join(missing)}; found {', '.join(header) or 'nothing'}. The first line "
            f"names the columns, among them the channels of the network: {', '.join(channels)}."
        )
    if missing := [name for name in known if name not in header]:
        name = missing[0]
        raise ValueError(
            f"{source}, line 1: no column {', '.join(missing)}; found {', '.join(header)}. The network takes "
            f"{' and '.join(missing)} beside EMG. Add a column [{unit_of(name)}], or give what holds for the whole "
            f"run: --known {name}=VALUE."
        )
    if repeated := [name for name in ("time_s", *channels, *known) if header.count(name) > 1]:
        raise ValueError(f"{source}, line 1: {', '.join(repeated)} is there more than once; keep one of each.")
    angle = next((name for name in ANGLES if name in header), None)
    before, every, count = None, 1, 0
    for where, line in numbered:
        if not (row := _cells(where, line)):
            continue
        numbers = _read_numbers(row, header, ["time_s", *channels, *known], where)
        time = numbers.pop("time_s", 0.0 if before is None else before + dt)
        if count == 1 and thins and before is not None and 0 < time - before < dt:
            every = round(dt / (time - before))  # as `data.thinning`: the first sample, and then one of so many
        _check_rate(before, time, dt, every, where, tolerance)
        before, count = time, count + 1
        if (count - 1) % every:
            continue
        _check_known({name: numbers[name] for name in known}, where)
        measured = (angle, row[header.index(angle)]) if angle else None
        yield Sample(time, [numbers[name] for name in channels], [numbers[name] for name in known], where, measured)


def read_known(option: str, texts: Sequence[str], names: Sequence[str]) -> dict[str, float]:
    """Values of known inputs that hold for the whole run, by name.

    Args:
        option: what the user calls it, for messages.
        texts: each `name=value`.
        names: known inputs of the network.

    Raises:
        ValueError: for a name that is none of them, one given twice, or a value that cannot be.
    """
    values: dict[str, float] = {}
    for text in texts:
        name, _, number = text.partition("=")
        name = name.strip()
        if name not in names:
            raise ValueError(
                f"{option} {text!r}: the network takes no {name!r}{did_you_mean(name, names) or '.'} Beside EMG it "
                f"takes {', '.join(names) or 'nothing'}."
            )
        if name in values:
            raise ValueError(f"{option}: {name} is given more than once; keep one.")
        try:
            values[name] = float(number)
        except ValueError:
            values[name] = math.nan
        _check_known({name: values[name]}, f"{option} {text!r}")
    return values


def _check_known(values: Mapping[str, float], where: str) -> None:
    for name, value in values.items():
        constant = constant_behind(name)
        bounds = constant.bounds if constant else {"ge": -WIDEST, "le": WIDEST}
        low, high = bounds.get("ge", bounds.get("gt", -math.inf)), bounds.get("le", bounds.get("lt", math.inf))
        if not low <= value <= high:
            raise ValueError(f"{where}: {name} is {value:g}, expected {low:.4g} to {high:.4g} {unit_of(name)}.")


def _cells(where: str, line: str) -> list[str]:
    """The cells of one line; each is read by itself, so that a stray quote keeps no later line waiting."""
    try:
        return next(csv.reader([line], strict=True), [])
    except csv.Error as error:
        raise ValueError(
            f"{where}: found {line.rstrip()[:80]!r}, which is no line of CSV ({error}). What was predicted before is "
            "written; correct the line."
        ) from None


def _read_numbers(row: Sequence[str], header: Sequence[str], names: Sequence[str], where: str) -> dict[str, float]:
    """The numbers in these columns, by name, of those that the header has."""
    if len(row) != len(header):
        raise ValueError(f"{where}: {len(row)} values, but the first line names {len(header)} columns.")
    numbers = {}
    for name in names:
        if name not in header:
            continue
        text = row[header.index(name)]
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise ValueError(
                f"{where}: {name} is {text!r}, expected a number. What was predicted before is written; correct the "
                "line, or leave it and those before it out."
            )
        numbers[name] = number
    return numbers


def _check_rate(before: float | None, time: float, dt: float, every: int, where: str, tolerance: float) -> None:
    step = dt / every
    if before is not None and abs(time - before - step) > tolerance * step + 1e-6:
        taken = f", and one of {every} lines is taken" if every > 1 else ""
        raise ValueError(
            f"{where}: time_s goes from {before:g} to {time:g}, but the network was trained on samples {dt:g} s apart"
            f"{taken}. Resample the EMG to that interval, or to a whole multiple of that rate."
        )
