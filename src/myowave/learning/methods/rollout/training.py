"""How a network learns from rollouts: its own predictions feed it, and physics tells it what was never measured.

In the first epochs at a scale, a Gauss-Newton search identifies the parameters, a step in each epoch. At scale [0],
motion is then simulated with them, and half of the windows to train on come from it. Physics whose own motion misses
the measured trials by more than their spread has nothing to teach.

Shapes: S seeds, T trials, B windows, K samples of a window of which m are history, X inputs.
"""

import math
import operator
from collections.abc import Iterable, Mapping, Sequence
from functools import reduce

import numpy as np
import torch
from torch import Tensor

from myowave.learning.identification import Identification
from myowave.learning.inputs import known_of
from myowave.learning.methods.rollout.augmentation import imagine_emg, simulate_imagined
from myowave.learning.methods.rollout.fast import Rollouts
from myowave.learning.network import Network
from myowave.learning.optimisers import Adam, Soap
from myowave.learning.task import Losses, Stage
from myowave.learning.windows import Corpus, Noise, Pieces, count_windows
from myowave.settings import RolloutRecipe

RISE = 20  # epochs at the beginning of a scale in which the step grows to its full length
LEAST_TRUST = 0.5  # of physics beside the network, in mean squares; what explains less leads the network astray
CLIP = 1.0  # largest norm of a seed's gradient through a rollout
DATA_SEED = 20230  # of windows and made-up EMG, which all seeds share
BETAS = 0.9, 0.99  # of the optimiser: how slowly the two moments of a gradient forget
OPTIMISERS: Mapping[str, type[Adam] | type[Soap]] = {"adam": Adam, "soap": Soap}  # by the recipe's `optimiser`


class RolloutTraining:
    """An epoch is one step of the optimiser on windows of all training trials; see `methods`."""

    def __init__(self, stage: Stage) -> None:
        recipe, finest = stage.task.recipe, stage.level == 0
        assert isinstance(recipe, RolloutRecipe)
        self._stage, self._recipe = stage, recipe
        self._weights = list(stage.network.weights.values())
        self._optimiser = OPTIMISERS[recipe.optimiser](self._weights, BETAS)
        self.parameters = Identification(stage.task.model, stage.trials, stage.free, stage.values, finest=finest)
        steps = max(1, round(recipe.rollout_s / stage.trials.dt))
        self._loss = RolloutLoss(stage.network, stage.corpus, recipe, steps, stage.task.seeds, stage.level)
        self._data: Tensor  # loss on windows of the epoch before
        self._simulates = finest and recipe.simulated_trials > 0
        self._simulated: tuple[Corpus, Tensor, Tensor] | None = None  # see `_simulate`

    def learn(self, epoch: int, done: float, val_mse: Tensor) -> Losses:
        """The next epoch; the step falls with a cosine over all scales together."""
        self._optimiser.zero_grad()
        if not self.parameters.done:
            self.parameters.step()
        elif self._simulates:
            self._simulated, self._simulates = self._simulate(), False
        if self._simulated is None:
            losses = self._loss.backward()
        else:
            corpus, physics_mse, counts = self._simulated
            known = torch.where(val_mse.isnan(), self._data, val_mse)
            losses = self._loss.backward(corpus, weigh_physics(physics_mse, known)[:, None] * counts)
        self._data = losses.data.to(val_mse)
        clip_gradients(self._weights)
        falling = 0.5 * (1 + math.cos(math.pi * done))
        self._optimiser.move(self._recipe.learning_rate * falling * min(1.0, epoch / RISE))
        return losses

    def _simulate(self) -> tuple[Corpus, Tensor, Tensor] | None:
        """Trials that physics makes with the identified parameters; how far it misses the measured ones [rad^2], (S,);
        and which trials count for which seed, (S, T): none where physics does not follow the measured ones. None where
        that of no seed does."""
        stage, device = self._stage, self._stage.task.device
        physics_mse = self.parameters.mse
        follows = physics_mse < stage.network.scaling.angle_std**2
        if not follows.any():
            return None
        emg = imagine_emg(stage.trials, self._recipe.simulated_trials, DATA_SEED)
        angle, inside, donors = simulate_imagined(
            stage.task.model, self.parameters.params, stage.trials, emg, DATA_SEED
        )
        angle = angle.expand(stage.network.seeds, *angle.shape[-2:])  # one for all where nothing is identified
        known = known_of(stage.trials, donors, stage.network.architecture.known, emg.shape[1])
        inputs = torch.from_numpy(np.concatenate([emg, known], axis=-1)).to(device)
        usable = torch.full((len(emg),), emg.shape[1])
        corpus = Corpus.of(stage.network, inputs, angle.to(device), stage.trials.dt, usable)
        return corpus, physics_mse.to(device), (inside & follows.unsqueeze(-1)).to(device)


def weigh_physics(physics_mse: Tensor, network_mse: Tensor) -> Tensor:
    """Weight of simulated motion beside measured, (S,) [-]: 1 as long as physics explains the trials as well as the
    network does, then the less the worse it is, and none from `LEAST_TRUST` on; both miss it by so much [rad^2], (S,).
    """
    trust = (network_mse / physics_mse).clamp(max=1.0)
    return torch.where(trust < LEAST_TRUST, 0.0, trust)


@torch.no_grad()
def clip_gradients(weights: Iterable[Tensor]) -> None:
    """Scale each seed's gradient down to a norm of at most `CLIP`; weights have the seeds as leading axis."""
    gradients = [value.grad for value in weights if value.grad is not None]
    norm = reduce(operator.add, (gradient.square().sum((1, 2)) for gradient in gradients)).sqrt()
    factor = (CLIP / norm.clamp(min=CLIP))[:, None, None]
    for gradient in gradients:
        gradient.mul_(factor)


class RolloutLoss:
    """Draws the windows of each epoch, and predicts them.

    Args:
        steps: samples to predict in each window, fewer where no trial is that long.
        seeds, level: numbers of the seeds and of the scale, for the noise.
    """

    def __init__(
        self, network: Network, corpus: Corpus, recipe: RolloutRecipe, steps: int, seeds: Sequence[int], level: int = 0
    ) -> None:
        steps = min(steps, int(corpus.usable.max()) - network.history)
        self._network, self._corpus = network, corpus
        self._length, self._count = network.history + steps, count_windows(corpus.usable, steps)
        self._random = torch.Generator().manual_seed(DATA_SEED + level)  # of where windows begin, which all seeds share
        # On measured windows: on the logarithm of the EMG, one for each channel, and on what is known beside it, in
        # units of its scaling.
        self._gains = Noise(recipe.emg_gain, seeds, level, stream=1)
        self._shifts = Noise(recipe.known_noise, seeds, level, stream=2)
        self._roll_out = Rollouts(network)

    def backward(self, simulated: Corpus | None = None, counts: Tensor | None = None) -> Losses:
        """Losses of one epoch; adds gradients to those of the weights. Where there are simulated trials, half of the
        windows are cut from them, and count as `counts` (S, T) says of their trials beside a measured one."""
        made = 0 if simulated is None else self._count // 2
        x, *rest = self._cut(self._corpus, self._count - made)
        x = self._disturb(x)
        if simulated is not None:
            further_x, *further = self._cut(simulated, made, counts)
            x = torch.cat((x, further_x.expand(*x.shape[:-3], *further_x.shape)), dim=-3)
            rest = [torch.cat(pair, dim=1) for pair in zip(rest, further, strict=True)]
        z, v, weight = rest
        m, weight = self._network.history, weight / weight.sum((1, 2), keepdim=True)
        history = z[..., :m].contiguous(), v[..., :m].contiguous()
        predicted = self._roll_out(x, *history)
        loss = (weight * (predicted - z[..., m:]).square()).sum((1, 2))
        loss.sum().backward()
        data = loss.detach() * self._network.scaling.angle_std**2
        return Losses(data, data, torch.zeros_like(data))

    def _cut(self, corpus: Corpus, count: int, counts: Tensor | None = None) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Windows of a corpus: inputs (B, K, X), standardised angle and step (S, B, K), and how much each predicted
        sample counts, (S, B, K - m): 1, or as `counts` (S, T) of its trial says; 0 beyond the end of its trial."""
        pieces = Pieces.draw(corpus.usable, count, self._length, self._random)
        x, z, v = corpus.cut(pieces)
        z, v = (values.expand(self._network.seeds, -1, -1) for values in (z, v))
        weight = pieces.within(corpus.usable)[:, self._network.history :].to(z).expand(self._network.seeds, -1, -1)
        return x, z, v, weight if counts is None else counts[:, pieces.trial, None].to(z) * weight

    def _disturb(self, x: Tensor) -> Tensor:
        """Inputs (B, K, X) with other gains of the EMG, and other values of what is known beside it, (S, B, K, X); as
        they are where nothing is disturbed."""
        if not (self._gains.std or self._shifts.std):
            return x
        scaling, channels = self._network.scaling, self._network.architecture.channels
        known = slice(channels, channels + len(self._network.architecture.given.told))
        x = x.expand(self._network.seeds, *x.shape).clone()
        if self._gains.std:
            gain = self._gains.draw(x.shape[1], 1, channels, like=x).exp()
            zero = x.new_tensor([m / s for m, s in zip(scaling.input_mean, scaling.input_std, strict=True)])[:channels]
            x[..., :channels] = gain * (x[..., :channels] + zero) - zero
        if self._shifts.std:
            x[..., known] += self._shifts.draw(x.shape[1], 1, known.stop - known.start, like=x)
        return x
