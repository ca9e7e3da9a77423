"""How a network learns as the paper prints it: every measured angle before the predicted one is given (Fig. 4a)."""

from torch import Tensor

from myowave.learning.identification import Identification
from myowave.learning.loss import Losses
from myowave.learning.paper.joint_identification import JointIdentification
from myowave.learning.paper.loss import PaperLoss
from myowave.learning.task import Stage
from myowave.learning.unidentified import Unidentified


class PaperTraining:
    """An epoch is one step of the optimiser on all samples; see `methods.Method`."""

    betas = (0.9, 0.999)

    def __init__(self, stage: Stage) -> None:
        task = stage.task
        self._loss, self.trained = PaperLoss(stage), list(stage.network.weights.values())
        self.search: JointIdentification | Identification | Unidentified
        if task.recipe.identification == "joint":
            self.search = JointIdentification(
                stage.free, task.wanted, stage.start, stage.values, task.device, task.recipe.parameter_pace
            )
            self.trained.append(self.search.moved)
        elif task.recipe.identification == "none":
            self.search = Unidentified(stage.values)
        else:
            finest = stage.level == 0
            self.search = Identification(task.model, stage.trials, stage.free, stage.values, finest=finest)

    def differentiate(self, val_mse: Tensor) -> Losses:
        if isinstance(self.search, Identification) and not self.search.done:
            self.search.step()
        return self._loss.backward(self.search.params)
