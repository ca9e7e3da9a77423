"""Raw EMG as it comes from an amplifier, made into the samples that a network takes.

Filters, offsets and gains are those of the preparation of the training trials, which the checkpoint holds; the result
is that of the preparation with `phase: causal`, to rounding. A sample of the network between two of the amplifier waits
for the second one.
"""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from myowave.data.checks.values import UNSEEN_LIMIT
from myowave.data.processing.excitation import Excitation, RealTime
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.streaming.reading import RATE_TOLERANCE, Sample, Say, read_samples

SAME = 1e-6  # of the interval between raw samples: nearer to a raw sample than this is at it


def require_real_time(checkpoint: Checkpoint, path: str | Path) -> RealTime:
    """How raw EMG becomes that of the training trials, or a ValueError where it cannot in real time."""
    dataset = f"data.datasets.{checkpoint.dataset}"
    if not checkpoint.real_time:
        raise ValueError(
            f"{path}: the trials of {checkpoint.dataset} came with processed EMG, so nothing is known of raw EMG. Give "
            "EMG processed in the same way, without --raw; or train on a dataset of kind recorded with "
            "processing.phase: causal."
        )
    real_time = RealTime.model_validate(checkpoint.real_time)
    if real_time.processing.phase == "zero":
        raise ValueError(
            f"{path}: the EMG of {checkpoint.dataset} was filtered forwards and backwards, which needs what comes "
            f"later and cannot run in real time. Set {dataset}.processing.phase: causal and train again; or process "
            "the whole recording first and leave --raw out."
        )
    if len(rates := {known.rate_hz for known in real_time.channels.values()}) > 1:
        raise ValueError(
            f"{path}: the channels of {checkpoint.dataset} have {' and '.join(f'{r:g}' for r in sorted(rates))} Hz; "
            "--raw takes one rate for all of them. Record all channels at one rate, or leave --raw out."
        )
    return real_time


def read_raw_samples(
    lines: Iterable[str], real_time: RealTime, dt: float, source: str, known: Sequence[str] = (), *, say: Say
) -> Iterator[Sample]:
    """Samples `dt` apart [s] with EMG as a fraction of what counts as 1, from lines of raw EMG; see `read_samples`."""
    count, started, before = 0, 0.0, np.empty(0)
    for n, sample in enumerate(_excite(lines, real_time, source, known, say)):
        now = np.array(sample.emg)
        if n == 0:
            started, before = sample.time, now
        while (ago := n - count * dt * real_time.rate) > -SAME:  # in raw samples
            emg = now - max(ago, 0.0) * (now - before)
            yield replace(sample, time=started + count * dt, emg=emg.tolist())
            count += 1
        before = now


def _excite(lines: Iterable[str], real_time: RealTime, source: str, known: Sequence[str], say: Say) -> Iterator[Sample]:
    """Samples at the amplifier's rate, their EMG as a fraction of what counts as 1."""
    excitation, step, first = Excitation(real_time), 1 / real_time.rate, 0.0
    waiting: deque[Sample] = deque()
    for n, sample in enumerate(read_samples(lines, [*real_time.channels], step, source, known, say=say, raw=True)):
        first = sample.time if n == 0 else first
        if abs(sample.time - first - n * step) > RATE_TOLERANCE * n * step + step:
            raise ValueError(
                f"{sample.where}: {n} samples took {sample.time - first:.6g} s, but raw EMG is expected at "
                f"{real_time.rate:g} Hz, as it was recorded for the training. Resample it to that rate."
            )
        waiting.append(sample)
        for row in excitation.push(np.array([sample.emg])):
            yield _excited(waiting.popleft(), row, real_time)
    for row in excitation.finish():
        yield _excited(waiting.popleft(), row, real_time)


def _excited(sample: Sample, excitations: np.ndarray, real_time: RealTime) -> Sample:
    for (name, known), value in zip(real_time.channels.items(), excitations, strict=True):
        if not value <= UNSEEN_LIMIT:
            raise ValueError(
                f"{sample.where}: {name}, processed, is {value:.3g} of what counts as 1 ({known.gain:.4g} "
                f"{known.unit}); expected at most {UNSEEN_LIMIT:g}. Raw EMG is expected in {known.unit}; or look for "
                "an artefact."
            )
    return replace(sample, emg=excitations.tolist())
