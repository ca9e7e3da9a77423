"""Doubts about EMG that is not constant: each check is a generator of findings about one channel, or a pair of them."""

from collections.abc import Iterator, Mapping
from itertools import combinations, groupby

import numpy as np
from numpy.typing import NDArray

from myowave.data.processing.filters import band_pass
from myowave.data.processing.sampled import Sampled
from myowave.data.processing.spectrum import LINE_HEIGHT, line_height, share_of_power
from myowave.data.quality.finding import Finding

MAINS_HZ = (50.0, 60.0)
DEAD = 0.01
"""Scatter of a channel over its median of the session's trials, below which nothing was recorded [-]."""
SILENT = 1.5
"""Envelope at its 95th over its 5th percentile, below which no contraction is to be seen [-]."""
CLIPPED_RUN, CLIPPED_RUNS = 3, 3
"""Samples in a row at the largest or smallest value, and how often, that count as clipping."""
HELD_S = 0.02
"""Time for which EMG does not change that counts as a gap; at 2000 Hz noise changes it every few samples [s]."""
REPEATED_S = 0.03
"""Length of a block that is there twice, sample for sample [s]."""
SLOW_HZ, SLOW_SHARE = 20.0, 0.15
"""Below which frequency EMG has little power, and the share of it from which cables and electrodes are suspected."""
FAST_SHARE = 0.3
"""Share of the power above `SLOW_HZ` below which a signal is no raw EMG [-]."""
CROSSTALK = 0.5
"""Correlation of two channels' raw EMG, at any shift up to `CROSSTALK_S`, from which they may hold one muscle's [-]."""
CROSSTALK_S = 0.005
_BAND_HZ = (20.0, 450.0)


def dead_channel(raw: Sampled, typical: float) -> Iterator[Finding]:
    """A channel that recorded nothing; `typical` is the median over the trials of its standard deviation."""
    scatter = float(raw.values.std())
    if scatter == 0 or scatter < DEAD * typical:
        yield Finding(
            "dead channel",
            f"scatters by {scatter:.2g} {raw.unit}, over the session typically by {typical:.2g} {raw.unit}",
            "The electrode was off or the column is another one: leave the trial or the channel out.",
        )


def silent_channel(envelope: Sampled) -> Iterator[Finding]:
    """A channel in which no contraction is to be seen."""
    low, high = np.percentile(envelope.values, [5, 95])
    if high < SILENT * low:
        yield Finding(
            "no contraction",
            f"the envelope stays between {low:.3g} and {high:.3g} {envelope.unit}",
            "Noise only, or a muscle that rests: do not normalise by this trial, and check the electrode.",
        )


def clipping(raw: Sampled) -> Iterator[Finding]:
    """Values that stay at the end of the recorder's range."""
    counts = {
        end: sum(n >= CLIPPED_RUN for _, n in _runs(raw.values == end)) for end in (raw.values.max(), raw.values.min())
    }
    end, count = max(counts.items(), key=lambda pair: pair[1])
    if count >= CLIPPED_RUNS:
        yield Finding(
            "clipping",
            f"stays at {end:.4g} {raw.unit} {count} times",
            "The recorder's range was too small, so peaks are missing: record with less gain, or leave the trial out.",
        )


def mains_hum(raw: Sampled, notch_hz: float | None) -> Iterator[Finding]:
    """A line at the frequency of the mains, unless it is taken out."""
    for frequency in MAINS_HZ:
        if frequency < raw.rate / 2 and frequency != notch_hz:
            height = line_height(raw.values, raw.rate, frequency)
            if height > LINE_HEIGHT:
                share = share_of_power(raw.values, raw.rate, frequency - 1, frequency + 1)
                yield Finding(
                    "mains hum",
                    f"a line at {frequency:g} Hz, {height:.0f} times its neighbourhood, with {share:.1%} of the power",
                    f"Set processing.notch_hz to {frequency:g}; next time, check the reference electrode.",
                )


def slow_power(raw: Sampled) -> Iterator[Finding]:
    """Much power where EMG has little: no raw EMG at all, or cables that swing and electrodes that shift."""
    slow = share_of_power(raw.values, raw.rate, 0, SLOW_HZ)
    rectified = raw.values.min() >= 0
    if rectified or slow > 1 - FAST_SHARE:
        yield Finding(
            "not raw EMG",
            "never below 0" if rectified else f"only {1 - slow:.0%} of the power is above {SLOW_HZ:g} Hz",
            "This looks rectified or smoothed: export the raw signal, or say form: envelope for the channel.",
        )
    elif slow > SLOW_SHARE:
        yield Finding(
            "power below 20 Hz",
            f"{slow:.0%} of the power is below {SLOW_HZ:g} Hz",
            "Cables or electrodes moved. The band-pass takes out what is below its lower end; raise that end to 30 Hz "
            "if the envelope follows the motion rather than the muscle.",
        )


def filled_gaps(raw: Sampled) -> Iterator[Finding]:
    """Stretches that a recorder filled where a radio link was lost: with one value, or with a copy."""
    shortest = max(4, round(HELD_S * raw.rate))
    if still := [(start, n + 1) for start, n in _runs(np.diff(raw.values) == 0) if n + 1 >= shortest]:
        longest = max(length for _, length in still) / raw.rate
        yield Finding(
            "gap",
            f"does not change for {1000 * longest:.0f} ms, first {_times(raw, [start for start, _ in still])}",
            "The recorder filled a gap with one value: cut the trial there with cut_s, or record again.",
        )
    length = max(16, round(REPEATED_S * raw.rate))
    if starts := _repeats(raw.values, length):
        yield Finding(
            "repeated block",
            f"{len(starts)} blocks of {1000 * length / raw.rate:.0f} ms or more are copies of earlier ones, first "
            f"{_times(raw, starts)}",
            "The recorder filled gaps with copies: cut the trial there with cut_s, or record again.",
        )


def crosstalk(emg: Mapping[str, Sampled]) -> Iterator[Finding]:
    """Two channels that hold the same signal, or its mirror image."""
    for (one, a), (two, b) in combinations(emg.items(), 2):
        shared = _shared(a, b)
        if shared is not None and abs(shared) > CROSSTALK:
            yield Finding(
                "cross-talk",
                f"{one} and {two} have a correlation of {shared:.2f} within {1000 * CROSSTALK_S:g} ms",
                "Electrodes may see one muscle, or share a poor reference: compare the two, and keep the one that is "
                "nearer to its muscle; the effect emg_crosstalk tells the diagnosis of it.",
            )


def _shared(a: Sampled, b: Sampled) -> float | None:
    """Largest correlation of two channels in the EMG's band at small shifts; None where their clocks differ."""
    if a.rate != b.rate or abs(a.start - b.start) > 0.5 / a.rate or min(a.values.std(), b.values.std()) == 0:
        return None
    samples = min(len(a.values), len(b.values))
    x, y = (_standard(band_pass(s.values[:samples], s.rate, _BAND_HZ, "zero")) for s in (a, b))
    shift = round(CROSSTALK_S * a.rate)
    values = [float(np.mean(x[max(0, k) : samples + min(0, k)] * y[max(0, -k) : samples - max(0, k)])) for k in
              range(-shift, shift + 1)]  # fmt: skip
    return max(values, key=abs)


def _standard(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return (values - values.mean()) / values.std()


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """(start, length) of each stretch of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return [(int(start), int(end - start)) for start, end in zip(edges[::2], edges[1::2], strict=True)]


def _repeats(values: NDArray[np.float64], length: int) -> list[int]:
    """Where blocks of at least `length` samples start that are copies of earlier ones, constant ones left out."""
    if len(values) < 2 * length:
        return []
    windows = np.lib.stride_tricks.sliding_window_view(values, length)
    weights = np.random.default_rng(0).standard_normal(length)
    sums = np.convolve(values, weights[::-1], mode="valid")  # equal for equal windows up to rounding
    order = np.argsort(sums)
    near = np.flatnonzero(np.diff(sums[order]) < 1e-9 * np.abs(sums).max())
    pairs = [(int(order[n]), int(order[n + 1])) for n in near]
    copies = [max(pair) for pair in pairs if np.array_equal(windows[pair[0]], windows[pair[1]])]
    copies = sorted(n for n in copies if np.ptp(windows[n]) > 0)
    return [next(group)[1] for _, group in groupby(enumerate(copies), key=lambda pair: pair[1] - pair[0])]


def _times(raw: Sampled, samples: list[int]) -> str:
    first = raw.start + samples[0] / raw.rate
    return f"at {first:.2f} s ({len(samples)} such places)" if len(samples) > 1 else f"at {first:.2f} s"
