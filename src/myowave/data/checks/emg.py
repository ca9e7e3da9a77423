"""Doubts about EMG: of one channel in one trial, or of a pair of channels."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations, groupby

import numpy as np
from scipy.stats import zscore

from myowave.data.checks.finding import Check
from myowave.data.checks.values import EMG_LIMIT
from myowave.data.processing.filters import HIGHEST, band_pass
from myowave.data.processing.sampled import LINE_HEIGHT, Sampled, runs_of
from myowave.data.trials import Array

MAINS_HZ = (50.0, 60.0)
DEAD = 0.01  # scatter of a channel over its median of the session's trials, below which nothing was recorded [-]
SILENT = 1.5  # envelope over that at rest, below which no contraction is to be seen [-]
SPIKE, SPIKE_SHARE = 10.0, 0.001
"""Largest value over that of all but this share of the samples from which it is an artefact [-]: noise that swells to a
contraction as short as 0.1 % of a trial has no more than 2. Also the largest envelope over what is usual."""
CLIPPED_RUN, CLIPPED_RUNS = 3, 3  # samples in a row at the largest or smallest value, and how often: clipping
HELD_S = 0.02  # without any change that counts as a gap [s]; at 2000 Hz noise changes EMG every few samples
REPEATED_S = 0.03  # length of a block that is there twice, sample for sample [s]
SLOW_HZ, SLOW_SHARE = 20.0, 0.15  # below which EMG has little power, and the share that cables and electrodes make
FAST_SHARE = 0.3  # share of the power above `SLOW_HZ` below which a signal is no raw EMG [-]
CROSSTALK, CROSSTALK_S = 0.5, 0.005  # correlation of raw EMG, at any shift up to this [s], that may be one muscle's
ABOVE = 1.001  # EMG that is more than what counts as 1 [-]; resampled, the largest may move by a little
ENDS_S, ENDS_SHARE = 0.05, 0.001  # least difference of starts or durations of EMG and angle [s]; share of durations
BRIEF_S = 0.25
"""Time [s] before and after its largest envelope in which an artefact is over, smoothed to 4 Hz, and a maximum
contraction, which is held for seconds, is not."""
_BAND_HZ = (20.0, 450.0)


@dataclass(frozen=True, eq=False)
class Channel:
    """One channel of EMG in one trial."""

    raw: Sampled  # as recorded
    envelope: Sampled  # in the unit of the raw EMG
    typical: float  # median over the trials of its standard deviation
    resting: float  # its envelope at rest: the lowest `level_of` any trial in which it was recorded
    typical_peak: float  # its usual largest envelope: the median over trials, or `away_from_peak`
    notch_hz: float | None  # of mains hum that the processing takes out [Hz]
    largest: float  # of what counts as 1, once the trial is processed [-]
    angle: Sampled  # of the elbow in the same trial
    late: float = 0.0  # by which the settings moved the EMG onto the angle's clock [s]


def away_from_peak(envelope: Sampled) -> float:
    """Largest envelope of a maximum contraction but for the time in which an artefact is over; 0 where that is all."""
    away = np.abs(envelope.time - envelope.time[envelope.values.argmax()]) > BRIEF_S
    return float(envelope.values.max(initial=0.0, where=away))


def level_of(envelope: Sampled) -> tuple[float, float]:
    """Its 5th and 95th percentile: at rest where the trial has any, and contracted."""
    low, high = np.percentile(envelope.values, [5, 95])
    return float(low), float(high)


def _scatter(of: Channel) -> str:
    return f"scatters by {of.raw.values.std():.2g} {of.raw.unit}, over the session typically by {of.typical:.2g}"


def is_dead(raw: Sampled, typical: float) -> bool:
    """Whether a channel that typically scatters by so much recorded nothing in a trial."""
    scatter = float(raw.values.std())
    return scatter == 0 or scatter < DEAD * typical


def _dead(of: Channel) -> str | None:
    return _scatter(of) if is_dead(of.raw, of.typical) else None


def _of_another_unit(of: Channel) -> str | None:
    return _scatter(of) if of.typical and of.raw.values.std() * DEAD > of.typical else None


def _silent(of: Channel) -> str | None:
    low, high = level_of(of.envelope)
    held = low > SILENT * of.resting  # more than at rest in another trial, as a load is held
    stays = f"the envelope stays between {low:.3g} and {high:.3g} {of.raw.unit}"
    return stays if high < SILENT * low and not held else None


def _spike(of: Channel) -> str | None:
    size, unit = np.abs(of.raw.values - np.median(of.raw.values)), of.raw.unit
    few = max(3, round(SPIKE_SHARE * len(size)))
    at = f"at {of.raw.start + int(size.argmax()) / of.raw.rate:.2f} s"
    if len(size) > few and size.max() > SPIKE * (rest := np.partition(size, -few - 1)[-few - 1]):
        return f"reaches {size.max():.3g} {unit} {at}, and but for {few} samples {rest:.3g} at most"
    if of.envelope.values.max() > SPIKE * of.typical_peak > 0 and not _of_another_unit(of):
        peak = of.envelope.values.max()
        return f"its envelope reaches {peak:.3g} {unit} {at}, and usually {of.typical_peak:.3g} at most"
    return None


def _clipped(of: Channel) -> str | None:
    values = of.raw.values
    ends = {end: sum(n >= CLIPPED_RUN for _, n in runs_of(values == end)) for end in (values.max(), values.min())}
    end, count = max(ends.items(), key=lambda pair: pair[1])
    return f"stays at {end:.4g} {of.raw.unit} {count} times" if count >= CLIPPED_RUNS else None


def _hum(of: Channel) -> str | None:
    lines = {of.raw.line_height(f): f for f in MAINS_HZ if f < of.raw.rate / 2 and f != of.notch_hz}
    height = max(lines, default=0.0)
    if height <= LINE_HEIGHT:
        return None
    frequency = lines[height]
    share = of.raw.share_of_power(frequency - 1, frequency + 1)
    return f"a line at {frequency:g} Hz, {height:.0f} times its neighbourhood, with {share:.1%} of the power"


def _smoothed(of: Channel) -> str | None:
    if of.raw.values.min() >= 0:
        return "never below 0"
    slow = of.raw.share_of_power(0, SLOW_HZ)
    return f"only {100 * (1 - slow):.0f} % of the power is above {SLOW_HZ:g} Hz" if slow > 1 - FAST_SHARE else None


def _not_smoothed(of: Channel) -> str | None:
    fast = of.raw.share_of_power(SLOW_HZ, np.inf)
    return f"{100 * fast:.0f} % of the power is above {SLOW_HZ:g} Hz" if fast > FAST_SHARE else None


def _moved(of: Channel) -> str | None:
    slow = of.raw.share_of_power(0, SLOW_HZ)
    return (
        f"{100 * slow:.0f} % of the power is below {SLOW_HZ:g} Hz" if slow > SLOW_SHARE and not _smoothed(of) else None
    )


def _gap(of: Channel) -> str | None:
    raw = of.raw
    shortest = max(4, round(HELD_S * raw.rate))
    still = [(start, n + 1) for start, n in runs_of(np.diff(raw.values) == 0) if n + 1 >= shortest]
    if not still:
        return None
    longest = max(length for _, length in still) / raw.rate
    return f"does not change for {1000 * longest:.0f} ms, first {_times(raw, [start for start, _ in still])}"


def _copies(of: Channel) -> str | None:
    raw, length = of.raw, max(16, round(REPEATED_S * of.raw.rate))
    if not (starts := _repeats(raw.values, length)):
        return None
    how_long = f"{1000 * length / raw.rate:.0f} ms or more"
    return f"{len(starts)} blocks of {how_long} are copies of earlier ones, first {_times(raw, starts)}"


def _durations(of: Channel) -> str | None:
    """EMG and angle of other lengths, which did not end together on the angle's clock, as one begun later does."""
    emg_s, angle_s = (len(s.values) / s.rate for s in (of.raw, of.angle))
    longer, later = emg_s - angle_s, of.raw.start + emg_s - of.angle.start - angle_s
    apart = min(abs(longer), abs(later)) > max(ENDS_S, ENDS_SHARE * angle_s)
    return f"EMG lasts {emg_s:.3f} s, the angle {angle_s:.3f} s" if apart else None


def _starts(of: Channel) -> str | None:
    """EMG and angle that begin apart in their files, and as the settings have them."""
    (emg, angle), apart = (of.raw, of.angle), of.raw.start - of.angle.start
    if min(abs(apart), abs(apart - of.late)) <= ENDS_S:
        return None
    common = min(emg.end, angle.end) - max(emg.start, angle.start)
    return f"EMG begins at {emg.start:.2f} s, the angle at {angle.start:.2f} s; only the common {common:.2f} s are used"


def _largest_within(low: float, high: float) -> Callable[[Channel], str | None]:
    return lambda of: f"reaches {of.largest:.2f} of what counts as 1" if low < of.largest <= high else None


_LESS_EFFORT = (
    "The scale comes from trials of less effort: train on one of such effort, or name maximum contractions under mvc. "
    "If it is a moment only, look for an artefact and cut it off with cut_s."
)
DEAD_CHANNEL = Check(
    "dead channel", _dead, "The electrode was off or the column is another one: leave the trial or the channel out."
)
CHECKS = (  # of any EMG
    Check("durations", _durations,
          "Where both were started and stopped together, a rate is wrong or a clock drifts: compare rate_hz with the "
          "recorder's. Otherwise say processing.emg_start_offset_s; only the common time is used."),
    Check("starts", _starts,
          "Where both were started together, their clocks differ: say processing.emg_start_offset_s, the first time in "
          "the angle's file less that in the EMG's, or emg_start_offset_s by trial where trials differ. Where all "
          "times are of one clock, cut the trial to what both have with cut_s."),
    Check("EMG above 1", _largest_within(EMG_LIMIT, np.inf), _LESS_EFFORT),
    Check("EMG above 1", _largest_within(ABOVE, EMG_LIMIT), _LESS_EFFORT, "note"),
)  # fmt: skip
ANOTHER_SIZE = Check(
    "EMG of another size",
    _of_another_unit,
    "This trial may be in another unit or of another gain: correct it in the file, or leave the trial out.",
)
ARTEFACT = Check(
    "spike",
    _spike,
    "An artefact, which would count as the largest contraction: cut it off with cut_s, or repair the file there.",
)
MAXIMUM_CHECKS = (ANOTHER_SIZE, ARTEFACT)  # of maximum contractions that are not dead; they may last all the time
LIVE_CHECKS = (  # of any trial that is not dead
    ANOTHER_SIZE,
    Check("no contraction", _silent,
          "Noise only, or a muscle that rests: do not normalise by this trial, and check the electrode."),
    ARTEFACT,
)  # fmt: skip
SMOOTHED_CHECKS = (  # of what is said to be smoothed, and is not dead, besides
    Check("not smoothed", _not_smoothed,
          "An envelope follows the muscle, a few times a second; this looks rectified and no more. Say form: raw and "
          "processing.band_pass_hz: null, which smooths it, or smooth it in the file."),
)  # fmt: skip
RAW_CHECKS = (  # of raw EMG that is not dead, besides
    Check("clipping", _clipped,
          "The recorder's range was too small, so peaks are missing: record with less gain, or leave the trial out."),
    Check("mains hum", _hum,
          "Set processing.notch_hz to this frequency; next time, check the reference electrode."),
    Check("not raw EMG", _smoothed,
          "This looks rectified or smoothed: export the raw signal, or say form: envelope for the channel."),
    Check("power below 20 Hz", _moved,
          "Cables or electrodes moved. The band-pass takes out what is below its lower end; raise that end to 30 Hz "
          "if the envelope follows the motion rather than the muscle."),
    Check("gap", _gap,
          "The recorder filled a gap with one value: cut the trial there with cut_s, or record again."),
    Check("repeated block", _copies,
          "The recorder filled gaps with copies: cut the trial there with cut_s, or record again."),
)  # fmt: skip


def _shared_by_two(emg: Mapping[str, Sampled]) -> str | None:
    """Of raw EMG of a trial by channel: two channels that hold one signal, or its mirror image."""
    pairs = ((one, two, _shared(a, b)) for (one, a), (two, b) in combinations(emg.items(), 2))
    found = [f"{a} and {b} have a correlation of {r:.2f}" for a, b, r in pairs if r is not None and abs(r) > CROSSTALK]
    return "; ".join(found) + f" within {1000 * CROSSTALK_S:g} ms" if found else None


CROSS_TALK = Check(
    "cross-talk",
    _shared_by_two,
    "Electrodes may see one muscle, or share a poor reference: compare the two, and keep the one that is nearer to its "
    "muscle; the effect emg_crosstalk tells the diagnosis of it.",
)


def _shared(a: Sampled, b: Sampled) -> float | None:
    """Largest correlation of two channels in the EMG's band at small shifts; None where their clocks differ, or they
    are too slow for it."""
    if a.rate != b.rate or abs(a.start - b.start) > 0.5 / a.rate or min(a.values.std(), b.values.std()) == 0:
        return None
    if HIGHEST * a.rate <= _BAND_HZ[0]:
        return None
    samples = min(len(a.values), len(b.values))
    x, y = (zscore(band_pass(s.rate, _BAND_HZ, "zero")(s.values[:samples])) for s in (a, b))
    shift = round(CROSSTALK_S * a.rate)
    at_shifts = (x[max(0, k) : samples + min(0, k)] @ y[max(0, -k) : samples - max(0, k)] / (samples - abs(k)) for k in
                 range(-shift, shift + 1))  # fmt: skip
    return float(max(at_shifts, key=abs))


def _repeats(values: Array, length: int) -> list[int]:
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
