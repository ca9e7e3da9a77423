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


class Gains:
    """Factors on the EMG of windows, from a generator for each seed.

    Args:
        std: standard deviation of their logarithm [-].
        seeds: numbers of the seeds.
        level: of the scale; each has factors of its own.
    """

    def __init__(self, std: float, seeds: Sequence[int], level: int) -> None:
        self.std = std
        self._random = [torch.Generator().manual_seed(1_000_000 + seed * 100 + level) for seed in seeds]

    def draw(self, *shape: int, like: Tensor) -> Tensor:
        """(S, *shape) [-], with the type and on the device of `like`."""
        logarithm = torch.stack([torch.randn(*shape, generator=random) for random in self._random])
        return (self.std * logarithm).exp().to(like)


class Noise:
    """Noise on the history, from a generator for each seed.

    Args:
        std: standard deviation [rad].
        seeds: numbers of the seeds.
        level: of the scale; each has noise of its own.
    """

    def __init__(self, std: float, seeds: Sequence[int], level: int) -> None:
        self.std = std
        self._random = [torch.Generator().manual_seed(seed * 100 + level) for seed in seeds]

    def draw(self, *shape: int, like: Tensor) -> Tensor:
        """(S, *shape) [rad], with the type and on the device of `like`."""
        noise = torch.stack([torch.randn(*shape, generator=random) for random in self._random])
        return (self.std * noise).to(like)
