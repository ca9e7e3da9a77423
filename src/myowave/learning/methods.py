"""The methods of training, one for each kind of recipe.

Only this module chooses between them. A further kind is a further entry of `METHODS`, and one of `prediction.RUNS`.
"""

from collections.abc import Callable
from typing import Protocol

from torch import Tensor

from myowave.learning.loss import Losses
from myowave.learning.paper.training import PaperTraining
from myowave.learning.rollouts.training import RolloutTraining
from myowave.learning.task import Stage


class Search(Protocol):
    """What identifies the parameters.

    Args:
        values: of the parameters as they are now, (S, P), SI units.
    """

    @property
    def values(self) -> Tensor: ...

    @property
    def mse(self) -> Tensor:
        """How far motion simulated with the values misses the training trials [rad^2], (S,).

        Infinite where it diverges, NaN where nobody simulates it.
        """

    def uncertainty(self) -> tuple[Tensor, Tensor]:
        """Standard errors (S, P) of the values and their correlations (S, P, P); NaN where they are not known."""


class Method(Protocol):
    """How a network learns and parameters are identified at one scale.

    Args:
        trained: tensors that the optimiser moves, the weights among them.
        betas: of the optimiser, see `optimisers.Optimiser`.
        search: for the parameters.
    """

    trained: list[Tensor]
    betas: tuple[float, float]

    @property
    def search(self) -> Search: ...

    def differentiate(self, val_mse: Tensor) -> Losses:
        """The next epoch: a step of the search for parameters, then losses, and gradients added to those of `trained`.

        Args:
            val_mse: error of the network on the validation windows [rad^2], (S,).
        """


METHODS: dict[str, Callable[[Stage], Method]] = {  # by the recipe's hidden_state
    "carried": RolloutTraining,
    "windowed": PaperTraining,
}
