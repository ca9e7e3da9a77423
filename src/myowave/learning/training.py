"""Training at one scale, for all seeds at once, as a generator of epoch reports (Algorithm 1).

The caller logs, shows, prunes and saves; nothing here knows of it. What an epoch does, and how parameters are
identified, is up to the method: see `methods`.
"""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from myowave.learning.band import Band, Seen, calibrate
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.methods import TRAININGS, Parameters
from myowave.learning.network import Network
from myowave.learning.prediction import predict_motion
from myowave.learning.task import Losses, Stage, Task, begin_stage
from myowave.learning.windows import Validation

VALIDATE_EVERY = 5  # epochs
FOLD_SEEDS = 2  # that are trained without each trial for the band: as many as tell their spread


@dataclass(frozen=True)
class EpochReport:
    """An epoch in numbers, (S,) each where not said otherwise."""

    epoch: int  # from 1, within this scale
    seeds: tuple[int, ...]
    losses: Losses
    # on the validation windows, free running [rad^2]; of the last time it was computed. Not a number where nothing is
    # kept for validation.
    val_mse: Tensor
    values: dict[str, Tensor]  # identified parameters by name, SI units
    checkpoint: Checkpoint | None = None  # with the last report only

    def rows(self) -> list[dict[str, float]]:
        """One row per seed for the history table."""
        parts = {"loss": self.losses.total, "data_loss": self.losses.data, "residual_loss": self.losses.residual}
        columns = {name: value.tolist() for name, value in (parts | {"val_mse": self.val_mse} | self.values).items()}
        return [
            {"epoch": self.epoch, "seed": seed, **{name: column[i] for name, column in columns.items()}}
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
    """Train at scale [-level], from the checkpoint of the next coarser scale, None at the coarsest. A ValueError as
    from `begin_stage`, or if the method cannot hold the model."""
    started, recipe = time.perf_counter(), task.recipe
    stage = begin_stage(task, level, before)
    training = TRAININGS[recipe.method](stage)
    stopping = _EarlyStopping(stage)
    epochs, done = task.epochs(level), sum(task.epochs(coarser) for coarser in range(level + 1, task.total))
    for epoch in range(1, epochs + 1):
        losses = training.learn(epoch, (done + epoch - 1) / recipe.epochs, stopping.mse)
        last = epoch == epochs
        if last or epoch % VALIDATE_EVERY == 0:
            last = stopping.look(epoch) or last
        values = dict(zip(stage.names, training.parameters.values.unbind(-1), strict=True))
        report = EpochReport(epoch, tuple(task.seeds), losses, stopping.mse, values)
        if last:
            checkpoint = _checkpoint(stage, training.parameters, stopping, epoch, time.perf_counter() - started)
            yield replace(report, checkpoint=checkpoint)
            return
        yield report


class _EarlyStopping:
    """Validation, and the weights with the lowest error of each seed; the last ones where nothing is kept to validate.

    It stops only weights: parameters are the last ones, "final converged values" in the paper. `mse` [rad^2] (S,) is of
    a free run of the validation windows now, not a number without any; `best_mse` with the best weights.
    """

    def __init__(self, stage: Stage) -> None:
        network, recipe = stage.network, stage.task.recipe
        self._network, self._patience = network, math.inf if recipe.patience is None else recipe.patience
        kept = recipe.validation_fraction > 0
        self._validation = Validation(stage.corpus, network, stage.trials.lengths) if kept else None
        self.weights = {name: value.detach().clone() for name, value in network.weights.items()}
        self.variance = self._validation.variance if self._validation else math.nan
        self.mse = self._validate()
        self.best_mse = torch.full_like(self.mse, math.inf)
        self._epoch = torch.zeros_like(self.mse)

    def look(self, epoch: int) -> bool:
        """Validate, and take the weights of seeds whose error has fallen, of all where none is judged; whether no seed
        has improved for as many epochs as the recipe has patience."""
        self.mse = self._validate()
        better = self.mse < self.best_mse if self._validation else torch.ones_like(self.mse, dtype=torch.bool)
        self.best_mse = torch.where(better, self.mse, self.best_mse)
        self._epoch = torch.where(better, epoch, self._epoch)
        for name, value in self._network.weights.items():
            self.weights[name] = torch.where(better[:, None, None], value.detach(), self.weights[name])
        return bool((epoch - self._epoch >= self._patience).all())

    def _validate(self) -> Tensor:
        nothing = torch.full((self._network.seeds,), math.nan, dtype=torch.float64, device=self._network.device)
        return self._validation.mse() if self._validation else nothing


def _checkpoint(
    stage: Stage, parameters: Parameters, stopping: _EarlyStopping, epochs: int, seconds: float
) -> Checkpoint:
    before, values, final = stage.before, parameters.values, stage.level == 0 and stage.task.final
    seeds, count = values.shape
    unknown = (values.new_full(shape, math.nan) for shape in ((seeds, count), (seeds, count, count), (seeds,)))
    errors, correlations, physics_mse = (parameters.judge() if final else None) or unknown
    band = _band(replace(stage.network, weights=stopping.weights), stage, physics_mse) if final else None
    return Checkpoint(
        **stage.task.labels,
        level=stage.level,
        epochs=epochs + (before.epochs if before else 0),
        seconds=seconds + (before.seconds if before else 0.0),
        dt=stage.trials.dt,
        channels=stage.trials.channels,
        architecture=stage.network.architecture,
        scaling=stage.network.scaling,
        weights=stopping.weights,
        names=stage.names,
        values=values,
        errors=errors,
        correlations=correlations,
        physics_mse=physics_mse,
        val_r2=1 - stopping.best_mse.cpu() / stopping.variance,
        band=band,
        seen=Seen.of(stage.trials, stage.network.architecture.known),
        real_time=dict(stage.trials.real_time),
    )


def _band(network: Network, stage: Stage, physics_mse: Tensor) -> Band | None:
    """The band by angles that no weight was trained on: the ends of training trials, or, where nothing is kept for
    validation, whole training trials, each predicted by networks that were trained without it. None by a single one."""
    trials = stage.trials
    if stage.task.recipe.validation_fraction:
        predicted, begins = predict_motion(network, trials).numpy(), stage.corpus.usable.tolist()
        ends = [(t, slice(*at)) for t, at in enumerate(zip(begins, trials.lengths, strict=True))]
        apart = [(trials.angle[t, end], predicted[:, t, end]) for t, end in ends]
    elif len(trials.names) > 1:
        # ASSUME: a trial is missed by a few networks that lack one trial as a new trial is by all that have every one.
        folds = replace(stage.task, seeds=stage.task.seeds[:FOLD_SEEDS])
        if (physics_mse >= network.scaling.angle_std**2).all():  # it taught these networks nothing, nor teaches those
            folds = replace(folds, wanted={}, recipe=folds.recipe.changed({"simulated_trials": 0}))
        apart = list(hold_out_each(folds))
    else:
        return None
    return calibrate([angle - each.mean(0) for angle, each in apart], [each.std(0) for _, each in apart])


def hold_out_each(task: Task) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Hold each training trial out in turn: its angle (K,) and predictions (S, K) [rad] of networks that are trained
    without it, free running, of all samples but those that a prediction starts from."""
    trials = task.training_trials(0)
    for name in trials.names:
        *_, checkpoint = train_scales(replace(task, final=False).holding_out([name]))
        trial, given = trials.select([name]), checkpoint.network.history
        yield trial.angle[0, given:], predict_motion(checkpoint.network, trial)[:, 0, given:].numpy()
