"""Samples of EMG from lines of CSV, each read and checked as it comes; and values of known inputs for a whole run."""

import csv
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from myowave.data.trials import ANGLES
from myowave.learning.inputs import constant_behind, unit_of
from myowave.settings.keys import did_you_mean

RATE_TOLERANCE = 0.01  # largest relative difference from the sampling interval of the training that counts as rounding
ROUNDED = 0.25  # the same of raw EMG, whose times are often rounded to 0.1 ms
WIDEST = 2 * math.pi  # rad, of an angle over time
LONGEST = 100_000  # characters of a line: a thousand columns have fewer
Say = Callable[[str], None]


@dataclass(frozen=True)
class Sample:
    """One sample: time [s], EMG of each channel [-], known inputs in SI units, what messages call its line, and name
    and text of the column with a measured angle, where there is one."""

    time: float
    emg: Sequence[float]
    known: Sequence[float]
    where: str
    angle: tuple[str, str] = "", ""

    def measured(self) -> float:
        """The measured angle [rad], or a ValueError where there is none."""
        name, text = self.angle
        if not name:
            raise ValueError(f"There is no column {' or '.join(ANGLES)}.")
        limit = math.pi if name == "angle_rad" else 180.0
        angle = read_number(text)
        if not abs(angle) <= limit:
            raise ValueError(f"{self.where}: {name} is {text!r}, expected a number from {-limit:.4g} to {limit:.4g}.")
        return angle if name == "angle_rad" else math.radians(angle)


def read_samples(
    lines: Iterable[str],
    channels: Sequence[str],
    dt: float,
    source: str,
    known: Sequence[str] = (),
    *,
    say: Say,
    raw: bool = False,
) -> Iterator[Sample]:
    """Samples as soon as their lines are there; of lines at a whole multiple of the rate, those that the import keeps.

    Args:
        lines: CSV, the first line naming the columns: the channels, the known inputs, `time_s` where it is known, and
            `angle_rad` or `angle_deg` where it was measured. Others are not read.
        dt: sampling interval that is expected [s].
        source: what the lines come from, for messages.
        say: is told where there is no time.
        raw: whether they are an amplifier's, whose times are rounded and of which none is left out.

    Raises:
        ValueError: naming the line, at the first that is no sample of EMG; or where there is none.
    """
    numbered = ((f"{source}, line {n}", line) for n, line in enumerate(lines, 1))
    header = [name.strip().removeprefix("\ufeff") for name in _cells(*next(numbered, (source, "")))]
    _check_header(header, channels, known, source)
    if "time_s" not in header:
        say(f"{source}, line 1: no column time_s. Assumed: samples {dt:g} s apart, as those of the training.")
    angle = next((name for name in ANGLES if name in header), "")
    wanted = [name for name in ("time_s", *channels, *known) if name in header]
    before, every, count, tolerance = math.nan, 1, 0, ROUNDED if raw else RATE_TOLERANCE
    for where, line in numbered:
        if not (row := _cells(where, line)):
            continue
        if len(row) != len(header):
            raise ValueError(f"{where}: {len(row)} values, but the first line names {len(header)} columns.")
        cells = dict(zip(header, row, strict=True))
        numbers = {name: _number(name, cells[name], where) for name in wanted}
        time = numbers.get("time_s", before + dt if count else 0.0)
        if count == 1 and not raw and 0 < time - before < dt:
            every = round(dt / (time - before))  # as `Trials.thinned`: the first sample, and then one of so many
        step = dt / every
        if count and abs(time - before - step) > tolerance * step + 1e-6:
            taken = f", and one of {every} lines is taken" if every > 1 else ""
            raise ValueError(
                f"{where}: time_s goes from {before:g} to {time:g}, but the network was trained on samples {dt:g} s "
                f"apart{taken}. Resample the EMG to that interval, or to a whole multiple of that rate."
            )
        before, count = time, count + 1
        if (count - 1) % every:
            continue
        for name in known:
            _check_known(name, numbers[name], where)
        emg, told = ([numbers[name] for name in names] for names in (channels, known))
        yield Sample(time, emg, told, where, (angle, cells.get(angle, "")))
    if not count:
        raise ValueError(f"{source}: no samples below the names of columns; expected a line for each.")


def _check_header(header: Sequence[str], channels: Sequence[str], known: Sequence[str], source: str) -> None:
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
    if repeated := [name for name in ("time_s", *ANGLES, *channels, *known) if header.count(name) > 1]:
        raise ValueError(f"{source}, line 1: {', '.join(repeated)} is there more than once; keep one of each.")


def _cells(where: str, line: str) -> list[str]:
    """The cells of one line; each is read by itself, so that a stray quote keeps no later line waiting."""
    if len(line) >= LONGEST:
        raise ValueError(f"{where}: found {line[:40]!r} and on without end; expected a line of CSV.")
    try:
        return next(csv.reader([line], strict=True), [])
    except csv.Error as error:
        raise ValueError(
            f"{where}: found {line.rstrip()[:80]!r}, which is no line of CSV ({error}). What was predicted before is "
            "written; correct the line."
        ) from None


def _number(name: str, text: str, where: str) -> float:
    number = read_number(text)
    if not math.isfinite(number):
        raise ValueError(
            f"{where}: {name} is {text!r}, expected a number. What was predicted before is written; correct the line, "
            "or leave it and those before it out."
        )
    return number


def read_number(text: str) -> float:
    """A number, or what is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def read_known(texts: Sequence[str], names: Sequence[str]) -> dict[str, float]:
    """Values of known inputs, of these names, that hold for the whole run, from texts of `--known`, such as `load=2.5`.
    A ValueError for a name that is none of them, one given twice, or a value that cannot be."""
    values: dict[str, float] = {}
    for text in texts:
        name, _, number = text.partition("=")
        name = name.strip()
        if name not in names:
            raise ValueError(
                f"--known {text!r}: the network takes no {name!r}{did_you_mean(name, names) or '.'} Beside EMG it "
                f"takes {', '.join(names) or 'nothing'}."
            )
        if name in values:
            raise ValueError(f"--known: {name} is given more than once; keep one.")
        values[name] = read_number(number)
        _check_known(name, values[name], f"--known {text!r}")
    return values


def _check_known(name: str, value: float, where: str) -> None:
    constant = constant_behind(name)
    bounds = constant.bounds if constant else {"ge": -WIDEST, "le": WIDEST}
    low, high = bounds.get("ge", bounds.get("gt", -math.inf)), bounds.get("le", bounds.get("lt", math.inf))
    if not low <= value <= high:
        raise ValueError(f"{where}: {name} is {value:g}, expected {low:.4g} to {high:.4g} {unit_of(name)}.")
