"""Training at one scale, for all seeds at once, as a generator of epoch reports (Algorithm 1).

The caller logs, shows, prunes and saves; nothing here knows of it. What an epoch does, and how parameters are
identified, is up to the method: see `methods`.
"""

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from myowave.learning.band import Band, calibrate
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.loss import Losses
from myowave.learning.methods import METHODS, Parameters
from myowave.learning.network import Network
from myowave.learning.prediction import predict_motion, run_free
from myowave.learning.seen import Seen
from myowave.learning.task import Stage, Task, begin_stage
from myowave.learning.windows import Validation

VALIDATE_EVERY = 5  # epochs
FOLD_SEEDS = 2  # that are trained without each trial for the band: as many as tell their spread


@dataclass(frozen=True)
class EpochReport:
    """An epoch in numbers, (S,) each where not said otherwise.

    Args:
        epoch: from 1, within this scale.
        losses: see `loss.Losses`.
        val_mse: on the validation windows, free running [rad^2]; of the last time it was computed. Not a number where
            nothing is kept for validation.
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
        """One row per seed for the history table."""
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
        error = self.val_mse.median().sqrt()
        judged = "" if error.isnan() else f", validation error {error:.2e} rad"
        return f"loss {self.losses.total.median():.2e}{judged}"


def train_scales(task: Task) -> Iterator[Checkpoint]:
    """Train at one scale after the other, the coarsest first; yield what each leaves behind."""
    checkpoint: Checkpoint | None = None
    for level in reversed(range(task.total)):
        *_, last = train_scale(task, level, checkpoint)
        checkpoint = last.checkpoint
        assert checkpoint is not None, "the last report has it"
        yield checkpoint


def train_scale(task: Task, level: int, before: Checkpoint | None = None) -> Iterator[EpochReport]:
    """Train at scale [-level].

    Args:
        before: checkpoint of the next coarser scale, to start from; None at the coarsest.

    Raises:
        ValueError: if the checkpoint does not fit, the trials are too short, or the method cannot hold the model.
    """
    started, recipe = time.perf_counter(), task.recipe
    stage = begin_stage(task, level, before)
    training = METHODS[recipe.method].begin(stage)
    validation, best = begin_validation(stage), _Best(stage.network, judged=recipe.validation_fraction > 0)
    val_mse, val_r2 = validate(stage.network, validation)
    epochs, done = task.epochs(level), sum(task.epochs(coarser) for coarser in range(level + 1, task.total))
    for epoch in range(1, epochs + 1):
        losses = training.learn(epoch, (done + epoch - 1) / recipe.epochs, val_mse)
        last = epoch == epochs
        if last or epoch % VALIDATE_EVERY == 0:
            val_mse, val_r2 = validate(stage.network, validation)
            best.update(epoch, val_mse, val_r2)
            last = last or (recipe.patience is not None and best.exhausted(epoch, recipe.patience))
        values = dict(zip(stage.names, training.parameters.values.unbind(-1), strict=True))
        report = EpochReport(epoch, tuple(task.seeds), losses, val_mse, values)
        if last:
            checkpoint = _checkpoint(stage, training.parameters, best, epoch, time.perf_counter() - started)
            yield replace(report, checkpoint=checkpoint)
            return
        yield report


def begin_validation(stage: Stage) -> Validation | None:
    """The windows kept for validation; None where all samples train."""
    if stage.task.recipe.validation_fraction == 0:
        return None
    return Validation.of(stage.corpus, stage.network, stage.trials.lengths)


@torch.no_grad()
def validate(network: Network, validation: Validation | None) -> tuple[Tensor, Tensor]:
    """Mean square error [rad^2] and R2 of a free run of the validation windows, (S,) each; not a number without any."""
    if validation is None:
        unknown = torch.full((network.seeds,), math.nan, dtype=torch.float64, device=network.device)
        return unknown, unknown.clone()
    z, v = (given.expand(network.seeds, -1, -1) for given in (validation.z, validation.v))
    return validation.score(network.to_rad(run_free(network, validation.x, z, v)))


class _Best:
    """The weights of a network with the lowest validation error of each seed, for early stopping; the last ones where
    nothing is kept for validation.

    It stops only weights: parameters are the last ones, "final converged values" in the paper.
    """

    def __init__(self, network: Network, judged: bool) -> None:
        self._network, self._judged = network, judged
        self.weights = {name: value.detach().clone() for name, value in network.weights.items()}
        self.mse = torch.full((network.seeds,), float("inf"), dtype=torch.float64, device=network.device)
        self.r2 = torch.full_like(self.mse, float("-inf"))
        self._epoch = torch.zeros(network.seeds, device=network.device)

    def update(self, epoch: int, mse: Tensor, r2: Tensor) -> None:
        """Take the weights as they are now, of seeds whose error (S,) has fallen; of all where none is judged."""
        better = mse < self.mse if self._judged else torch.ones_like(mse, dtype=torch.bool)
        self.mse, self.r2 = torch.where(better, mse, self.mse), torch.where(better, r2, self.r2)
        self._epoch = torch.where(better, epoch, self._epoch)
        for name, value in self._network.weights.items():
            self.weights[name] = torch.where(better[:, None, None], value.detach(), self.weights[name])

    def exhausted(self, epoch: int, patience: int) -> bool:
        """Whether no seed has improved for `patience` epochs."""
        return bool((epoch - self._epoch >= patience).all())


def _checkpoint(stage: Stage, parameters: Parameters, best: _Best, epochs: int, seconds: float) -> Checkpoint:
    before, values = stage.before, parameters.values
    errors, correlations = torch.full_like(values, math.nan), torch.full((*values.shape, values.shape[1]), math.nan)
    physics_mse, band = values.new_full(values.shape[:1], math.nan), None
    if stage.level == 0:
        if stage.task.band:
            by = band_by_ends if stage.task.recipe.validation_fraction else band_by_trials
            band = by(replace(stage.network, weights=best.weights), stage)
        errors, correlations = parameters.uncertainty()
        physics_mse = parameters.mse
    return Checkpoint(
        **stage.task.labels,
        level=stage.level,
        epochs=epochs + (before.epochs if before else 0),
        seconds=seconds + (before.seconds if before else 0.0),
        dt=stage.trials.dt,
        channels=stage.trials.channels,
        architecture=stage.network.architecture,
        scaling=stage.network.scaling,
        weights=best.weights,
        names=stage.names,
        values=values,
        errors=errors,
        correlations=correlations,
        physics_mse=physics_mse,
        val_mse=best.mse.cpu(),
        val_r2=best.r2.cpu(),
        band=band,
        seen=Seen.of(stage.trials, stage.network.architecture.known),
        real_time=stage.trials.provenance.get("real_time", {}),
    )


def band_by_ends(network: Network, stage: Stage) -> Band:
    """The band by the ends of the training trials, which no weight was trained on."""
    predicted = predict_motion(network, stage.trials)
    mean, spread = predicted.mean(0).numpy(), predicted.std(0, correction=0).numpy()
    ends = [slice(begin, end) for begin, end in zip(stage.corpus.usable.tolist(), stage.trials.lengths, strict=True)]
    errors = [stage.trials.angle[t, end] - mean[t, end] for t, end in enumerate(ends)]
    return calibrate(errors, [spread[t, end] for t, end in enumerate(ends)])


def band_by_trials(network: Network, stage: Stage) -> Band | None:
    """The band by whole training trials, each predicted by networks that were trained without it; None where there is
    only one trial."""
    # ASSUME: a trial is missed by a few networks that lack one trial as a new trial is by all that have every one.
    task = replace(stage.task, band=False, seeds=stage.task.seeds[:FOLD_SEEDS])
    if len(stage.trials.names) < 2:
        return None
    errors, spreads = [], []
    for name in stage.trials.names:
        *_, checkpoint = train_scales(task.holding_out([name]))
        trial = stage.trials.select([name])
        predicted = predict_motion(checkpoint.network, trial)[:, 0, network.history :].numpy()
        errors.append(trial.angle[0, network.history :] - predicted.mean(0))
        spreads.append(predicted.std(0))
    return calibrate(errors, spreads)
