"""Test functions w = (1 - s^2)^3 over windows of a motion, s from -1 to 1 in each, and curves between samples.

Test functions vanish with two derivatives at both ends, so that int w qddot dt = int w'' q dt holds no derivative of
the angle: second differences, which amplify every error, do not appear.

Shapes: ... batch, T trials, N samples, D points in a step, K windows.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from torch import Tensor

from myowave.data.trials import Array

Lengths = Sequence[int] | NDArray[np.int64]

TEST = Polynomial([1.0, 0.0, -1.0]) ** 3
UNIT = np.array([0.0, 1.0])
SPLINE = 5  # order of the curve through the measured angles


@dataclass(frozen=True)
class Windows:
    """Test functions over trials."""

    half: int  # half width in steps
    stride: int  # steps from one window to the next
    dt: float  # length of a step [s]
    inside: NDArray[np.bool_]  # which lie within the recorded part, (T, K)
    points: Tensor  # where in a step values are known, fractions of it, (D,), and their `weights`, which add up to 1
    weights: Tensor
    coarse: int = 1  # samples in a step

    @classmethod
    def over(cls, lengths: Lengths, dt: float, half: int, stride: int, points: Tensor, weights: Tensor) -> "Windows":
        """Windows over trials of so many samples, in steps of one sample."""
        starts = np.arange(0, max(lengths) - 2 * half, stride)
        return cls(half, stride, dt, starts + 2 * half < np.asarray(lengths)[:, None], points, weights)

    def merged(self, coarse: int) -> "Windows":
        """The same windows in steps of so many samples, which divide `half` and `stride`, with two points each."""
        half, stride, dt = self.half // coarse, self.stride // coarse, self.dt * coarse
        return Windows(half, stride, dt, self.inside, *gauss(2), coarse)

    def positions(self, samples: int) -> Tensor:
        """Where values are known in trials of so many samples, in samples, (steps, D)."""
        return (torch.arange((samples - 1) // self.coarse, dtype=torch.float64)[:, None] + self.points) * self.coarse

    def kernel(self, derivative: int = 0) -> Tensor:
        """How much values in a window count in int w values dt, or that of a derivative of w by time, (2 half D,)."""
        s = (torch.arange(-self.half, self.half)[:, None] + self.points) / self.half
        test = torch.from_numpy(TEST.deriv(derivative)(s.numpy())) / (self.half * self.dt) ** derivative
        return (test * (self.weights * self.dt)).flatten()

    def each(self, values: Tensor) -> Tensor:
        """Values (..., steps, D) within every window, (..., K, 2 half D)."""
        flat, size = values.flatten(-2), 2 * self.half * len(self.points)
        if flat.shape[-1] < size:
            return values.new_zeros(*flat.shape[:-1], 0, size)
        return flat.unfold(-1, size, self.stride * len(self.points))

    def integrate(self, values: Tensor, derivative: int = 0) -> Tensor:
        """int w values dt, or that of a derivative of w by time, over every window: (..., steps, D) to (..., K)."""
        return self.each(values) @ self.kernel(derivative)

    def noise(self) -> float:
        """Standard deviation of int w'' q dt for white noise of standard deviation 1 in the samples of q."""
        samples = 6 * self.half + 1
        fine = between(np.eye(samples), [samples] * samples, self.positions(samples))
        weights = self.integrate(fine, derivative=2).numpy()
        return float(np.sqrt((weights[:, weights.shape[1] // 2] ** 2).sum()))


def between(values: Array, lengths: Lengths, position: Tensor, derivative: int = 0) -> Tensor:
    """The curve through values (T, N), or its derivative by samples, at positions (n, D) in samples, (T, n, D).

    Constant beyond a trial's end; a trial too short for a curve holds 0.
    """
    fine = np.zeros((len(values), *position.shape))
    for trial, length in enumerate(lengths):
        if length > SPLINE:
            curve = make_interp_spline(np.arange(length, dtype=np.float64), values[trial, :length], k=SPLINE)
            fine[trial] = curve(position.numpy().clip(max=length - 1), derivative)
    return torch.from_numpy(fine)


def gauss(count: int, edges: Array = UNIT) -> tuple[Tensor, Tensor]:
    """Points (D,) and weights of Gauss-Legendre integration, so many between each two edges of pieces of a step."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    width = np.diff(edges)[:, None]
    points = edges[:-1, None] + width * (nodes + 1) / 2
    return torch.from_numpy(points.ravel()), torch.from_numpy((width * weights / 2).ravel())


def between_kinks(split: Tensor) -> tuple[Tensor, Tensor]:
    """Gauss-Legendre points (D,) between the kinks of the EMG, fractions of a step, and their weights."""
    split = split.reshape(-1, split.shape[-1]).cpu()
    # ASSUME: kinks are cut out only where all trials have them at the same place; else finer pieces do.
    edges = split[0].numpy() if bool((split == split[0]).all()) else np.linspace(0, 1, 5)
    return gauss(2, edges)
