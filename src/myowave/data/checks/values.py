"""Whether every cell holds a finite number, and whether there are enough of them."""

from collections.abc import Iterator

from myowave.data.readers import RawRecording

SHORTEST = 50
"""Fewest samples of a trial [-]; training needs windows, diagnosis degrees of freedom."""


def value_problems(recording: RawRecording) -> Iterator[str]:
    """The first cell of each column that is no finite number."""
    for signal in recording.signals:
        if signal.odd:
            sample, found = next(iter(signal.odd.items()))
            comma = isinstance(found, str) and "," in found
            yield (
                f"{recording.at(sample)}: {signal.name} is {found if isinstance(found, float) else repr(found)} "
                f"({len(signal.odd)} such rows); expected a finite number. "
                + ("Write decimals with a point." if comma else "Fill the gap, or cut the file there.")
            )


def length_problems(recording: RawRecording) -> Iterator[str]:
    """A file that is too short."""
    samples = min(len(signal.values) for signal in recording.signals)
    if samples < SHORTEST:
        yield (
            f"{recording.path}: {samples} samples; expected at least {SHORTEST}. Record longer, or leave the trial out."
        )
