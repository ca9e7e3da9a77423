"""Windows over a motion in which torques are compared: test functions w = (1 - s^2)^3 over a half width of 0.15 s.

They vanish with two derivatives at both ends, so that int w qddot dt = int w'' q dt holds no derivative of the angle.

Shapes: ... batch, T trials, N samples, D points in a step, K windows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from torch import Tensor

Array = NDArray[np.float64]

HALF_WIDTH_S = 0.15  # an elbow's motion is slower
FEWEST = 3  # steps in a half width
OVERLAP = 2  # windows stand half of their half width apart
SPLINE = 5  # order of the curve through the measured angles, which w'' weighs
NODES, SHARES = np.polynomial.legendre.leggauss(3)
POINTS, WEIGHTS = (NODES + 1) / 2, SHARES / 2  # in a step
MIDDLE = np.array([0.5])


@dataclass(frozen=True)
class Windows:
    """Test functions over trials.

    Args:
        half: half width in steps.
        stride: steps from one window to the next.
        dt: length of a step [s].
        inside: which lie within the recorded part, (T, K).
        points: where in a step values are known, fractions of it, (D,), and their `weights`.
    """

    half: int
    stride: int
    dt: float
    inside: NDArray[np.bool_]
    points: Array
    weights: Array

    @classmethod
    def over(cls, lengths: Sequence[int] | NDArray[np.int64], dt: float, coarse: int = 1) -> "Windows":
        """Windows over trials of so many samples, whose half width is a multiple of `coarse` steps."""
        half = coarse * max(FEWEST, round(HALF_WIDTH_S / dt / coarse))
        stride = coarse * max(1, half // coarse // OVERLAP)
        starts = np.arange(0, max(lengths) - 2 * half, stride)
        return cls(half, stride, dt, starts + 2 * half < np.asarray(lengths)[:, None], POINTS, WEIGHTS)

    def merged(self, coarse: int) -> "Windows":
        """The same windows in steps of so many samples, with one point in the middle of each step."""
        # ASSUME: what muscles and gravity do is smooth within such a step; w is, too, so middles integrate it well.
        return Windows(self.half // coarse, self.stride // coarse, self.dt * coarse, self.inside, MIDDLE, np.ones(1))

    def integrate(self, values: Tensor, *, second: bool = False) -> Tensor:
        """int w values dt, or int w'' values dt, over every window: (..., steps, D) to (..., K)."""
        s = (np.arange(-self.half, self.half)[:, None] + self.points) / self.half
        curved = (30 * s**2 - 6) * (1 - s**2) / (self.half * self.dt) ** 2
        test = curved if second else (1 - s**2) ** 3
        kernel = torch.from_numpy((test * self.weights * self.dt).ravel())
        flat = values.flatten(-2)
        if flat.shape[-1] < len(kernel):
            return values.new_zeros(*flat.shape[:-1], 0)
        return flat.unfold(-1, len(kernel), self.stride * len(self.points)) @ kernel

    def accelerated(self, angle: Array, lengths: Sequence[int] | NDArray[np.int64]) -> Tensor:
        """int w'' q dt of a measured angle (T, N) [rad/s], (T, K)."""
        fine = np.zeros((len(angle), angle.shape[1] - 1, len(self.points)))
        for trial, length in enumerate(lengths):
            if length > SPLINE:
                spline = make_interp_spline(np.arange(length), angle[trial, :length], k=SPLINE)
                at = (np.arange(length - 1)[:, None] + self.points).ravel()
                fine[trial, : length - 1] = spline(at).reshape(length - 1, -1)
        return self.integrate(torch.from_numpy(fine), second=True)
