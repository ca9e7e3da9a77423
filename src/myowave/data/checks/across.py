"""Whether the trials of a dataset go together: one rate, long enough, none there twice, and roles that exist."""

import hashlib
from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np

from myowave.data.checks.signals import RATE_TOLERANCE
from myowave.data.recording import Recording


def rate_problems(recordings: Mapping[str, Recording]) -> Iterator[str]:
    """Trials sampled at another rate than most."""
    common = float(np.median([recording.dt for recording in recordings.values()])) if recordings else 0.0
    for recording in recordings.values():
        if abs(recording.dt / common - 1) > RATE_TOLERANCE:
            yield (
                f"{recording.origin}: sampled every {recording.dt:.4g} s; expected {common:.4g} s like the other "
                "trials. Resample all trials to one rate."
            )


def duplicate_problems(recordings: Mapping[str, Recording]) -> Iterator[str]:
    """Trials with the same samples as an earlier one."""
    seen: dict[bytes, Recording] = {}
    for recording in recordings.values():
        content = recording.emg.tobytes() + recording.angle.tobytes()
        first = seen.setdefault(hashlib.sha256(content).digest(), recording)
        if first is not recording:
            yield (
                f"{recording.origin}: the same samples as {first.origin}. A trial that is there twice counts twice, "
                "and may both train and test; remove one."
            )


def role_problems(
    dataset: str, names: Sequence[str], test: Sequence[str], conditions: Collection[str]
) -> Iterator[str]:
    """Trials that the settings name and nobody recorded, and settings that leave none to train on.

    Args:
        dataset: name of the dataset.
        names: of the trials that there are.
        test, conditions: of the trials that test, and of those with conditions.
    """
    for key, named in (("test", test), ("conditions", conditions)):
        for name in named:
            if name not in names:
                yield f"data.datasets.{dataset}.{key}: no trial named {name!r}; the trials are {', '.join(names)}."
    if not set(names) - set(test):
        yield (
            f"data.datasets.{dataset}.test: every trial ({', '.join(names)}) is a test trial; leave some to train on, "
            "or add recordings."
        )
