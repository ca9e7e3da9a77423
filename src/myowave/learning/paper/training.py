"""How a network learns as the paper prints it: every measured angle before the predicted one is given (Fig. 4a)."""

from torch import Tensor

from myowave.learning.identification import Identification
from myowave.learning.loss import Losses
from myowave.learning.paper.loss import PaperLoss
from myowave.learning.task import Stage


class JointIdentification:
    """Parameters that Adam moves together with the weights, on the same loss J (Eq. 16), in place of a search.

    Args:
        raw: where they start, (S, R), on the device of the weights.
    """

    done = True

    def __init__(self, raw: Tensor) -> None:
        self.raw = raw.clone().requires_grad_()

    def uncertainty(self) -> None:
        """Not known."""


class PaperTraining:
    """An epoch is one step of Adam on all samples; see `recipes.Method`."""

    betas = (0.9, 0.999)

    def __init__(self, stage: Stage) -> None:
        task, device = stage.task, stage.task.device
        self._loss, self._identified = PaperLoss(stage), stage.identified.to(device)
        self.trained = list(stage.network.weights.values())
        if task.recipe.identification == "joint":
            self._search = JointIdentification(stage.raw.to(device))
            self.trained.append(self._search.raw)
        else:
            finest = stage.level == 0
            self._search = Identification(task.model, stage.trials, stage.identified, stage.raw, finest=finest)

    def differentiate(self, val_mse: Tensor) -> Losses:
        if not self._search.done:
            self._search.step()
        return self._loss.backward(self._identified.params(self._search.raw.to(val_mse.device)))

    @property
    def raw(self) -> Tensor:
        return self._search.raw.detach()

    def uncertainty(self) -> tuple[Tensor, Tensor] | None:
        return self._search.uncertainty()
