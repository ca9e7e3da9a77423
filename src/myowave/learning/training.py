"""Training at one scale, for all seeds at once, as a generator of epoch reports (Algorithm 1).

The caller logs, shows, prunes and saves; nothing here knows of it.
"""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.learning.augmentation import imagine_emg, simulate_imagined
from myowave.learning.checkpoint import Checkpoint, digest_model, digest_trials
from myowave.learning.identification import Identification
from myowave.learning.loss import Losses, Noise, RolloutLoss, TeacherForcedLoss
from myowave.learning.network import Architecture, Scaling, initialise
from myowave.learning.parameters import Identified, identify
from myowave.learning.prediction import Network, run_free
from myowave.learning.windows import Corpus, Validation, count_training_samples
from myowave.physics.model import Model
from myowave.settings import Identify, Recipe

VALIDATE_EVERY = 5  # epochs
CLIP = 1.0  # largest norm of a seed's gradient through a rollout
DATA_SEED = 20230  # of windows and made-up EMG, which all seeds share


@dataclass(frozen=True)
class EpochReport:
    """An epoch in numbers, (S,) each where not said otherwise.

    Args:
        epoch: from 1, within this scale.
        losses: see `loss.Losses`.
        val_mse: on the validation windows, free running [rad^2]; of the last time it was computed.
        values: identified parameters by name, SI units.
        checkpoint: with the last report only.
    """

    epoch: int
    seeds: tuple[int, ...]
    losses: Losses
    val_mse: Tensor
    values: Mapping[str, Tensor]
    checkpoint: Checkpoint | None = None

    def rows(self) -> list[dict[str, float]]:
        """A row a seed for the history table."""
        columns = {
            "loss": self.losses.total,
            "data_loss": self.losses.data,
            "residual_loss": self.losses.residual,
            "val_mse": self.val_mse,
            **self.values,
        }
        lists = {name: value.tolist() for name, value in columns.items()}
        return [
            {"epoch": self.epoch, "seed": seed, **{name: values[i] for name, values in lists.items()}}
            for i, seed in enumerate(self.seeds)
        ]

    def summary(self) -> str:
        """The epoch in a few words."""
        return f"loss {self.losses.total.median():.2e}, validation error {self.val_mse.median().sqrt():.2e} rad"


def choose_device() -> torch.device:
    """Where networks train: an accelerator if there is one."""
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def train_scale(
    scales: Mapping[int, Trials],
    model: Model,
    recipe: Recipe,
    wanted: Mapping[str, Identify],
    *,
    level: int,
    total: int,
    seeds: Sequence[int],
    start: Checkpoint | None = None,
    device: torch.device | None = None,
) -> Iterator[EpochReport]:
    """Train at scale [-level], starting from the checkpoint of the next coarser one.

    Args:
        scales: {level: trials at scale [-level]}, with levels 0 and `level`.
        wanted: physical constants to identify.
        total: number of scales that are trained; all have an equal share of the epochs.
        start: None at the coarsest scale.

    Raises:
        ValueError: if the checkpoint does not fit, or the trials are too short.
    """
    run = _Run.prepare(scales, model, recipe, wanted, level, total, tuple(seeds), start, device or choose_device())
    yield from run.epochs()


def count_epochs(recipe: Recipe, level: int, total: int) -> int:
    """Epochs at scale [-level]: an equal share, the remainder at scale [0]."""
    share = recipe.epochs // total
    return recipe.epochs - share * (total - 1) if level == 0 else share


@dataclass
class _Run:
    """Everything that training at one scale works with, and what changes during it."""

    trials: Trials  # training trials at this scale
    model: Model
    recipe: Recipe
    level: int
    total: int
    seeds: tuple[int, ...]
    device: torch.device
    network: Network
    identified: Identified
    raw: Tensor
    corpus: Corpus
    validation: Validation
    before: Checkpoint | None
    labels: dict[str, Any]

    @classmethod
    def prepare(cls, scales, model, recipe, wanted, level, total, seeds, start, device) -> "_Run":
        finest, trials = scales[0].select(scales[0].train), scales[level].select(scales[level].train)
        labels = {
            "dataset": finest.dataset,
            "dataset_digest": digest_trials(scales[0]),
            "model": model.name,
            "model_digest": digest_model(model.defaults, [c.__name__ for c in vars(model.curves).values()]),
            "recipe": recipe.model_dump(mode="json"),
            "scales": total,
            "seeds": seeds,
        }
        identified, raw = identify(model, wanted, trials.constants, seeds)
        if start is None:
            if level != total - 1:
                raise ValueError(f"scale -{level} of {total} starts from the checkpoint of -{level + 1}; none given.")
            architecture = Architecture(
                recipe.cell, recipe.hidden, len(trials.channels), recipe.output == "increment", recipe.time_input
            )
            scaling, weights = Scaling.of(finest), initialise(architecture, seeds, device)
        else:
            start.require(**labels, level=level + 1, names=identified.names)
            architecture, scaling = start.architecture, start.scaling
            weights = {name: value.to(device) for name, value in start.weights.items()}
            raw = start.raw.cpu()
        history = recipe.history_steps
        usable = torch.tensor(count_training_samples(trials, recipe.validation_fraction, history))
        weights = {name: value.clone().requires_grad_() for name, value in weights.items()}
        network = Network(architecture, scaling, weights, recipe.hidden_state == "carried", history)
        emg, angle = torch.from_numpy(trials.emg).to(device), torch.from_numpy(trials.angle).to(device)
        corpus = Corpus.of(architecture, scaling, emg, angle.unsqueeze(0), trials.dt, usable)
        validation = Validation.of(corpus, scaling, trials.lengths, history)
        return cls(
            trials, model, recipe, level, total, seeds, device, network, identified, raw.clone(),
            corpus, validation, start, labels,
        )  # fmt: skip

    def epochs(self) -> Iterator[EpochReport]:
        started = time.perf_counter()
        recipe, network, count = self.recipe, self.network, count_epochs(self.recipe, self.level, self.total)
        joint = recipe.identification == "joint"
        weights = dict(network.weights)
        if joint:
            self.identified = self.identified.to(self.device)
            self.raw = self.raw.to(self.device).requires_grad_()
        loss = self._loss()
        rolls_out = network.carried  # teacher forcing, Eq. 16, is trained by Adam as it stands
        optimizer = torch.optim.Adam(
            [*weights.values(), *([self.raw] if joint else [])],
            lr=recipe.learning_rate,
            betas=(0.9, 0.99 if rolls_out else 0.999),
        )
        search = None
        if not joint:
            search = Identification(self.model, self.trials, self.identified, self.raw, finest=self.level == 0)
        simulates = search is not None and self.level == 0 and recipe.simulated_trials > 0
        simulated = False
        best = _Best(weights, self.raw)
        val_mse, val_r2 = self._validate()
        for epoch in range(1, count + 1):
            optimizer.param_groups[0]["lr"] = recipe.learning_rate * self._decay(epoch, count)
            if search and not search.done:
                search.step()
                self.raw = search.raw
            elif simulates and not simulated:
                self._simulate(loss)
                simulated = True
            if simulated:
                loss.trust = weigh_physics(search.mse.to(self.device), val_mse)
            losses = loss.backward(weights, self.raw)
            if rolls_out:
                clip_gradients(weights)
            optimizer.step()
            last = epoch == count
            if epoch % VALIDATE_EVERY == 0 or last:
                val_mse, val_r2 = self._validate()
                best.update(epoch, val_mse, val_r2, weights, self.raw)
                last = last or best.exhausted(epoch, recipe.patience)
            report = EpochReport(epoch, self.seeds, losses, val_mse, self._values(self.raw))
            if not last:
                yield report
                continue
            yield replace(report, checkpoint=self._checkpoint(best, search, epoch, time.perf_counter() - started))
            return

    def _loss(self) -> RolloutLoss | TeacherForcedLoss:
        recipe = self.recipe
        noise = Noise(recipe.history_noise, self.seeds, self.level)
        if self.network.carried:
            random = torch.Generator().manual_seed(DATA_SEED + self.level)
            steps = max(1, round(recipe.rollout_s / self.trials.dt))
            return RolloutLoss(self.network, self.corpus, steps, noise, random)
        return TeacherForcedLoss(
            self.network, self.model, self.identified, self.trials, self.corpus.usable,
            recipe.beta, recipe.derivative, noise, self.device,
        )  # fmt: skip

    def _decay(self, epoch: int, count: int) -> float:
        """Factor on the step; the cosine runs over all scales together."""
        if self.recipe.schedule == "constant":
            return 1.0
        done = sum(count_epochs(self.recipe, level, self.total) for level in range(self.level + 1, self.total))
        progress = (done + epoch - 1) / self.recipe.epochs
        return 0.5 * (1 + math.cos(math.pi * progress)) * min(1.0, epoch / 20)

    @torch.no_grad()
    def _validate(self) -> tuple[Tensor, Tensor]:
        v, network = self.validation, self.network
        z, step = (given.expand(len(self.seeds), -1, -1) for given in (v.z, v.v))
        return v.score(network.to_rad(run_free(network, v.x, z, step)))

    def _simulate(self, loss: RolloutLoss) -> None:
        """Give the loss trials that physics makes with the identified parameters."""
        params = self.identified.params(self.raw)
        emg = imagine_emg(self.trials, self.recipe.simulated_trials, DATA_SEED)
        angle, usable = simulate_imagined(self.model, params, self.trials, emg, DATA_SEED)
        length = torch.full((len(emg),), emg.shape[1])
        corpus = Corpus.of(
            self.network.architecture, self.network.scaling, torch.from_numpy(emg).to(self.device),
            angle.to(self.device), self.trials.dt, length,
        )  # fmt: skip
        loss.add_simulated(corpus, usable.to(self.device))

    def _values(self, raw: Tensor) -> dict[str, Tensor]:
        values = self.identified.values(raw.detach()).cpu()
        return {name: values[:, i] for i, name in enumerate(self.identified.names)}

    def _checkpoint(self, best: "_Best", search: Identification | None, epochs: int, seconds: float) -> Checkpoint:
        before = self.before
        values = self.identified.values(best.raw).cpu()
        errors, correlations = torch.full_like(values, math.nan), torch.full((*values.shape, values.shape[1]), math.nan)
        if search is not None and self.level == 0:
            errors, correlations = search.uncertainty()
        return Checkpoint(
            **self.labels,
            level=self.level,
            epochs=epochs + (before.epochs if before else 0),
            seconds=seconds + (before.seconds if before else 0.0),
            dt=self.trials.dt,
            channels=self.trials.channels,
            architecture=self.network.architecture,
            scaling=self.network.scaling,
            weights=best.weights,
            names=self.identified.names,
            values=values,
            errors=errors,
            correlations=correlations,
            raw=best.raw.cpu(),
            val_mse=best.mse.cpu(),
            val_r2=best.r2.cpu(),
        )


class _Best:
    """The weights with the lowest validation error of each seed, for early stopping.

    It stops weights alone: parameters are the last ones, "final converged values" in the paper.
    """

    def __init__(self, weights: Mapping[str, Tensor], raw: Tensor) -> None:
        self.weights = {name: value.detach().clone() for name, value in weights.items()}
        self.raw = raw.detach().clone()
        seeds = raw.shape[0]
        device = next(iter(weights.values())).device
        self.mse = torch.full((seeds,), float("inf"), dtype=torch.float64, device=device)
        self.r2 = torch.full_like(self.mse, float("-inf"))
        self._epoch = torch.zeros(seeds, device=device)

    def update(self, epoch: int, mse: Tensor, r2: Tensor, weights: Mapping[str, Tensor], raw: Tensor) -> None:
        better = mse < self.mse
        self.mse, self.r2 = torch.where(better, mse, self.mse), torch.where(better, r2, self.r2)
        self._epoch = torch.where(better, epoch, self._epoch)
        for name, value in weights.items():
            self.weights[name] = torch.where(better[:, None, None], value.detach(), self.weights[name])
        self.raw = raw.detach().clone()

    def exhausted(self, epoch: int, patience: int) -> bool:
        """Whether no seed has improved for `patience` epochs."""
        return bool((epoch - self._epoch >= patience).all())


def weigh_physics(physics_mse: Tensor, network_mse: Tensor) -> Tensor:
    """Weight of simulated motion beside measured, (S,) [-]: 1 as long as physics explains the trials as well as the
    network does, then the less the worse it is.

    Args:
        physics_mse, network_mse: how far each misses measured motion [rad^2], (S,).
    """
    return (network_mse / physics_mse).clamp(max=1.0)


@torch.no_grad()
def clip_gradients(weights: Mapping[str, Tensor]) -> None:
    """Scale each seed's gradient down to a norm of at most `CLIP`."""
    norm = sum(value.grad.square().sum((1, 2)) for value in weights.values()).sqrt()
    factor = (CLIP / norm.clamp(min=CLIP))[:, None, None]
    for value in weights.values():
        value.grad *= factor
