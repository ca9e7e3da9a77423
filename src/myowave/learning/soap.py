"""SOAP: Adam in the basis where the gradient of a layer is least correlated. A rollout bends its loss so unevenly that
Adam, which scales each weight by itself, needs several times as many steps.

Shapes: S seeds, I inputs and O outputs of a layer.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

EPSILON = 1e-5  # of the largest coordinate of a gradient: smaller ones may be rounding, which must not be scaled up
MEMORY = 0.98  # of the gradient's covariances
EVERY = 5  # steps between two looks for the basis


class Soap:
    """Moves weights against their gradients. Source: Vyas et al. 2025, SOAP: Improving and Stabilizing Shampoo using
    Adam, Algorithm 3; here the basis is that of the first gradient from the first step on, and found anew without a
    shortcut.

    Args:
        moved: leaves of the graph, (S, I, O) each; those with as many outputs are one layer, their inputs side by side,
            as what they give is added up. One without a gradient stays where it is.
        betas: how slowly the two moments of a gradient forget the steps before.
    """

    def __init__(self, moved: Sequence[Tensor], betas: tuple[float, float]) -> None:
        self._moved, self._betas = list(moved), betas
        self._layers: dict[int, _Layer] = {}  # by the number of outputs

    def forget_gradients(self) -> None:
        """Begin a step: gradients add up from here."""
        for tensor in self._moved:
            tensor.grad = None

    @torch.no_grad()
    def step(self, rate: float) -> None:
        """Move against the gradients, each coordinate of the basis by about `rate`."""
        layers: dict[int, list[Tensor]] = {}
        for tensor in self._moved:
            if tensor.grad is not None:
                layers.setdefault(tensor.shape[-1], []).append(tensor)
        for width, tensors in layers.items():
            gradient = torch.cat([tensor.grad for tensor in tensors if tensor.grad is not None], 1)
            layer = self._layers.setdefault(width, _Layer.like(gradient))
            move = layer.towards(gradient, self._betas)
            for tensor, part in zip(tensors, move.split([t.shape[1] for t in tensors], 1), strict=True):
                tensor.sub_(rate * part)


@dataclass
class _Layer:
    """What SOAP remembers of a layer.

    Args:
        over_inputs, over_outputs: covariances of the gradient, (S, I, I) and (S, O, O).
        of_inputs, of_outputs: their eigenvectors.
        mean: of the gradient, (S, I, O).
        square: mean square of the gradient in the basis of both, (S, I, O).
        steps: that it has taken.
    """

    over_inputs: Tensor
    over_outputs: Tensor
    of_inputs: Tensor
    of_outputs: Tensor
    mean: Tensor
    square: Tensor
    steps: int = 0

    @classmethod
    def like(cls, gradient: Tensor) -> "_Layer":
        over_inputs, over_outputs = (torch.zeros_like(product) for product in _products(gradient))
        zero = torch.zeros_like(gradient)
        return cls(over_inputs, over_outputs, over_inputs, over_outputs, zero, zero.clone())

    def towards(self, gradient: Tensor, betas: tuple[float, float]) -> Tensor:
        """Take a gradient (S, I, O) into account; where to move against, each coordinate of the basis by about 1."""
        self.steps += 1
        for covariance, product in zip((self.over_inputs, self.over_outputs), _products(gradient), strict=True):
            covariance.lerp_(product, 1 - MEMORY)
        if self.steps % EVERY == 1:
            self.of_inputs, self.of_outputs = _eigenvectors(self.over_inputs), _eigenvectors(self.over_outputs)
        self.mean.lerp_(gradient, 1 - betas[0])
        self.square.lerp_(self._turned(gradient).square(), 1 - betas[1])
        mean, square = (
            self._turned(self.mean) / (1 - betas[0] ** self.steps),
            self.square / (1 - betas[1] ** self.steps),
        )
        size = square.sqrt()
        floor = (EPSILON * size.amax((-2, -1), keepdim=True)).clamp(min=torch.finfo(size.dtype).tiny)
        return self.of_inputs @ (mean / (size + floor)) @ self.of_outputs.mT

    def _turned(self, values: Tensor) -> Tensor:
        return self.of_inputs.mT @ values @ self.of_outputs


def _products(gradient: Tensor) -> tuple[Tensor, Tensor]:
    return gradient @ gradient.mT, gradient.mT @ gradient


def _eigenvectors(covariance: Tensor) -> Tensor:
    """In the order of their eigenvalues, (S, n, n); of a seed whose gradient is no number, some orthogonal basis."""
    return torch.linalg.eigh(covariance.nan_to_num(0.0, 0.0, 0.0)).eigenvectors
