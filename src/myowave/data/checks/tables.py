"""Whether measured angles stay where the tables of an arm's paths can be trusted."""

from collections.abc import Mapping

import numpy as np

from myowave.data.checks.finding import Finding
from myowave.data.trials import Trials
from myowave.physics.path import read_path
from myowave.settings import PathTable


def beyond_tables(trials: Trials, tables: Mapping[str, PathTable]) -> tuple[list[Finding], list[str]]:
    """What is found of trials that leave the range of a table, and problems of those that leave one too far.

    Args:
        tables: paths of an arm that are given by a table, by muscle.

    Raises:
        ValueError: for a faulty table.
    """
    ranges = {muscle: np.degrees(read_path(table.file, table.muscle).range) for muscle, table in tables.items()}
    findings, problems = [], []
    for trial, angles, length in zip(trials.names, np.degrees(trials.angle), trials.lengths, strict=True):
        angle = angles[:length]
        outside = {muscle: np.maximum(low - angle, angle - high) for muscle, (low, high) in ranges.items()}
        if not any((out > 0).any() for out in outside.values()):
            continue
        muscle = max(outside, key=lambda m: outside[m].max() - tables[m].margin_deg)
        n, table, (low, high) = int(outside[muscle].argmax()), tables[muscle], ranges[muscle]
        share, distance = np.any([out > 0 for out in outside.values()], axis=0).mean(), outside[muscle][n]
        found = f"{100 * share:.2g} % of the samples are beyond the tables of path lengths, up to {distance:.3g} deg"
        found += "; moment arms there are those at the tables' ends"
        do = "Doubt torques at these angles: extend the tables if the muscles' paths are known there."
        findings.append(Finding("angle beyond the tables", found, do, trial, "angle", "note"))
        if distance - table.margin_deg > 1e-9:  # rounding of degrees decides nothing
            problems.append(
                f"trial {trial}: the angle is {angle[n]:.4g} deg, {distance:.3g} deg beyond the table of muscle "
                f"{muscle} ({table.file}, {low:.4g} to {high:.4g} deg); expected at most {table.margin_deg:g} deg "
                "beyond. Cut the trial, extend the table, or raise the path's margin_deg if the moment arm may be "
                "taken as constant so far."
            )
    return findings, problems
