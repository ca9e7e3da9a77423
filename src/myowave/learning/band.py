"""How far a prediction may be off: a band about the mean of all seeds that holds 90 % of the measured angles.

The seeds of a network disagree where training told them little (deep ensembles, Lakshminarayanan et al. 2017), but
they are too sure of themselves. So their spread is scaled by how far their mean missed samples that no weight learned:
the ends of the training trials, reached by free runs from the trials' beginnings, as a test trial is, or each training
trial in turn, by networks that were trained without it. This is split or cross conformal prediction with a score
normalised by the spread (Lei et al. 2018, J. Am. Stat. Assoc. 113, Sec. 5.2; Vovk 2015, Ann. Math. AI 74); errors
of neighbouring samples are alike, so that samples count as the independent ones they are worth. Noise of EMG and of
parameters is in those errors.

The band says nothing where a network was never trained: what the training trials covered is `Seen`.

Shapes: S seeds, N samples, K of them held out of a trial, X inputs: EMG channels and what is known beside them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from myowave.data.trials import Array, Trials
from myowave.identification.noise import correlation_time
from myowave.learning.inputs import Known, given_inputs

MARGIN = 0.05  # share of a range by which it may be left before it counts as left
LEVEL = 0.9  # share of the samples that the band is to hold


@dataclass(frozen=True)
class Band:
    """A band about the mean of all seeds: the scale of the error times a `factor` [-], where `floor` [rad] is the error
    that is there even where all seeds agree."""

    factor: Annotated[float, Field(gt=1e-12)]
    floor: Annotated[float, Field(gt=1e-12)]

    def half_width(self, spread: Array) -> Array:
        """Half of the band's width [rad] where the seeds have a standard deviation of `spread` [rad]."""
        return self.factor * np.hypot(spread, self.floor)


def band_about(predicted: Array, band: Band | None, given: int) -> tuple[Array, Array]:
    """Lower and upper end of the band [rad], (..., N), about predictions of all seeds (S, ..., N), of which the first
    `given` samples are known; no numbers where there is no band."""
    mean, half = predicted.mean(0), np.full(predicted.shape[1:], np.nan)
    if band is not None:
        half = band.half_width(predicted.std(0))
        half[..., :given] = 0.0
    return mean - half, mean + half


def calibrate(errors: Sequence[Array], spreads: Sequence[Array]) -> Band:
    """The band that held-out samples ask for, infinitely wide where a prediction is not finite. Where errors are worth
    fewer than 9 independent samples no band can promise 90 %: then it holds the largest error seen.

    Args:
        errors: measured angle less the mean of the seeds [rad], of each trial (K,).
        spreads: standard deviation of the seeds [rad], likewise.
    """
    error, spread = np.concatenate(errors), np.concatenate(spreads)
    if not np.isfinite([error, spread]).all():
        return Band(1.0, np.inf)
    # ASSUME: samples that were held out of the training trials are missed as those of a trial that was never seen.
    floor = float(max(np.sqrt(np.mean(error**2)), 1e-9))
    scores = error / np.hypot(spread, floor)
    padded = np.zeros((len(errors), max(map(len, errors))))
    padded[np.arange(padded.shape[1]) < [[len(e)] for e in errors]] = scores
    count = len(scores) / max(correlation_time(padded, len(scores)), 1.0)
    level = min(np.ceil((count + 1) * LEVEL) / count, 1.0)
    return Band(float(np.quantile(np.abs(scores), level, method="higher")), floor)


@dataclass(frozen=True)
class Seen:
    """Ranges of the training trials: of each input, in its own unit, then of the angle [rad] and its speed [rad/s]."""

    low: tuple[float, ...]
    high: tuple[float, ...]

    @classmethod
    def of(cls, trials: Trials, known: Known) -> "Seen":
        """Of some trials, all of which count, and of what is known of them."""
        quantities = gather(given_inputs(trials, known), trials.angle, trials.dt)[trials.valid]
        return cls(tuple(quantities.min(0).tolist()), tuple(quantities.max(0).tolist()))

    def outside(self, quantities: ArrayLike) -> NDArray[np.bool_]:
        """Whether each of the quantities (..., X + 2), see `gather`, is not within its range."""
        low, high = np.array(self.low), np.array(self.high)
        margin = MARGIN * (high - low) + 1e-9
        values = np.asarray(quantities)
        return ~((values >= low - margin) & (values <= high + margin))  # what is no number is outside as well


def gather(inputs: ArrayLike, angle: Array, dt: float) -> Array:
    """Inputs (..., N, X), angle (..., N) [rad] and its speed [rad/s] side by side, (..., N, X + 2); the first speed is
    0."""
    speed = np.diff(angle, prepend=angle[..., :1]) / dt
    return np.concatenate([inputs, angle[..., None], speed[..., None]], axis=-1)
