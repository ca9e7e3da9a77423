"""How a network learns as the paper prints it: every measured angle before the predicted one is given (Fig. 4a), and
the loss is J = J_data + beta J_res (Eqs. 16-18 and 38).

Shapes: S seeds, T trials, N samples, B pieces of trials, K samples of a piece.
"""

from collections.abc import Mapping

import torch
from torch import Tensor

from myowave.learning.methods.paper.joint_identification import JointIdentification
from myowave.learning.methods.paper.one_step import predict_teacher_forced, predict_with_time_derivatives
from myowave.learning.methods.paper.residual import MotionResidual
from myowave.learning.optimisers import Adam
from myowave.learning.task import Losses, Stage
from myowave.learning.windows import Noise, Pieces
from myowave.settings import PaperRecipe

BETAS = 0.9, 0.999  # of Adam: how slowly the two moments of a gradient forget
PIECE = 32  # predicted samples in a piece of a mini-batch


class PaperTraining:
    """An epoch is some steps of Adam on weights and parameters together; see `methods`."""

    def __init__(self, stage: Stage) -> None:
        task, recipe, trials = stage.task, stage.task.recipe, stage.trials
        assert isinstance(recipe, PaperRecipe)
        self._recipe, self._network, self._corpus = recipe, stage.network, stage.corpus
        self._angle = torch.from_numpy(trials.angle).to(task.device)
        self._residual: MotionResidual | None = None
        if recipe.beta:
            averaged = recipe.residual not in ("time", "sequence")
            self._residual = MotionResidual(task.model, trials, stage.names, task.device, averaged=averaged)
        self._noise = Noise(recipe.history_noise, task.seeds, stage.level)
        self._order = torch.Generator().manual_seed(stage.level)
        self.parameters = JointIdentification(
            stage.free, task.wanted, stage.start, stage.values, task.device, recipe.parameter_pace
        )
        self._optimiser = Adam([*stage.network.weights.values(), self.parameters.moved], BETAS)

    def learn(self, epoch: int, done: float, val_mse: Tensor) -> Losses:
        for _ in range(self._recipe.batches):
            self._optimiser.zero_grad()
            losses = self.backward(self.parameters.params)
            self._optimiser.move(self._recipe.learning_rate)
        return losses

    def backward(self, params: Mapping[str, Tensor]) -> Losses:
        """Losses of one-step predictions; adds gradients to those of the weights and of what `params`, (S, 1) each,
        come from."""
        pieces, reading = self._pieces(), self._recipe.residual
        x, angle = pieces.of(self._corpus.x), pieces.of(self._angle)
        step = torch.arange(pieces.length, device=angle.device)
        used = (self._network.history <= step) & pieces.within(self._corpus.usable)
        given = angle + self._noise.draw(*angle.shape, like=angle) if self._noise.std else angle
        slopes: list[Tensor] = []
        if reading == "time":
            q, *slopes = predict_with_time_derivatives(self._network, x, given)
        else:
            q = predict_teacher_forced(self._network, x, given)
        data = _mean((q - angle).square(), used)
        residual = of_parameters = torch.zeros_like(data)
        if self._residual is not None:
            measured, taught = angle.expand_as(q), params
            if reading == "split":
                taught = {name: value.detach() for name, value in params.items()}
                of_parameters = self._along(params, pieces, used, measured)
            residual = self._along(taught, pieces, used, measured if reading == "measured" else q, *slopes)
        total = data + self._recipe.beta * residual
        (total + self._recipe.beta * of_parameters).sum().backward()
        return Losses(total.detach(), data.detach(), residual.detach())

    def _pieces(self) -> Pieces:
        """What the next step trains on: whole trials, or a mini-batch of what is usable of them."""
        usable, history = self._corpus.usable, self._network.history
        if self._recipe.batches == 1:
            trial = torch.arange(len(usable), device=usable.device)
            return Pieces(trial, torch.zeros_like(trial), self._angle.shape[1])
        length = min(PIECE + history, int(usable.min()))
        count = max(1, round(int(usable.sum()) / self._recipe.batches / (length - history)))
        return Pieces.draw(usable, count, length, self._order)

    def _along(self, params: Mapping[str, Tensor], pieces: Pieces, used: Tensor, q: Tensor, *slopes: Tensor) -> Tensor:
        """J_res (S,) along angles (S, B, K), with these derivatives, else with differences."""
        assert self._residual is not None
        if slopes:
            return _mean(self._residual.along(params, pieces, q, *slopes).square(), used)
        left = self._residual.along_sequence(params, pieces, q)
        return _mean(left.square(), used.unfold(-1, 2 * self._residual.margin + 1, 1).all(-1))


def _mean(values: Tensor, counts: Tensor) -> Tensor:
    """Mean (S,) of values (S, B, K) where they count, (B, K)."""
    return (values * counts).sum((1, 2)) / counts.sum()
