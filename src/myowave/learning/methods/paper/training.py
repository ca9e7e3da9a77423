"""How a network learns as the paper prints it: every measured angle before the predicted one is given (Fig. 4a), and
the loss is J = J_data + beta J_res (Eqs. 16-18 and 38).

Shapes: S seeds, T trials, N samples, B pieces of trials, K samples of a piece.
"""

from collections.abc import Mapping

import torch
from torch import Tensor

from myowave.learning.loss import Losses, Noise
from myowave.learning.methods.paper.joint_identification import JointIdentification
from myowave.learning.methods.paper.residual import MotionResidual, Pieces
from myowave.learning.methods.paper.windowed import predict_teacher_forced, predict_with_time_derivatives
from myowave.learning.optimisers import Adam
from myowave.learning.task import Stage
from myowave.settings import PaperRecipe

BETAS = 0.9, 0.999  # of Adam: how slowly the two moments of a gradient forget
PIECE = 32  # predicted samples in a piece of a mini-batch


class PaperTraining:
    """An epoch is some steps of Adam on weights and parameters together; see `methods`."""

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


class PaperLoss:
    """One-step predictions of the training trials, and the residual along them.

    Raises:
        ValueError: for a model with effects that the residual cannot hold.
    """

    def __init__(self, stage: Stage, recipe: PaperRecipe) -> None:
        task, trials = stage.task, stage.trials
        self._recipe, self._network, self._corpus = recipe, stage.network, stage.corpus
        self._angle, self._dt = torch.from_numpy(trials.angle).to(task.device), trials.dt
        self._residual: MotionResidual | None = None
        if recipe.beta:
            averaged = recipe.residual not in ("time", "sequence")
            self._residual = MotionResidual(task.model, trials, stage.names, task.device, averaged=averaged)
        self._noise = Noise(recipe.history_noise, task.seeds, stage.level)
        self._order = torch.Generator().manual_seed(stage.level)

    def backward(self, params: Mapping[str, Tensor]) -> Losses:
        """Losses of one step; adds gradients to those of the weights and of what `params`, (S, 1) each, come from."""
        pieces, used = self._pieces()
        x, angle = pieces.of(self._corpus.x), pieces.of(self._angle)
        given = angle + self._noise.draw(*angle.shape, like=angle) if self._noise.std else angle
        used = used & (torch.arange(pieces.length, device=used.device) >= self._network.history)
        slopes: list[Tensor] = []
        if self._recipe.residual == "time":
            q, *slopes = predict_with_time_derivatives(self._network, x, given)
        else:
            q = predict_teacher_forced(self._network, x, given)
        data = _mean((q - angle).square(), used)
        residual = of_parameters = torch.zeros_like(data)
        if self._residual is not None:
            measured = angle.expand_as(q)
            if slopes:
                residual = _mean(self._residual.along(params, pieces, q, *slopes).square(), used)
            elif self._recipe.residual == "split":
                taught = {name: value.detach() for name, value in params.items()}
                residual = self._along(taught, pieces, q, used)
                of_parameters = self._along(params, pieces, measured, used)
            else:
                residual = self._along(params, pieces, measured if self._recipe.residual == "measured" else q, used)
        total = data + self._recipe.beta * residual
        (total + self._recipe.beta * of_parameters).sum().backward()
        return Losses(total.detach(), data.detach(), residual.detach())

    def _pieces(self) -> tuple[Pieces, Tensor]:
        """What the next step trains on, and which of its samples may be used, (B, K)."""
        usable, samples = self._corpus.usable, self._angle.shape[1]
        if self._recipe.batches == 1:
            trial = torch.arange(len(usable), device=usable.device)
            sample = torch.arange(samples, device=usable.device)
            return Pieces(trial, torch.zeros_like(trial), samples), sample < usable[:, None]
        length = min(PIECE + self._network.history, int(usable.min()))
        count = max(1, round(int(usable.sum()) / self._recipe.batches / (length - self._network.history)))
        trial, start = self._corpus.draw(count, length, self._order)
        return Pieces(trial, start, length), torch.ones(count, length, dtype=torch.bool, device=usable.device)

    def _along(self, params: Mapping[str, Tensor], pieces: Pieces, q: Tensor, used: Tensor) -> Tensor:
        """J_res (S,) along sequences of angles (S, B, K), accelerations from their second differences."""
        residual = self._residual
        assert residual is not None
        bend = (q[..., 2:] - 2 * q[..., 1:-1] + q[..., :-2]) / self._dt**2
        left = residual.along_sequence(params, pieces, q, bend)
        return _mean(left.square(), used.unfold(-1, 2 * residual.margin + 1, 1).all(-1))


def _mean(values: Tensor, counts: Tensor) -> Tensor:
    """Mean (S,) of values (S, B, K) where they count, (B, K)."""
    return (values * counts).sum((1, 2)) / counts.sum()
