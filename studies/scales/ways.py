"""The ways of the comparison: what is trained on at each stage, with what budget, and which way each is compared with.

A stage is what `Task` calls a level: stages K - 1, ..., 0 in turn, each with a fresh Adam, so ways with as many stages
have as many restarts. The last stage of every way but the one from fine to coarse trains on the trials as recorded.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from myowave.data.trials import Trials
from myowave.data.wavelets import decompose
from studies.scales.draws import decimate

Stages = Callable[[Trials, int], dict[int, Trials]]
"""From trials and the number of scales K: {stage: trials}."""


@dataclass(frozen=True)
class Way:
    """One way to train.

    Args:
        title: in a few words.
        stages: what it trains on.
        against: the way that it is compared with, which differs from it in one thing; None for the first.
        times: whether its budget is K times that of the others.
    """

    title: str
    stages: Stages
    against: str | None
    times: bool = False


def one(trials: Trials, scales: int) -> dict[int, Trials]:
    return {0: trials}


def restarted(trials: Trials, scales: int) -> dict[int, Trials]:
    return dict.fromkeys(range(scales), trials)


def projected(trials: Trials, scales: int) -> dict[int, Trials]:
    return decompose(trials, scales - 1)


def from_fine(trials: Trials, scales: int) -> dict[int, Trials]:
    coarse = decompose(trials, scales - 1)
    return {scales - 1 - level: each for level, each in coarse.items()}


def of_emg(trials: Trials, scales: int) -> dict[int, Trials]:
    return {
        j: replace(each, angle=trials.angle, signals=trials.signals) for j, each in projected(trials, scales).items()
    }


def of_angle(trials: Trials, scales: int) -> dict[int, Trials]:
    return {j: replace(each, emg=trials.emg) for j, each in projected(trials, scales).items()}


def decimated(trials: Trials, scales: int) -> dict[int, Trials]:
    return {level: decimate(each, 2**level) for level, each in decompose(trials, scales - 1).items()}


HALF_POWER = math.sqrt(math.log(2)) / math.pi
"""Standard deviation [samples] of the Gaussian that halves the power at the Nyquist frequency; a scale [-j] ends 2^j
times lower."""


def smoothed(trials: Trials, scales: int) -> dict[int, Trials]:
    def smooth(level: int) -> Trials:
        sigma = HALF_POWER * 2**level
        return trials.changed(lambda values: np.asarray(gaussian_filter1d(values, sigma, axis=0)))

    return {level: smooth(level) if level else trials for level in range(scales)}


WAYS: Mapping[str, Way] = {
    "one": Way("1 scale", one, None),
    "restarted": Way("1 scale, as many restarts", restarted, "one"),
    "coarse_to_fine": Way("coarse to fine", projected, "restarted"),
    "fine_to_coarse": Way("fine to coarse", from_fine, "restarted"),
    "emg_only": Way("coarse to fine, EMG only", of_emg, "restarted"),
    "angle_only": Way("coarse to fine, angle only", of_angle, "restarted"),
    "decimated": Way("coarse to fine, decimated", decimated, "restarted"),
    "gaussian": Way("coarse to fine, Gaussian", smoothed, "restarted"),
    "one_long": Way("1 scale, K times the budget", one, "one", times=True),
    "coarse_to_fine_long": Way("coarse to fine, the budget at each scale", projected, "one_long", times=True),
}
