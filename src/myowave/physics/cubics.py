"""Curves given by value and slope at even steps: cubic between them, straight beyond both ends.

Shapes: M curves side by side, on the last axis of what they are looked up at.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline
from torch import Tensor


@dataclass(frozen=True, eq=False)
class Cubics:
    """A piecewise cubic curve with a continuous slope, made with `through`, or several, made with `side_by_side`."""

    # Of several curves all but the coefficients are (M,).
    low: float | Tensor  # where the first cell begins, one step before the curve does
    width: float | Tensor  # of a cell
    # of c0 + c1 t + c2 t^2 + c3 t^3 with t in [0, 1] across a cell, (4, cells + 2), one curve after the other; the
    # outermost cells are straight lines
    coefficients: Tensor
    first: int | Tensor  # place of the first cell's coefficients, and how many cells farther the last one's are, `last`
    last: float | Tensor

    @classmethod
    def through(cls, x: NDArray[np.float64], y: NDArray[np.float64], slope: NDArray[np.float64]) -> "Cubics":
        """The curve with these values and slopes at even steps `x`, each (cells + 1,), in double precision."""
        width = x[1] - x[0]
        cubics = CubicHermiteSpline(x, y, slope).c[::-1] * width ** np.arange(4.0)[:, None]
        first, last = slope[0] * width, slope[-1] * width
        coefficients = np.column_stack([[y[0] - first, first, 0.0, 0.0], cubics, [y[-1], last, 0.0, 0.0]])
        return cls(float(x[0] - width), float(width), torch.from_numpy(coefficients), 0, coefficients.shape[1] - 1.0)

    @classmethod
    def side_by_side(cls, curves: Sequence["Cubics"]) -> "Cubics":
        """Several curves as one, in double precision, each of an entry of the last axis."""
        low, width, last = torch.tensor([(c.low, c.width, c.last) for c in curves], dtype=torch.float64).unbind(1)
        cells = torch.tensor([c.coefficients.shape[1] for c in curves])
        return cls(low, width, torch.cat([c.coefficients for c in curves], 1), cells.cumsum(0) - cells, last)

    def to(self, dtype: torch.dtype, device: torch.device) -> "Cubics":
        """The same in another precision or on another device."""
        numbers = {name: getattr(self, name) for name in ("low", "width", "coefficients", "last")}
        moved = {n: x.to(dtype=dtype, device=device) if isinstance(x, Tensor) else x for n, x in numbers.items()}
        return replace(self, **moved, first=self.first.to(device) if isinstance(self.first, Tensor) else self.first)

    def value(self, x: Tensor) -> Tensor:
        """The curve, element-wise; not a number where x is none."""
        t, (c0, c1, c2, c3) = self._look_up(x)
        return c0 + t * (c1 + t * (c2 + t * c3))

    def value_and_slope(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """The curve and its derivative, element-wise."""
        t, (c0, c1, c2, c3) = self._look_up(x)
        return c0 + t * (c1 + t * (c2 + t * c3)), (c1 + t * (2.0 * c2 + 3.0 * t * c3)) / self.width

    def _look_up(self, x: Tensor) -> tuple[Tensor, list[Tensor]]:
        position = (x - self.low) / self.width
        cell = position.detach().clamp(min=0.0).clamp(max=self.last).nan_to_num_(0.0).floor_()
        # One coefficient after the other, as x lies in memory: what is done with them then runs along it.
        strides = position.stride()
        order = sorted(range(x.ndim), key=lambda axis: -strides[axis])
        lying = (cell.long() + self.first).permute(order)
        flat, back = lying.reshape(-1), [order.index(axis) for axis in range(x.ndim)]
        found = [of_all.index_select(0, flat).view(lying.shape).permute(back) for of_all in self.coefficients]
        return position - cell, found
