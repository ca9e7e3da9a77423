"""What `myowave predict` does: a line of prediction for each line of EMG."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

from myowave.learning.checkpoint import Checkpoint
from myowave.learning.inputs import NOTHING
from myowave.learning.streaming.predictor import Predictor
from myowave.learning.streaming.reading import read_samples


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
) -> Iterator[str]:
    """A line of prediction for each line of EMG, as soon as it is there.

    Args:
        lines: CSV, see `reading.read_samples`.
        source: what the lines come from, for messages.
        fixed: known inputs that hold for the whole run, see `known.read_known`; the others are columns.

    Yields:
        CSV: time_s, angle_rad, and spread_rad over the seeds (1 SD) where they are several.

    Raises:
        ValueError: naming the line, at the first that is no sample of EMG.
    """
    told = checkpoint.architecture.known
    columns = [name for name in told if name not in fixed]
    for i, sample in enumerate(read_samples(lines, checkpoint.channels, checkpoint.dt, source, columns)):
        known = {**fixed, **dict(zip(columns, sample.known, strict=True))}
        angle = predictor.step(sample.emg, sample.where, [known[name] for name in told])
        several = len(angle) > 1
        if i == 0:
            yield "time_s,angle_rad,spread_rad" if several else "time_s,angle_rad"
        yield f"{sample.time:.9g},{angle.mean():.9g}" + (f",{angle.std():.3g}" if several else "")
