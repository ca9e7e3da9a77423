"""The loss of rollouts: mean square error of windows that are predicted from their history, and what these leave of the
equation of motion.

Shapes: S seeds, T trials, B windows, K samples of a window of which m are history, X inputs.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from myowave.learning.loss import Losses, Noise
from myowave.learning.methods.rollout.fast import Workspace, roll_out_gru
from myowave.learning.network import Network
from myowave.learning.residual import Pieces, Residual
from myowave.learning.windows import Corpus, count_windows


@dataclass(frozen=True)
class Simulated:
    """Trials made by simulation, to train on beside the measured ones.

    Args:
        corpus: the trials as the network sees them, all their samples usable.
        counts: which of them count for which seed, (S, T).
    """

    corpus: Corpus
    counts: Tensor


@dataclass(frozen=True)
class Taught:
    """The equation of motion that predictions of recorded windows are to obey.

    Args:
        residual: of the training trials.
        params: identified parameters, (S, 1) each, SI units.
        weight: of its square in the loss, (S,) [rad^2 / (N m)^2].
    """

    residual: Residual
    params: Mapping[str, Tensor]
    weight: Tensor


@dataclass(frozen=True)
class _Batch:
    """Windows of an epoch: inputs (B, K, X) or (S, B, K, X), standardised angle and step (S, B, K), and how much each
    counts (S, B)."""

    x: Tensor
    z: Tensor
    v: Tensor
    weight: Tensor

    def beside(self, other: "_Batch") -> "_Batch":
        pairs = ((getattr(self, name), getattr(other, name)) for name in ("z", "v", "weight"))
        x = torch.cat((self.x, other.x.expand(*self.x.shape[:-3], *other.x.shape)), dim=-3)
        return _Batch(x, *(torch.cat(pair, dim=1) for pair in pairs))


class RolloutLoss:
    """Draws the windows of each epoch, and predicts them.

    Args:
        network: its weights take the gradients.
        corpus: the training trials.
        steps: samples to predict in each window, fewer where no trial is that long.
        random: of where windows begin, which all seeds share.
        gains: on the logarithm of the EMG of measured windows, one for each channel.
        shifts: on what is known beside the EMG of measured windows, in units of its scaling.
    """

    def __init__(
        self,
        network: Network,
        corpus: Corpus,
        steps: int,
        random: torch.Generator,
        gains: Noise,
        shifts: Noise,
    ) -> None:
        steps = min(steps, int(corpus.usable.max()) - network.history)
        self._network, self._corpus, self._random = network, corpus, random
        self._gains, self._shifts = gains, shifts
        self._length, self._count = network.history + steps, count_windows(corpus.usable, steps)
        self._workspace = Workspace()

    def backward(
        self, simulated: Simulated | None = None, trust: Tensor | None = None, taught: Taught | None = None
    ) -> Losses:
        """Losses of one epoch; adds gradients to those of the weights.

        Args:
            simulated: half of the windows are cut from these trials.
            trust: how much a simulated window counts beside a measured one, (S,).
            taught: what predictions of the measured windows are to obey beside.
        """
        made = 0 if simulated is None else self._count // 2
        recorded = self._draw(self._corpus, self._count - made)
        windows = self._disturb(self._cut(self._corpus, recorded))
        if simulated is not None:
            assert trust is not None, "simulated windows need it"
            others = self._cut(simulated.corpus, self._draw(simulated.corpus, made), trust[:, None] * simulated.counts)
            windows = windows.beside(others)
        m = self._network.history
        target, weight = windows.z[..., m:], windows.weight
        weight = (weight / (weight.sum(-1, keepdim=True) * target.shape[-1])).unsqueeze(-1)
        history = windows.z[..., :m].contiguous(), windows.v[..., :m].contiguous()
        predicted = roll_out_gru(self._network, windows.x, *history, self._workspace)
        loss = (weight * (predicted - target).square()).sum((1, 2))
        square = self._network.scaling.angle_std**2
        data, residual = loss.detach() * square, torch.zeros_like(loss)
        total = data
        if taught is not None:
            count = len(recorded.trial)
            left = self._left(taught, recorded, windows.z[:, :count, :m], predicted[:, :count])
            residual, total = left.detach(), data + taught.weight.to(left) * left.detach()
            loss = loss + (taught.weight.to(left) / square) * left
        loss.sum().backward()
        return Losses(total, data, residual)

    def _left(self, taught: Taught, windows: Pieces, history: Tensor, predicted: Tensor) -> Tensor:
        """Mean square of what predictions of windows (S, B, K - m) leave of the equation of motion [(N m)^2], (S,)."""
        residual = taught.residual
        # The first residual is that of the first predicted sample: as much of the history as it needs comes before.
        before = min(residual.margin, history.shape[-1])
        pieces = Pieces(windows.trial, windows.start + history.shape[-1] - before, before + predicted.shape[-1])
        q = self._network.to_rad(torch.cat((history[..., history.shape[-1] - before :], predicted), dim=-1))
        bend = (q[..., 2:] - 2 * q[..., 1:-1] + q[..., :-2]) / residual.dt**2
        return residual.along_sequence(taught.params, pieces, q, bend).square().mean((1, 2)).to(predicted)

    def _draw(self, corpus: Corpus, count: int) -> Pieces:
        """Where windows of a corpus begin."""
        return Pieces(*corpus.draw(count, self._length, self._random), self._length)

    def _cut(self, corpus: Corpus, pieces: Pieces, counts: Tensor | None = None) -> _Batch:
        """Windows of a corpus; `counts` (S, T) says how much those of each trial count."""
        x, z, v = corpus.cut(pieces.trial, pieces.start, pieces.length)
        z, v = (values.expand(self._network.seeds, -1, -1) for values in (z, v))
        weight = z.new_ones(z.shape[:2]) if counts is None else counts[:, pieces.trial].to(z)
        return _Batch(x, z, v, weight)

    def _disturb(self, windows: _Batch) -> _Batch:
        """The same windows with other gains of the EMG, and other values of what is known beside it."""
        if not (self._gains.std or self._shifts.std):
            return windows
        scaling, x, channels = self._network.scaling, windows.x, self._network.architecture.channels
        known = slice(channels, channels + len(self._network.architecture.given.told))
        x = x.expand(self._network.seeds, *x.shape[-3:]).clone()
        if self._gains.std:
            gain = self._gains.draw(x.shape[1], 1, channels, like=x).exp()
            zero = x.new_tensor([m / s for m, s in zip(scaling.input_mean, scaling.input_std, strict=True)])[:channels]
            x[..., :channels] = gain * (x[..., :channels] + zero) - zero
        if self._shifts.std:
            x[..., known] += self._shifts.draw(x.shape[1], 1, known.stop - known.start, like=x)
        return replace(windows, x=x)
