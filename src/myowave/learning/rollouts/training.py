"""How a network learns from rollouts: its own predictions feed it, and physics tells it what was never measured.

In the first epochs at a scale, a Gauss-Newton search identifies the parameters, a step in each epoch. At scale [0],
motion is then simulated with them, and half of the windows to train on come from it. Physics whose own motion misses
the measured trials by more than their spread has nothing to teach: nothing is simulated with it.
"""

import operator
from collections.abc import Iterable
from functools import reduce

import numpy as np
import torch
from torch import Tensor

from myowave.learning.augmentation import imagine_emg, simulate_imagined
from myowave.learning.identification import Identification
from myowave.learning.inputs import told_of
from myowave.learning.loss import Losses, Noise
from myowave.learning.rollouts.loss import RolloutLoss, Simulated
from myowave.learning.task import Stage
from myowave.learning.unidentified import Unidentified
from myowave.learning.windows import Corpus

CLIP = 1.0  # largest norm of a seed's gradient through a rollout
DATA_SEED = 20230  # of windows and made-up EMG, which all seeds share


class RolloutTraining:
    """An epoch is one step of Adam on windows of all training trials; see `methods.Method`."""

    betas = (0.9, 0.99)

    def __init__(self, stage: Stage) -> None:
        recipe, finest = stage.task.recipe, stage.level == 0
        self.trained = list(stage.network.weights.values())
        self._stage = stage
        self.search: Identification | Unidentified
        if recipe.identification == "none":
            self.search = Unidentified(stage.values)
        else:
            self.search = Identification(stage.task.model, stage.trials, stage.free, stage.values, finest=finest)
        self._loss = RolloutLoss(
            stage.network,
            stage.corpus,
            max(1, round(recipe.rollout_s / stage.trials.dt)),
            Noise(recipe.history_noise, stage.task.seeds, stage.level),
            torch.Generator().manual_seed(DATA_SEED + stage.level),
            Noise(recipe.emg_gain, stage.task.seeds, stage.level, stream=1) if recipe.emg_gain else None,
            Noise(recipe.known_noise, stage.task.seeds, stage.level, stream=2) if recipe.known_noise else None,
        )
        self._data: Tensor | None = None  # loss on windows of the epoch before
        self._simulates = finest and recipe.simulated_trials > 0
        self._simulated: Simulated | None = None

    def differentiate(self, val_mse: Tensor) -> Losses:
        if isinstance(self.search, Identification) and not self.search.done:
            self.search.step()
        elif self._simulates and self._simulated is None:
            self._simulated = self._simulate()
            self._simulates = self._simulated is not None
        known = val_mse if self._data is None else torch.where(val_mse.isnan(), self._data, val_mse)
        trust = None if self._simulated is None else weigh_physics(self.search.mse.to(val_mse.device), known)
        losses = self._loss.backward(self._simulated, trust)
        self._data = losses.data.to(val_mse)
        clip_gradients(self.trained)
        return losses

    def _simulate(self) -> Simulated | None:
        """Trials that physics makes with the identified parameters, of seeds whose physics follows the measured ones;
        None where that of no seed does."""
        stage, device = self._stage, self._stage.task.device
        follows = self.search.mse < stage.network.scaling.angle_std**2
        if not follows.any():
            return None
        emg = imagine_emg(stage.trials, stage.task.recipe.simulated_trials, DATA_SEED)
        angle, inside, donors = simulate_imagined(stage.task.model, self.search.params, stage.trials, emg, DATA_SEED)
        told = told_of(stage.trials, donors, stage.network.architecture.known, emg.shape[1])
        inputs = torch.from_numpy(np.concatenate([emg, told], axis=-1)).to(device)
        usable = torch.full((len(emg),), emg.shape[1])
        corpus = Corpus.of(stage.network, inputs, angle.to(device), stage.trials.dt, usable)
        return Simulated(corpus, (inside & follows.unsqueeze(-1)).to(device))


def weigh_physics(physics_mse: Tensor, network_mse: Tensor) -> Tensor:
    """Weight of simulated motion beside measured, (S,) [-]: 1 as long as physics explains the trials as well as the
    network does, then the less the worse it is.

    Args:
        physics_mse, network_mse: how far each misses measured motion [rad^2], (S,).
    """
    return (network_mse / physics_mse).clamp(max=1.0)


@torch.no_grad()
def clip_gradients(weights: Iterable[Tensor]) -> None:
    """Scale each seed's gradient down to a norm of at most `CLIP`; weights have the seeds as leading axis."""
    gradients = [value.grad for value in weights if value.grad is not None]
    norm = reduce(operator.add, (gradient.square().sum((1, 2)) for gradient in gradients)).sqrt()
    factor = (CLIP / norm.clamp(min=CLIP))[:, None, None]
    for gradient in gradients:
        gradient.mul_(factor)
