"""What moves weights against their gradients: Adam, and SOAP, which is Adam in the basis where the gradient of a layer
is least correlated. A rollout bends its loss so unevenly that Adam, which scales each weight by itself, needs several
times as many steps.

Shapes: S seeds, I inputs and O outputs of a layer.
"""

from collections.abc import Iterable

import torch
from torch import Tensor

SMALLEST = 1e-5  # of SOAP, of the largest coordinate: smaller ones may be rounding, which must not be scaled up
MEMORY = 0.98  # of the gradient's covariances
EVERY = 5  # steps between two looks for the basis


class Adam(torch.optim.AdamW):
    """Torch's, each step of a rate of its own.

    Args:
        moved: leaves of the graph; one without a gradient stays where it is.
        betas: how slowly the two moments of a gradient forget the steps before.
        decay: share of the rate that tensors decay by in a step.
    """

    def __init__(self, moved: Iterable[Tensor], betas: tuple[float, float], decay: float = 0.0) -> None:
        super().__init__(moved, betas=betas, weight_decay=decay)

    def move(self, rate: float) -> None:
        """Move against the gradients, each coordinate by about `rate`."""
        self.param_groups[0]["lr"] = rate
        self.step()


class Soap:
    """Source: Vyas et al. 2025, SOAP: Improving and Stabilizing Shampoo using Adam, Algorithms 3 and 4; here the basis
    is that of the first gradient from the first step on.

    Args:
        moved: leaves of the graph, (S, I, O) each; those with as many outputs are one layer, their inputs side by side,
            as what they give is added up. One without a gradient stays where it is.
    """

    def __init__(self, moved: Iterable[Tensor], betas: tuple[float, float]) -> None:
        self._moved, self._betas = list(moved), betas
        self._layers: dict[int, _Layer] = {}  # by the number of outputs

    def zero_grad(self) -> None:
        """Begin a step: gradients add up from here."""
        for tensor in self._moved:
            tensor.grad = None

    @torch.no_grad()
    def move(self, rate: float) -> None:
        """Move against the gradients, each coordinate of the basis by about `rate`."""
        layers: dict[int, list[Tensor]] = {}
        for tensor in self._moved:
            if tensor.grad is not None:
                layers.setdefault(tensor.shape[-1], []).append(tensor)
        for width, tensors in layers.items():
            gradient = torch.cat([tensor.grad for tensor in tensors if tensor.grad is not None], 1)
            if width not in self._layers:
                self._layers[width] = _Layer(gradient)
            move = self._layers[width].towards(gradient, self._betas)
            for tensor, part in zip(tensors, move.split([t.shape[1] for t in tensors], 1), strict=True):
                tensor.sub_(rate * part)


class _Layer:
    """What SOAP remembers of a layer whose gradient is (S, I, O): covariances over its inputs (S, I, I) and outputs
    (S, O, O) and their eigenvectors, the mean of the gradient, and its mean square in the basis of both."""

    def __init__(self, gradient: Tensor) -> None:
        self._covariances = [torch.zeros_like(product) for product in _products(gradient)]
        self.of_inputs, self.of_outputs = self._covariances
        self._mean, self._square, self._steps = torch.zeros_like(gradient), torch.zeros_like(gradient), 0

    def towards(self, gradient: Tensor, betas: tuple[float, float]) -> Tensor:
        """Take a gradient (S, I, O) into account; where to move against, each coordinate of the basis by about 1."""
        self._steps += 1
        for covariance, product in zip(self._covariances, _products(gradient), strict=True):
            covariance.lerp_(product, 1 - MEMORY)
        if self._steps == 1:
            self.of_inputs, self.of_outputs = map(_eigenvectors, self._covariances)
        elif self._steps % EVERY == 1:
            bases = self.of_inputs, self.of_outputs
            self.of_inputs, self.of_outputs = map(_closer_to_eigenvectors, self._covariances, bases)
        self._mean.lerp_(gradient, 1 - betas[0])
        self._square.lerp_(self._turned(gradient).square(), 1 - betas[1])
        mean = self._turned(self._mean) / (1 - betas[0] ** self._steps)
        size = (self._square / (1 - betas[1] ** self._steps)).sqrt()
        floor = (SMALLEST * size.amax((-2, -1), keepdim=True)).clamp(min=torch.finfo(size.dtype).tiny)
        return self.of_inputs @ (mean / (size + floor)) @ self.of_outputs.mT

    def _turned(self, values: Tensor) -> Tensor:
        return self.of_inputs.mT @ values @ self.of_outputs


def _products(gradient: Tensor) -> tuple[Tensor, Tensor]:
    return gradient @ gradient.mT, gradient.mT @ gradient


def _eigenvectors(covariance: Tensor) -> Tensor:
    """(S, n, n); of a seed whose gradient is no number, some orthogonal basis."""
    return torch.linalg.eigh(covariance.nan_to_num(0.0, 0.0, 0.0)).eigenvectors


def _closer_to_eigenvectors(covariance: Tensor, basis: Tensor) -> Tensor:
    """A step of orthogonal iteration from a basis (S, n, n), which costs a GPU a tenth of the time of finding them."""
    return torch.linalg.qr(covariance.nan_to_num(0.0, 0.0, 0.0) @ basis).Q
