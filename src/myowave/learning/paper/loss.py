"""The loss as the paper prints it, J = J_data + beta J_res (Eqs. 16-18 and 38), on one-step predictions.

Shapes: S seeds, T trials, N samples, B pieces of trials, K samples of a piece.
"""

from collections.abc import Mapping

import torch
from torch import Tensor

from myowave.learning.loss import Losses, Noise
from myowave.learning.paper.derivatives import predict_with_time_derivatives
from myowave.learning.paper.windowed import first_predicted, predict_teacher_forced
from myowave.learning.residual import Pieces, Residual
from myowave.learning.task import Stage

PIECE = 32  # predicted samples in a piece of a mini-batch


class PaperLoss:
    """One-step predictions of the training trials, and the residual along them.

    Raises:
        ValueError: for a model with effects that the residual cannot hold.
    """

    def __init__(self, stage: Stage) -> None:
        task, trials, device = stage.task, stage.trials, stage.task.device
        self._recipe, self._network, self._corpus = task.recipe, stage.network, stage.corpus
        self._angle, self._dt = torch.from_numpy(trials.angle).to(device), trials.dt
        self._residual: Residual | None = None
        if self._recipe.beta:
            self._residual = Residual.of(
                task.model,
                task.training_trials(0) if self._recipe.residual_emg == "recorded" else trials,
                stage.names,
                device,
                averaged=self._recipe.residual_torque == "averaged",
                tied=self._recipe.tie_vmax,
            )
        self._noise = Noise(self._recipe.history_noise, task.seeds, stage.level)
        self._order = torch.Generator().manual_seed(stage.level)

    def backward(self, params: Mapping[str, Tensor]) -> Losses:
        """Losses of one step; adds gradients to those of the weights and of what `params`, (S, 1) each, come from."""
        pieces, used = self._pieces()
        x, angle = pieces.of(self._corpus.x), pieces.of(self._angle)
        given = angle + self._noise.draw(*angle.shape, like=angle) if self._noise.std else angle
        used = used & (torch.arange(pieces.length, device=used.device) >= first_predicted(self._network))
        slopes: list[Tensor] = []
        if self._recipe.derivative == "time":
            q, *slopes = predict_with_time_derivatives(self._network, x, given)
        else:
            q = predict_teacher_forced(self._network, x, given)
        data = _mean((q - angle).square(), used)
        residual, of_parameters = torch.zeros_like(data), torch.zeros_like(data)
        if self._residual is not None:
            split, measured = self._recipe.residual_angle == "split", angle.expand_as(q)
            seen = measured if self._recipe.residual_angle == "measured" else q
            taught = {name: value.detach() for name, value in params.items()} if split else params
            if slopes:
                residual = _mean(self._residual.along(taught, pieces, seen, slopes[0], slopes[1]).square(), used)
            else:
                residual = self._along(taught, pieces, seen, DIFFERENCES[self._recipe.derivative](q, measured), used)
            if split:
                of_parameters = self._along(params, pieces, measured, (measured,) * 3, used)
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
        length = min(PIECE + first_predicted(self._network), int(usable.min()))
        count = max(1, round(int(usable.sum()) / self._recipe.batches / (length - first_predicted(self._network))))
        trial, start = self._corpus.draw(count, length, self._order)
        return Pieces(trial, start, length), torch.ones(count, length, dtype=torch.bool, device=usable.device)

    def _along(
        self,
        params: Mapping[str, Tensor],
        pieces: Pieces,
        seen: Tensor,
        differenced: tuple[Tensor, Tensor, Tensor],
        used: Tensor,
    ) -> Tensor:
        """J_res (S,) along sequences (S, B, K): the torque along `seen`, the acceleration of those in `differenced`."""
        residual = self._residual
        assert residual is not None
        after, now, before = (q[..., cut] for q, cut in zip(differenced, _NEIGHBOURS, strict=True))
        left = residual.along_sequence(params, pieces, seen, (after - 2 * now + before) / self._dt**2)
        return _mean(left.square(), used.unfold(-1, 2 * residual.margin + 1, 1).all(-1))


_NEIGHBOURS = slice(2, None), slice(1, -1), slice(None, -2)

DIFFERENCES = {  # predicted and measured angles -> those after, at and before the sample of a second difference
    "sequence": lambda q, measured: (q, q, q),
    "history": lambda q, measured: (q, measured, measured),
    "measured": lambda q, measured: (measured, measured, measured),
}


def _mean(values: Tensor, counts: Tensor) -> Tensor:
    """Mean (S,) of values (S, B, K) where they count, (B, K)."""
    return (values * counts).sum((1, 2)) / counts.sum()
