"""Whether measured angles stay where the tables of an arm's paths can be trusted."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from myowave.data.trials import Trials
from myowave.physics.path import read_path
from myowave.settings import PathTable


@dataclass(frozen=True)
class Beyond:
    """A trial that leaves the range of a table.

    Args:
        trial: its name.
        share: of its samples that are beyond any of the tables [-].
        angle: its angle farthest beyond the table of `muscle` [deg].
        distance: how far beyond [deg]; `margin` says how far may be [deg].
        ends: of that table [deg], which is in `file`.
    """

    trial: str
    share: float
    angle: float
    distance: float
    margin: float
    muscle: str
    file: str
    ends: tuple[float, float]

    @property
    def too_far(self) -> bool:
        return self.distance > self.margin

    def describe(self) -> str:
        """In words, without the trial's name."""
        return (
            f"{100 * self.share:.2g} % of the samples are beyond the tables of path lengths, up to {self.distance:.3g} "
            f"deg; moment arms there are those at the tables' ends"
        )


def beyond_tables(trials: Trials, tables: Mapping[str, PathTable]) -> list[Beyond]:
    """The trials that leave the range of a table, each with the table that it leaves farthest beyond its margin.

    Args:
        tables: paths of an arm that are given by a table, by muscle.

    Raises:
        ValueError: for a faulty table.
    """
    ranges = {muscle: read_path(table.file, table.muscle).range for muscle, table in tables.items()}
    found = []
    for trial, angles, length in zip(trials.names, trials.angle, trials.lengths, strict=True):
        angle = angles[:length]
        outside = {muscle: np.maximum(low - angle, angle - high) for muscle, (low, high) in ranges.items()}
        excess = {m: float(out.max()) - math.radians(tables[m].margin_deg) for m, out in outside.items()}
        if not any((out > 0).any() for out in outside.values()):
            continue
        worst = max(excess, key=excess.__getitem__)
        n = int(outside[worst].argmax())
        low, high = ranges[worst]
        found.append(
            Beyond(
                trial=trial,
                share=float(np.any([out > 0 for out in outside.values()], axis=0).mean()),
                angle=math.degrees(angle[n]),
                distance=math.degrees(outside[worst][n]),
                margin=tables[worst].margin_deg,
                muscle=worst,
                file=tables[worst].file,
                ends=(math.degrees(low), math.degrees(high)),
            )
        )
    return found


def table_problems(found: Sequence[Beyond]) -> Iterator[str]:
    """Trials that go farther beyond a table than its margin."""
    for one in found:
        if one.too_far:
            low, high = one.ends
            yield (
                f"trial {one.trial}: the angle is {one.angle:.4g} deg, {one.distance:.3g} deg beyond the table of "
                f"muscle {one.muscle} ({one.file}, {low:.4g} to {high:.4g} deg); expected at most {one.margin:g} deg "
                "beyond. Cut the trial, extend the table, or raise the path's margin_deg if the moment arm may be "
                "taken as constant so far."
            )
