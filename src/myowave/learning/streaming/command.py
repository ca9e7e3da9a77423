"""What `myowave predict` does: a line of prediction for each line of EMG."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np

from myowave.data.processing.excitation import RealTime
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.inputs import NOTHING, unit_of
from myowave.learning.streaming.predictor import Predictor
from myowave.learning.streaming.raw import read_raw_samples
from myowave.learning.streaming.reading import Sample, Say, read_number, read_samples


def start_angles(checkpoint: Checkpoint, text: str) -> list[float]:
    """The known angles [rad] that a prediction starts from, from the text of `--start-deg`: as many first angles [deg],
    with commas, as the network's history has, or one, where the arm rests; none of an empty text. Else a ValueError."""
    history, angles = checkpoint.network.history, [read_number(part) for part in text.split(",")] if text else []
    if not all(-180 <= angle <= 180 for angle in angles):
        raise ValueError(f"--start-deg is {text!r}; expected angles of -180 to 180 with commas, such as 30 or 30,30.5.")
    if len(angles) not in (0, 1, history):
        raise ValueError(
            f"--start-deg has {len(angles)} angles; give one, where the arm rests, or the first {history} measured "
            "ones."
        )
    return [math.radians(angle) for angle in (angles * history if len(angles) == 1 else angles)]


def predict_lines(
    predictor: Predictor,
    lines: Iterable[str],
    source: str,
    start: Sequence[float],
    fixed: Mapping[str, float] = NOTHING,
    *,
    say: Say,
    deg: bool = False,
    raw: RealTime | None = None,
) -> Iterator[str]:
    """A line of prediction for each line of EMG, as soon as it is there.

    Args:
        lines: CSV, see `reading.read_samples`.
        source: what the lines come from, for messages.
        start: from `start_angles`; where it is empty the first measured angles of the lines are taken, where they have
            any, and which start was taken is said, and why.
        fixed: known inputs that hold for the whole run, see `reading.read_known`; the others are columns.
        say: is told of the start, where there are no times, and once of each quantity that leaves the range of the
            training trials.
        deg: angles in degrees.
        raw: how the lines, which then hold raw EMG at its own rate, become EMG; see `raw.require_real_time`.

    Yields:
        CSV: time_s, angle_rad, spread_rad over the seeds (1 SD) where they are several, and low_rad and high_rad of the
        90 % band where all seeds are run; with `deg` angle_deg, ... A ValueError names the first line that is none.
    """
    checkpoint, (unit, scale) = predictor.checkpoint, ("deg", math.degrees(1)) if deg else ("rad", 1.0)
    inputs, watch = checkpoint.architecture.known, watch_range(checkpoint, say)
    columns = [name for name in inputs if name not in fixed]
    samples = (
        read_samples(lines, checkpoint.channels, checkpoint.dt, source, columns, say=say)
        if raw is None
        else read_raw_samples(lines, raw, checkpoint.dt, source, columns, say=say)
    )
    for i, (sample, given) in enumerate(_with_start(samples, start, checkpoint, say)):
        known = {**fixed, **dict(zip(columns, sample.known, strict=True))}
        told = [known[name] for name in inputs]
        angles = predictor.step(sample.emg, told, given, sample.where)
        angle, spread = float(angles.mean()), float(angles.std())
        watch([*np.maximum(sample.emg, 0.0), *told], angle, sample.where)
        numbers = {"angle": f"{scale * angle:.9g}"}
        if len(angles) > 1:
            numbers["spread"] = f"{scale * spread:.3g}"
        if checkpoint.band is not None and len(angles) == len(checkpoint.seeds):
            half = float(checkpoint.band.half_width(np.asarray(spread))) if math.isnan(given) else 0.0
            numbers |= {"low": f"{scale * (angle - half):.9g}", "high": f"{scale * (angle + half):.9g}"}
        if i == 0:
            yield ",".join(["time_s", *(f"{name}_{unit}" for name in numbers)])
        yield ",".join([f"{sample.time:.9g}", *numbers.values()])


def _with_start(
    samples: Iterable[Sample], start: Sequence[float], checkpoint: Checkpoint, say: Say
) -> Iterator[tuple[Sample, float]]:
    """Samples, each with its known angle [rad] where it is of the history, and with no number where it is later."""
    history, rest = checkpoint.network.history, checkpoint.scaling.angle_mean
    for i, sample in enumerate(samples):
        if start or i >= history:
            yield sample, start[i] if i < history else math.nan
            continue
        try:
            angle = sample.measured()
            if i == 0:
                say(f"Start: the first {history} angles of the column {sample.angle[0]}; later ones are not looked at.")
        except ValueError as error:
            if i:
                raise ValueError(f"{error} The prediction starts from it; correct it, or give --start-deg.") from None
            # ASSUME: the arm is at rest at the mean angle of the training trials, where nothing is said of its start.
            start, angle = [rest] * history, rest
            say(
                f"{error} Assumed: at rest at {math.degrees(rest):.1f} deg, the mean of the training trials, for the "
                f"first {history} samples; --start-deg says otherwise."
            )
        yield sample, angle


def watch_range(checkpoint: Checkpoint, say: Say) -> Callable[[Sequence[float], float, str], None]:
    """What looks at each sample - its EMG and known inputs, predicted angle [rad], and what messages call it - and says
    once of each quantity that it has left the range of the training trials."""
    seen, turn = checkpoint.seen, math.degrees(1)
    quantities = [  # name, unit, and what a value in SI units is multiplied with
        *((name, "", 1.0) for name in checkpoint.channels),
        *((name, f" {unit_of(name)}", 1.0) for name in checkpoint.architecture.known),
        ("the predicted angle", " deg", turn),
        ("the predicted speed", " deg/s", turn),
    ]
    said: set[int] = set()
    before = math.nan

    def watch(inputs: Sequence[float], angle: float, where: str) -> None:
        nonlocal before
        speed = 0.0 if math.isnan(before) else (angle - before) / checkpoint.dt
        before, values = angle, [*inputs, angle, speed]
        for i in sorted({*np.flatnonzero(seen.outside(values)).tolist()} - said):
            said.add(i)
            name, unit, factor = quantities[i]
            value, low, high = (factor * v for v in (values[i], seen.low[i], seen.high[i]))
            say(
                f"{where}: {name} is {value:.4g}{unit}; in the training trials it went from {low:.4g} to {high:.4g}. "
                "From here on the prediction may be off by more than its band. (Said once.)"
            )

    return watch
