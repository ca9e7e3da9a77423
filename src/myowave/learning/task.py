"""What is trained, and what training at one of its scales begins with."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.identification.free_parameters import Free, free_parameters, start_values
from myowave.learning.checkpoint import Checkpoint, digest_model, digest_trials
from myowave.learning.inputs import Given, to_tensors
from myowave.learning.network import Architecture, Network, Scaling, initialise
from myowave.learning.windows import Corpus, count_training_samples
from myowave.physics.model import Model
from myowave.physics.simulation import channel_delays
from myowave.settings import Identify, Recipe


@dataclass(frozen=True)
class Task:
    """Networks of one dataset, model and recipe, to be trained at one scale after the other, all seeds at once."""

    scales: Mapping[int, Trials]  # {level: trials at scale [-level]}, level 0 and those at which it is trained
    model: Model
    recipe: Recipe
    wanted: Mapping[str, Identify]  # physical constants to identify
    total: int  # number of scales: 3 trains at levels 2, 1 and 0 in turn
    seeds: Sequence[int]  # numbers of the seeds
    # whether the band about predictions, which may take longer than all else, and standard errors are made
    final: bool = True
    device: torch.device = field(default_factory=lambda: torch.device("cuda" if torch.cuda.is_available() else "cpu"))

    def epochs(self, level: int) -> int:
        """Epochs at scale [-level]: an equal share, the remainder at scale [0]."""
        share = self.recipe.epochs // self.total
        return self.recipe.epochs - share * (self.total - 1) if level == 0 else share

    def training_trials(self, level: int) -> Trials:
        """The trials at scale [-level] without those that test."""
        return self.scales[level].select(self.scales[level].train)

    def holding_out(self, names: Sequence[str]) -> "Task":
        """The same of the training trials only, of which these test."""
        scales = {level: replace(self.training_trials(level), test=tuple(names)) for level in self.scales}
        return replace(self, scales=scales)

    @cached_property
    def labels(self) -> dict[str, Any]:
        """What a checkpoint says of where it comes from; those of all scales are the same."""
        return {
            "dataset": self.scales[0].dataset,
            "dataset_digest": digest_trials(self.scales[0]),
            "model": self.model.name,
            "model_digest": digest_model(self.model),
            "recipe": self.recipe.model_dump(mode="json"),
            "scales": self.total,
            "seeds": tuple(self.seeds),
        }


@dataclass(frozen=True)
class Losses:
    """Loss of each seed, which trains the same by itself or among others, and its parts, (S,) each: `data` [rad^2],
    `residual` [(N m)^2], weights not in them."""

    total: Tensor
    data: Tensor
    residual: Tensor


@dataclass(frozen=True)
class Stage:
    """Training at one scale as it begins."""

    task: Task
    level: int
    trials: Trials  # training trials at this scale; `corpus` as the network sees them
    network: Network  # its weights are leaves that take gradients
    corpus: Corpus
    # what is identified; its search began at `start` (S, P) at the coarsest scale, goes on from `values`
    free: tuple[Free, ...]
    start: Tensor
    values: Tensor
    before: Checkpoint | None = None  # checkpoint of the next coarser scale; None at the coarsest

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(parameter.name for parameter in self.free)


def begin_stage(task: Task, level: int, before: Checkpoint | None = None) -> Stage:
    """Training at scale [-level], from the checkpoint of the next coarser one. A ValueError if that does not fit
    or the trials are too short."""
    recipe, trials = task.recipe, task.training_trials(level)
    free = free_parameters(task.model, task.wanted, trials.known(task.model.defaults))
    start = torch.from_numpy(start_values(free, task.seeds))
    if before is not None:
        before.require(**task.labels, level=level + 1, names=tuple(parameter.name for parameter in free))
        network, values = before.network, before.values.cpu()
    else:
        assert level == task.total - 1, f"scale -{level} of {task.total} starts from the checkpoint of -{level + 1}"
        network, values = fresh_network(task), start
    network = network.trainable(task.device)
    usable = torch.tensor(count_training_samples(trials, recipe.validation_fraction, network.history))
    inputs, angle = to_tensors(trials, task.device, network.architecture.known)
    corpus = Corpus.of(network, inputs, angle.unsqueeze(0), trials.dt, usable)
    return Stage(task, level, trials, network, corpus, free, start, values, before)


def fresh_network(task: Task) -> Network:
    """The network of a task before any training."""
    recipe, finest = task.recipe, task.training_trials(0)
    given = Given.of(finest, task.model, recipe)
    delays = channel_delays(task.model, finest.channels) if recipe.emg_input == "delayed" else ()
    architecture = Architecture(recipe.method, recipe.hidden, len(finest.channels), recipe.history_steps, given, delays)
    return Network(architecture, Scaling.of(finest, given), initialise(architecture, task.seeds))
