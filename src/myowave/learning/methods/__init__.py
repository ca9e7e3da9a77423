"""The methods of training, one for each class of recipes.

Only this module chooses between them. A further method is a further entry of `METHODS`, a package beside `rollout` and
`paper`, and a class of recipes in `settings.learning`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from torch import Tensor

from myowave.learning.loss import Losses
from myowave.learning.methods.paper.training import PaperTraining
from myowave.learning.methods.paper.windowed import run_windowed
from myowave.learning.methods.rollout.rollout import roll_out
from myowave.learning.methods.rollout.training import RolloutTraining
from myowave.learning.network import Network
from myowave.learning.task import Stage


class Parameters(Protocol):
    """What identifies the parameters of the physics, for all seeds."""

    @property
    def values(self) -> Tensor:
        """As they are now, (S, P), SI units."""

    @property
    def mse(self) -> Tensor:
        """How far motion simulated with the values misses the training trials [rad^2], (S,).

        Infinite where it diverges, NaN where nobody simulates it.
        """

    def uncertainty(self) -> tuple[Tensor, Tensor]:
        """Standard errors (S, P) of the values and their correlations (S, P, P); NaN where they are not known."""


class Training(Protocol):
    """How a network learns and parameters are identified at one scale."""

    @property
    def parameters(self) -> Parameters: ...

    def learn(self, epoch: int, done: float, val_mse: Tensor) -> Losses:
        """The next epoch: moves the weights, and the parameters.

        Args:
            epoch: from 1, within this scale.
            done: share of the epochs of all scales that went before.
            val_mse: error of the network on the validation windows [rad^2], (S,).
        """


@dataclass(frozen=True)
class Method:
    """A way to train and run a network.

    Args:
        begin: training at one scale.
        run: the network, free running, from the beginning of windows: see `prediction.run_free`.
    """

    begin: Callable[[Stage], Training]
    run: Callable[[Network, Tensor, Tensor, Tensor], Tensor]


METHODS: Mapping[str, Method] = {
    "rollout": Method(RolloutTraining, roll_out),
    "paper": Method(PaperTraining, run_windowed),
}
