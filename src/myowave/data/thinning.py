"""Trials at a lower rate: every so many samples one is kept."""

from collections.abc import Mapping

from myowave.data.trials import Trials
from myowave.data.wavelets import decompose


def thin(trials: Trials, rate_hz: float | None) -> Trials:
    """Trials with about as many samples a second as asked for, beginning with the first of each; None keeps all.

    ASSUME: EMG and motion hold nothing above half of the rate, as envelopes of 4 Hz and the motion of an arm at 25 Hz.
    Kept are samples as they were recorded, so that a stream is thinned in the same way, with no lag.

    Raises:
        ValueError: where fewer than 2 samples of a trial are left.
    """
    every = 1 if rate_hz is None else max(1, round(1 / (trials.dt * rate_hz)))
    if every == 1:
        return trials
    length, name = min(zip(trials.lengths, trials.names, strict=True))
    if length <= every:
        raise ValueError(
            f"dataset {trials.dataset!r}, trial {name!r}: of {length} samples {1 / trials.dt:g} a second, {rate_hz:g} "
            "a second leave one. Use longer trials, or raise the recipe's rate_hz."
        )
    return trials.changed(lambda values: values[::every], dt=trials.dt * every)


def thin_scales(scales: Mapping[int, Trials], rate_hz: float | None, levels: int, wavelet: str) -> Mapping[int, Trials]:
    """Scales of thinned trials, see `wavelets.decompose`: projected anew where they are thinned, as each is coarser."""
    thinned = thin(scales[0], rate_hz)
    return scales if thinned is scales[0] else decompose(thinned, levels, wavelet)
