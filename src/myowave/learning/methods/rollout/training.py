"""How a network learns from rollouts: its own predictions feed it, and physics tells it what was never measured.

In the first epochs at a scale, a Gauss-Newton search identifies the parameters, a step in each epoch. At scale [0],
motion is then simulated with them, and half of the windows to train on come from it. Where the recipe has a beta,
predictions of the measured windows are to obey the equation of motion as well, at every scale. Physics whose own motion
misses the measured trials by more than their spread has nothing to teach: neither is done with it.
"""

import math
import operator
from collections.abc import Iterable, Mapping
from functools import reduce

import numpy as np
import torch
from torch import Tensor

from myowave.learning.adam import Adam
from myowave.learning.identification import Identification
from myowave.learning.inputs import known_of
from myowave.learning.loss import Losses, Noise
from myowave.learning.methods.rollout.augmentation import imagine_emg, simulate_imagined
from myowave.learning.methods.rollout.loss import RolloutLoss, Simulated, Taught
from myowave.learning.residual import Residual
from myowave.learning.soap import Soap
from myowave.learning.task import Stage
from myowave.learning.windows import Corpus
from myowave.settings import RolloutRecipe

RISE = 20  # epochs at the beginning of a scale in which the step grows to its full length
LEAST_TRUST = 0.5  # of physics beside the network, in mean squares; what explains less leads the network astray
CLIP = 1.0  # largest norm of a seed's gradient through a rollout
DATA_SEED = 20230  # of windows and made-up EMG, which all seeds share
BETAS = 0.9, 0.99  # of the optimiser: how slowly the two moments of a gradient forget
OPTIMISERS: Mapping[str, type[Adam | Soap]] = {"adam": Adam, "soap": Soap}  # by the recipe's `optimiser`


class RolloutTraining:
    """An epoch is one step of the optimiser on windows of all training trials; see `methods.Training`."""

    def __init__(self, stage: Stage) -> None:
        recipe, finest = stage.task.recipe, stage.level == 0
        assert isinstance(recipe, RolloutRecipe)
        self._stage, self._recipe = stage, recipe
        self._weights = list(stage.network.weights.values())
        self._optimiser = OPTIMISERS[recipe.optimiser](self._weights, BETAS)
        self.parameters = Identification(stage.task.model, stage.trials, stage.free, stage.values, finest=finest)
        self._loss = RolloutLoss(
            stage.network,
            stage.corpus,
            max(1, round(recipe.rollout_s / stage.trials.dt)),
            torch.Generator().manual_seed(DATA_SEED + stage.level),
            Noise(recipe.emg_gain, stage.task.seeds, stage.level, stream=1),
            Noise(recipe.known_noise, stage.task.seeds, stage.level, stream=2),
        )
        self._data: Tensor | None = None  # loss on windows of the epoch before
        self._simulates = finest and recipe.simulated_trials > 0
        self._simulated: Simulated | None = None
        self._residual: Residual | None = None
        if recipe.beta:
            self._residual = Residual.of(stage.task.model, stage.trials, stage.names, stage.task.device, averaged=True)
        self._physics_mse: Tensor | None = None  # of the parameters that the search ended with, (S,)

    def learn(self, epoch: int, done: float, val_mse: Tensor) -> Losses:
        """The next epoch; the step falls with a cosine over all scales together."""
        self._optimiser.forget_gradients()
        losses = self._differentiate(val_mse)
        self._optimiser.step(
            self._recipe.learning_rate * (0.5 * (1 + math.cos(math.pi * done)) * min(1.0, epoch / RISE))
        )
        return losses

    def _differentiate(self, val_mse: Tensor) -> Losses:
        if not self.parameters.done:
            self.parameters.step()
        elif self._physics_mse is None and (self._simulates or self._residual is not None):
            self._physics_mse = self.parameters.mse.to(val_mse.device)
            self._simulated = self._simulate(self._physics_mse) if self._simulates else None
        trust = taught = None
        if self._physics_mse is not None:
            known = val_mse if self._data is None else torch.where(val_mse.isnan(), self._data, val_mse)
            trust = weigh_physics(self._physics_mse, known)
            taught = self._taught(trust * self._follows(self._physics_mse))
        losses = self._loss.backward(self._simulated, trust, taught)
        self._data = losses.data.to(val_mse)
        clip_gradients(self._weights)
        return losses

    def _follows(self, physics_mse: Tensor) -> Tensor:
        """Whether the physics of each seed follows the measured motion, (S,)."""
        return physics_mse < self._stage.network.scaling.angle_std**2

    def _taught(self, trust: Tensor) -> Taught | None:
        """What predictions are to obey; None where physics has nothing to teach."""
        if self._residual is None or not trust.any():
            return None
        return Taught(self._residual, self.parameters.params, self._recipe.beta * trust)

    def _simulate(self, physics_mse: Tensor) -> Simulated | None:
        """Trials that physics makes with the identified parameters, of seeds whose physics follows the measured ones;
        None where that of no seed does."""
        stage, device = self._stage, self._stage.task.device
        follows = self._follows(physics_mse)
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
        return Simulated(corpus, (inside & follows.unsqueeze(-1)).to(device))


def weigh_physics(physics_mse: Tensor, network_mse: Tensor) -> Tensor:
    """Weight of simulated motion beside measured, (S,) [-]: 1 as long as physics explains the trials as well as the
    network does, then the less the worse it is, and none from `LEAST_TRUST` on.

    Args:
        physics_mse, network_mse: how far each misses measured motion [rad^2], (S,).
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
