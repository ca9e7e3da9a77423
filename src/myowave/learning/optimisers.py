"""What moves the weights against their gradients, by the recipe's `optimiser`."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from torch import Tensor

from myowave.learning.adam import Adam
from myowave.learning.soap import Soap


class Optimiser(Protocol):
    """Made of the tensors that it moves, and of how slowly the first and second moment of their gradients forget."""

    @property
    def state(self) -> dict[str, Any]:
        """What another run over tensors of the same shapes can go on with."""

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on with the `state` of another."""

    def forget_gradients(self) -> None:
        """Begin a step: gradients add up from here."""

    def step(self, rate: float) -> None:
        """Move against the gradients, each coordinate by about `rate`; what has none stays."""


OPTIMISERS: Mapping[str, Callable[[Sequence[Tensor], tuple[float, float]], Optimiser]] = {"adam": Adam, "soap": Soap}
