"""What `myowave predict` does: a line of prediction for each line of EMG."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from myowave.data.processing.real_time import RealTime
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.inputs import NOTHING
from myowave.learning.streaming.drift import Drift
from myowave.learning.streaming.predictor import Predictor
from myowave.learning.streaming.raw import read_raw_samples
from myowave.learning.streaming.reading import Sample, read_samples


def start_angles(checkpoint: Checkpoint, start_deg: Sequence[float]) -> list[float]:
    """The known angles [rad] that a prediction starts from.

    Args:
        start_deg: the first angles [deg]; a single one is where the arm rests; none is the mean of the training trials.

    Raises:
        ValueError: for neither one angle nor as many as the network's history.
    """
    history = checkpoint.network.history
    # ASSUME: the arm is at rest at the mean angle of the training trials, where nothing is said of its start.
    angles = [math.radians(angle) for angle in start_deg] or [checkpoint.scaling.angle_mean]
    if len(angles) not in (1, history):
        raise ValueError(
            f"the start has {len(angles)} angles; give one, where the arm rests, or the first {history} measured ones."
        )
    return angles * history if len(angles) == 1 else angles


def predict_lines(
    checkpoint: Checkpoint,
    predictor: Predictor,
    lines: Iterable[str],
    source: str,
    fixed: Mapping[str, float] = NOTHING,
    *,
    deg: bool = False,
    say: Callable[[str], None] | None = None,
    warn: Callable[[str], None] | None = None,
    raw: RealTime | None = None,
) -> Iterator[str]:
    """A line of prediction for each line of EMG, as soon as it is there.

    Args:
        lines: CSV, see `reading.read_samples`.
        source: what the lines come from, for messages.
        fixed: known inputs that hold for the whole run, see `reading.read_known`; the others are columns.
        deg: angles in degrees.
        say: where nothing is said of the start: the first measured angles of the lines are taken, where they have any,
            and which start was taken is said, and why.
        warn: called once for each quantity that leaves the range of the training trials.
        raw: how the lines, which then hold raw EMG at its own rate, become EMG; see `raw.require_real_time`.

    Yields:
        CSV: time_s, angle_rad, spread_rad over the seeds (1 SD) where they are several, and low_rad and high_rad of the
        90 % band where all seeds are run; with `deg` angle_deg, ...

    Raises:
        ValueError: naming the line, at the first that is no sample of EMG.
    """
    unit, scale = ("deg", math.degrees(1)) if deg else ("rad", 1.0)
    inputs = checkpoint.architecture.known
    columns = [name for name in inputs if name not in fixed]
    from_column, drift = False, Drift(checkpoint, warn)
    samples = (
        read_samples(lines, checkpoint.channels, checkpoint.dt, source, columns)
        if raw is None
        else read_raw_samples(lines, raw, checkpoint.dt, source, columns)
    )
    for i, sample in enumerate(samples):
        if i == 0 and say is not None:
            from_column = _start_is_measured(checkpoint, sample, say)
        measured = _known_angle(sample) if from_column and i < predictor.history else None
        known = {**fixed, **dict(zip(columns, sample.known, strict=True))}
        angle = scale * predictor.step(sample.emg, sample.where, [known[name] for name in inputs], measured)
        drift.watch([*sample.emg, *(known[name] for name in inputs)], float(angle.mean()) / scale, sample.where)
        several, banded = len(angle) > 1, checkpoint.band is not None and len(angle) == len(checkpoint.seeds)
        if i == 0:
            names = ["angle", *(["spread"] if several else []), *(["low", "high"] if banded else [])]
            yield ",".join(["time_s", *(f"{name}_{unit}" for name in names)])
        numbers = f"{sample.time:.9g},{angle.mean():.9g}" + (f",{angle.std():.3g}" if several else "")
        if banded and checkpoint.band is not None:
            half = scale * float(checkpoint.band.half_width(angle.std() / scale)) if i >= predictor.history else 0.0
            numbers += f",{angle.mean() - half:.9g},{angle.mean() + half:.9g}"
        yield numbers


def _start_is_measured(checkpoint: Checkpoint, first: Sample, say: Callable[[str], None]) -> bool:
    """Whether the start is measured, by the first sample; what was decided is said."""
    history = checkpoint.network.history
    try:
        first.measured()
    except ValueError as error:
        say(
            f"{error} Assumed: at rest at {math.degrees(checkpoint.scaling.angle_mean):.1f} deg, the mean of the "
            f"training trials, for the first {history} samples; --start-deg says otherwise."
        )
        return False
    name = first.angle[0] if first.angle else ""
    say(f"Start: the first {history} angles of the column {name}; later ones are not looked at.")
    return True


def _known_angle(sample: Sample) -> float:
    try:
        return sample.measured()
    except ValueError as error:
        raise ValueError(f"{error} The prediction starts from it; correct it, or give --start-deg.") from None
