"""Whether measured angles stay where the tables of an arm's paths can be trusted."""

import math
from collections.abc import Mapping
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
        found: how much of it is beyond any of the tables, and how far, in words.
        problem: the same, where it goes too far beyond one; else empty.
    """

    trial: str
    found: str
    problem: str


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
        share, distance = np.any([out > 0 for out in outside.values()], axis=0).mean(), math.degrees(outside[worst][n])
        words = (
            f"{100 * share:.2g} % of the samples are beyond the tables of path lengths, up to {distance:.3g} deg; "
            "moment arms there are those at the tables' ends"
        )
        table, (low, high) = tables[worst], map(math.degrees, ranges[worst])
        problem = (
            f"trial {trial}: the angle is {math.degrees(angle[n]):.4g} deg, {distance:.3g} deg beyond the table of "
            f"muscle {worst} ({table.file}, {low:.4g} to {high:.4g} deg); expected at most {table.margin_deg:g} deg "
            "beyond. Cut the trial, extend the table, or raise the path's margin_deg if the moment arm may be taken as "
            "constant so far."
        )
        found.append(Beyond(trial, words, problem if distance > table.margin_deg else ""))
    return found
