"""A muscle's path over the joint: its length at every elbow angle, and its moment arm R = -d length / dq.

A torque is force times R and a shortening velocity R qdot, so the muscle does the work that the joint receives. Each
kind of path gives both from one formula. A path holds numbers in a muscle's description and tensors
in a model with values.

Shapes: q and constants broadcast; in a model with values they have the muscles on the last axis, (..., M).
"""

import csv
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path as File
from typing import ClassVar, Self

import numpy as np
import torch
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from torch import Tensor

from myowave.physics.constants import MUSCLE_CONSTANTS, names_of
from myowave.physics.cubics import Cubics

FEWEST_ROWS = 4  # of a table: a cubic spline has no fewer
FINER, MOST_CELLS = 4, 2000  # cells of an uneven table: how many in its smallest step, and how many in all
ANGLE_COLUMNS = {"angle_deg": math.pi / 180, "angle_rad": 1.0}
HALF_TURN = {"angle_deg": 180.0, "angle_rad": math.pi}
LENGTH_COLUMN, MUSCLE_COLUMN = "length_m", "muscle"
LONGEST = 5.0  # m, of a muscle-tendon unit: in mm it would be longer


@dataclass(frozen=True, eq=False)  # a kind says itself whether two of its paths are equal
class Path(ABC):
    """What a path of any kind does."""

    kind: ClassVar[str]

    @property
    def constants(self) -> dict[str, Tensor | float]:
        """Constants of the path by name: parameters of a model that has such a muscle."""
        return {name: getattr(self, name) for name in names_of(MUSCLE_CONSTANTS, self.kind)}

    @classmethod
    @abstractmethod
    def side_by_side(cls, paths: Sequence[Self], constants: Mapping[str, Tensor]) -> Self:
        """The paths of M muscles as one, for angles with the muscles on the last axis, with constants (..., M)."""

    @abstractmethod
    def length_and_arm(self, q: Tensor) -> tuple[Tensor, Tensor]:
        """Length of the muscle-tendon unit [m] and moment arm [m], flexing positive, at elbow angles [rad]."""


@dataclass(frozen=True)
class StraightPath(Path):
    """A straight line over the hinge.

    Args:
        l1, l2: distances of origin and insertion from the joint [m].
        side: +1 for a flexor, -1 for an extensor.

    Source: law of cosines and Eqs. 57-59 for the geometry of Taneja et al. 2023, Fig. 6.
    """

    l1: Tensor | float
    l2: Tensor | float
    side: Tensor | float
    kind: ClassVar[str] = "straight"

    @classmethod
    def side_by_side(cls, paths: Sequence["StraightPath"], constants: Mapping[str, Tensor]) -> "StraightPath":
        return cls(**constants, side=constants["l1"].new_tensor([p.side for p in paths]))

    @cached_property
    def _squares(self) -> Tensor | float:
        return self.l1**2 + self.l2**2

    @cached_property
    def _product(self) -> Tensor | float:
        return self.side * self.l1 * self.l2

    def length_and_arm(self, q: Tensor) -> tuple[Tensor, Tensor]:
        length = torch.sqrt(self._squares + 2.0 * self._product * torch.cos(q))
        return length, self._product * torch.sin(q) / length


@dataclass(frozen=True, eq=False)
class TablePath(Path):
    """A measured or computed path: a cubic spline through a table, straight beyond its ends. See `through`.

    ASSUME: beyond a table's ends the moment arm stays as it is there; the settings say how far that can be trusted.
    """

    cubics: Cubics  # length [m] over the elbow angle [rad]
    range: tuple[float, float]  # first and last angle of the table [rad]; that all have, where it is several
    scale: Tensor | float = 1.0  # factor on the length, and so on the moment arm [-]
    kind: ClassVar[str] = "table"

    @classmethod
    def through(cls, angle: ArrayLike, length: ArrayLike) -> "TablePath":
        """The path through a table: increasing elbow angles [rad] and lengths of the muscle-tendon unit [m].

        Evenly spaced rows are the spline's own knots. An uneven table's spline is put on even, finer cells.
        """
        angle, length = np.asarray(angle, dtype=float), np.asarray(length, dtype=float)
        steps = np.diff(angle)
        assert len(angle) >= FEWEST_ROWS and (steps > 0).all() and np.isfinite(length).all()
        even = np.allclose(steps, steps[0], rtol=1e-6)
        cells = len(steps) if even else min(MOST_CELLS, FINER * math.ceil((angle[-1] - angle[0]) / steps.min()))
        spline = CubicSpline(angle, length)
        knots = np.linspace(angle[0], angle[-1], cells + 1)
        return cls(Cubics.through(knots, spline(knots), spline(knots, 1)), (float(angle[0]), float(angle[-1])))

    @classmethod
    def side_by_side(cls, paths: Sequence["TablePath"], constants: Mapping[str, Tensor]) -> "TablePath":
        cubics, scale = _side_by_side(tuple(p.cubics for p in paths)), constants["scale"]
        shared = max(p.range[0] for p in paths), min(p.range[1] for p in paths)
        return cls(cubics.to(scale.dtype, scale.device), shared, scale)

    def length_and_arm(self, q: Tensor) -> tuple[Tensor, Tensor]:
        length, slope = self.cubics.value_and_slope(q)
        return self.scale * length, -self.scale * slope


_side_by_side = lru_cache(16)(Cubics.side_by_side)  # of the few arms that a process has


@dataclass(frozen=True, eq=False)
class SideBySide:
    """Paths of several kinds, for angles with the muscles on the last axis: those of one kind at once."""

    places: tuple[tuple[int, ...], ...]  # of the muscles of each kind
    paths: tuple[Path, ...]  # all of that kind as one

    def length_and_arm(self, q: Tensor) -> tuple[Tensor, Tensor]:
        """As `Path.length_and_arm`, (..., M) each, one muscle after the other in memory."""
        angle, order = q.movedim(-1, 0), np.argsort(np.concatenate(self.places)).tolist()
        parts = zip(self.places, self.paths, strict=True)
        both = [path.length_and_arm(angle[list(places)].movedim(0, -1)) for places, path in parts]
        each = ([of for part in parts for of in part.unbind(-1)] for parts in zip(*both, strict=True))
        length, arm = (torch.stack(torch.broadcast_tensors(*(of[i] for i in order))).movedim(0, -1) for of in each)
        return length, arm


def read_path(file: str, muscle: str | None = None) -> TablePath:
    """The path in a CSV file with columns `angle_deg` or `angle_rad` and `length_m`, one row per angle.

    Args:
        muscle: whose rows to take, where the file has a column `muscle`. Other columns do not matter.

    Raises:
        ValueError: for a file or a row that is not as it should be; the message says which, and what to do.
    """
    if not File(file).is_file():
        raise ValueError(f"{file}: no such table of a muscle's path; correct the muscle's path.file.")
    try:
        with open(file, newline="", encoding="utf-8-sig") as stream:
            reader = csv.DictReader(stream)
            columns = reader.fieldnames or ()
            rows = [(reader.line_num, row) for row in reader]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{file}: this is not a CSV table in UTF-8 ({error}). Save it as such.") from None
    angle_column = _check_columns(file, columns, muscle)
    for line, row in rows:
        if None in row.values():
            raise ValueError(f"{file}, line {line}: has fewer values than the table has columns. Write one in each.")
    if muscle is not None:
        known = sorted({row[MUSCLE_COLUMN] for _, row in rows})
        rows = [(line, row) for line, row in rows if row[MUSCLE_COLUMN] == muscle]
        if not rows:
            raise ValueError(f"{file}: has no rows of muscle {muscle!r}; it has {', '.join(known)}.")
    if len(rows) < FEWEST_ROWS:
        raise ValueError(f"{file}: has {len(rows)} rows; a path needs at least {FEWEST_ROWS}, better one every 5 deg.")
    angle, length = ([_number(file, line, row, c) for line, row in rows] for c in (angle_column, LENGTH_COLUMN))
    for (line, _), before, here in zip(rows, [-math.inf, *angle[:-1]], angle, strict=True):
        if abs(here) > HALF_TURN[angle_column]:
            raise ValueError(
                f"{file}, line {line}: {angle_column} is {here:g}; expected -{HALF_TURN[angle_column]:.4g} to "
                f"{HALF_TURN[angle_column]:.4g}. Correct the column's name or its unit."
            )
        if here <= before:
            raise ValueError(
                f"{file}, line {line}: {angle_column} goes from {before:g} to {here:g}; angles must increase from row "
                "to row. Sort the table, and keep one row for each angle."
            )
    for (line, _), value in zip(rows, length, strict=True):
        if not 0 < value <= LONGEST:
            raise ValueError(
                f"{file}, line {line}: {LENGTH_COLUMN} is {value:g}; expected above 0, at most {LONGEST:g} m. Write "
                "lengths in metres."
            )
    return TablePath.through(np.array(angle) * ANGLE_COLUMNS[angle_column], length)


def _check_columns(file: str, found: Sequence[str], muscle: str | None) -> str:
    """The column of angles, if the others are there too."""
    angles = [name for name in ANGLE_COLUMNS if name in found]
    expected = "expected one of angle_deg and angle_rad, and length_m"
    if len(angles) != 1 or LENGTH_COLUMN not in found:
        raise ValueError(f"{file}: {expected}; found {', '.join(found) or 'none'}. Rename or add columns.")
    if muscle is not None and MUSCLE_COLUMN not in found:
        raise ValueError(f"{file}: has no column {MUSCLE_COLUMN}, so path.muscle cannot choose rows; leave it out.")
    if muscle is None and MUSCLE_COLUMN in found:
        raise ValueError(f"{file}: holds several muscles (column {MUSCLE_COLUMN}); say which with path.muscle.")
    return angles[0]


def _number(file: str, line: int, row: Mapping[str, str], column: str) -> float:
    try:
        value = float(row[column])
    except (TypeError, ValueError):
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"{file}, line {line}: {column} is {row[column]!r}; expected a number.")
    return value
