"""How far a prediction may be off: a band about the mean of all seeds that holds 90 % of the measured angles.

The seeds of a network disagree where training told them little (deep ensembles, Lakshminarayanan et al. 2017), but
they are too sure of themselves. So their spread is scaled by how far their mean missed samples that no weight learned:
the ends of the training trials, reached by free runs from the trials' beginnings, as a test trial is, or each training
trial in turn, by networks that were trained without it. This is split or cross conformal prediction with a score
normalised by the spread (Lei et al. 2018, J. Am. Stat. Assoc. 113, Sec. 5.2; Vovk 2015, Ann. Math. AI 74); errors
of neighbouring samples are alike, so that samples count as the independent ones they are worth. Noise of EMG and of
parameters is in those errors.

Shapes: S seeds, T trials, N samples, K of them at the end of a trial.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from myowave.identification.noise import correlation_time

Array = NDArray[np.float64]

LEVEL = 0.9
"""Share of the samples that the band is to hold."""


@dataclass(frozen=True)
class Band:
    """A band about the mean of all seeds.

    Args:
        factor: by which the scale of the error is multiplied [-].
        floor: error that is there even where all seeds agree [rad].
    """

    factor: float
    floor: float

    def half_width(self, spread: Array) -> Array:
        """Half of the band's width [rad] where the seeds have a standard deviation of `spread` [rad]."""
        return self.factor * np.hypot(spread, self.floor)


def band_about(predicted: Array, band: Band, given: int) -> tuple[Array, Array]:
    """Lower and upper end of the band [rad], (..., N), about predictions of all seeds (S, ..., N).

    Args:
        given: samples at the start whose angle is known; there the band has no width.
    """
    mean, half = predicted.mean(0), band.half_width(predicted.std(0))
    half[..., :given] = 0.0
    return mean - half, mean + half


def calibrate(errors: Sequence[Array], spreads: Sequence[Array]) -> Band:
    """The band that held-out samples ask for.

    Args:
        errors: measured angle less the mean of the seeds [rad], of each trial (K,).
        spreads: standard deviation of the seeds [rad], likewise.

    Returns:
        Infinitely wide where a prediction is not finite. Where errors are worth fewer than 9 independent samples no
        band can promise 90 %: then it holds the largest error seen.
    """
    error, spread = np.concatenate(errors), np.concatenate(spreads)
    if not np.isfinite([error, spread]).all():
        return Band(1.0, np.inf)
    # ASSUME: samples that were held out of the training trials are missed as those of a trial that was never seen.
    floor = float(max(np.sqrt(np.mean(error**2)), 1e-9))
    scores = error / np.hypot(spread, floor)
    padded = np.zeros((len(errors), max(map(len, errors))))
    for row, score in zip(padded, np.split(scores, np.cumsum([len(e) for e in errors])[:-1]), strict=True):
        row[: len(score)] = score
    count = len(scores) / max(correlation_time(padded, len(scores)), 1.0)
    level = min(np.ceil((count + 1) * LEVEL) / count, 1.0)
    return Band(float(np.quantile(np.abs(scores), level, method="higher")), floor)
