"""The kinds of recipe, told apart by what becomes of the hidden state: how each network predicts and how it learns.

Only this module chooses between them. A further kind is a further entry of `KINDS`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from torch import Tensor

from myowave.learning.loss import Losses
from myowave.learning.network import Network
from myowave.learning.paper.training import PaperTraining
from myowave.learning.paper.windowed import run_windowed
from myowave.learning.rollouts.rollout import roll_out
from myowave.learning.rollouts.training import RolloutTraining
from myowave.learning.task import Stage


class Search(Protocol):
    """What identifies the parameters.

    Args:
        values: of the parameters as they are now, (S, P), SI units.
    """

    @property
    def values(self) -> Tensor: ...

    def uncertainty(self) -> tuple[Tensor, Tensor]:
        """Standard errors (S, P) of the values and their correlations (S, P, P); NaN where they are not known."""


class Method(Protocol):
    """How a network learns and parameters are identified at one scale.

    Args:
        trained: tensors that Adam moves, the weights among them.
        betas: of Adam.
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


@dataclass(frozen=True)
class Kind:
    """A kind of recipe.

    Args:
        run_free: standardised predictions (S, B, K - m) of windows with inputs (B, K, X) from a history of angles and
            steps (S, B, m).
        begin: training at one scale.
    """

    run_free: Callable[[Network, Tensor, Tensor, Tensor], Tensor]
    begin: Callable[[Stage], Method]


KINDS = {  # by the recipe's hidden_state
    "carried": Kind(roll_out, RolloutTraining),
    "windowed": Kind(run_windowed, PaperTraining),
}
