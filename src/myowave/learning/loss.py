"""What the losses of all recipes have in common.

Losses are kept apart by seed, so that a seed trains the same by itself or among others.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class Losses:
    """Loss of each seed and its parts, (S,) each: `data` [rad^2], `residual` [(N m)^2], weights not in them."""

    total: Tensor
    data: Tensor
    residual: Tensor


class Noise:
    """Normal numbers to disturb what a network sees, from a generator for each seed.

    Args:
        std: standard deviation, in the unit of what is disturbed.
        level: of the scale; each has noise of its own.
        stream: of what is disturbed; each has noise of its own.
    """

    def __init__(self, std: float, seeds: Sequence[int], level: int, stream: int = 0) -> None:
        self.std = std
        self._random = [torch.Generator().manual_seed(stream * 1_000_000 + seed * 100 + level) for seed in seeds]

    def draw(self, *shape: int, like: Tensor) -> Tensor:
        """(S, *shape), with the type and on the device of `like`."""
        noise = torch.stack([torch.randn(*shape, generator=random) for random in self._random])
        return (self.std * noise).to(like)
