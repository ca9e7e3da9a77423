"""How a network learns as the paper prints it: every measured angle before the predicted one is given (Fig. 4a)."""

from torch import Tensor

from myowave.learning.adam import Adam
from myowave.learning.loss import Losses
from myowave.learning.methods.paper.joint_identification import JointIdentification
from myowave.learning.methods.paper.loss import PaperLoss
from myowave.learning.task import Stage
from myowave.settings import PaperRecipe

BETAS = 0.9, 0.999  # of Adam: how slowly the two moments of a gradient forget


class PaperTraining:
    """An epoch is some steps of Adam on weights and parameters together; see `methods.Training`."""

    def __init__(self, stage: Stage) -> None:
        task, recipe = stage.task, stage.task.recipe
        assert isinstance(recipe, PaperRecipe)
        self._recipe, self._loss = recipe, PaperLoss(stage, recipe)
        self.parameters = JointIdentification(
            stage.free, task.wanted, stage.start, stage.values, task.device, recipe.parameter_pace
        )
        self._optimiser = Adam([*stage.network.weights.values(), self.parameters.moved], BETAS)

    def learn(self, epoch: int, done: float, val_mse: Tensor) -> Losses:
        for _ in range(self._recipe.batches):
            self._optimiser.forget_gradients()
            losses = self._loss.backward(self.parameters.params)
            self._optimiser.step(self._recipe.learning_rate)
        return losses
