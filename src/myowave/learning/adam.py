"""Adam by the function of torch that its class calls: the class imports torch's compiler first, 2 s in every job."""

from collections.abc import Sequence

import torch
from torch import Tensor
from torch.optim.adam import adam

EPSILON = 1e-8


class Adam:
    """Moves tensors against their gradients. Source: Kingma & Ba 2015, Algorithm 1.

    Args:
        moved: leaves of the graph; one without a gradient stays where it is.
        betas: how slowly the two moments of a gradient forget the steps before.
    """

    def __init__(self, moved: Sequence[Tensor], betas: tuple[float, float]) -> None:
        self._moved, self._betas = list(moved), betas
        self._steps = [torch.tensor(0.0) for _ in moved]
        self._means, self._squares = ([torch.zeros_like(tensor) for tensor in moved] for _ in range(2))

    def forget_gradients(self) -> None:
        """Begin a step: gradients add up from here."""
        for tensor in self._moved:
            tensor.grad = None

    @torch.no_grad()
    def step(self, rate: float) -> None:
        """Move against the gradients, each coordinate by about `rate`."""
        given = zip(self._moved, self._means, self._squares, self._steps, strict=True)
        rows = [(x, x.grad, mean, square, steps) for x, mean, square, steps in given if x.grad is not None]
        moved, gradients, means, squares, steps = map(list, zip(*rows, strict=True))
        adam(
            moved,
            gradients,
            means,
            squares,
            [],
            steps,
            amsgrad=False,
            beta1=self._betas[0],
            beta2=self._betas[1],
            lr=rate,
            weight_decay=0.0,
            eps=EPSILON,
            maximize=False,
        )
