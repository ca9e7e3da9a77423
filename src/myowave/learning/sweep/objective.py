"""What a sweep judges: a recipe trained from the coarsest to the finest scale, run free on held-out data after each."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from myowave.data.trials import Trials
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.prediction import Network, predict_free_running, to_tensors
from myowave.learning.sweep.study import Score, Settings
from myowave.learning.training import choose_device, train_scale
from myowave.physics.model import Model
from myowave.settings import Identify, Recipe, Sweep


def train_scales(
    scales: Mapping[int, Trials],
    model: Model,
    recipe: Recipe,
    wanted: Mapping[str, Identify],
    *,
    total: int,
    seeds: Sequence[int],
) -> Iterator[Checkpoint]:
    """Train at one scale after the other, the coarsest first; yield what each leaves behind.

    Args:
        scales: {level: trials at scale [-level]}, levels 0 to `total` - 1.
    """
    checkpoint = None
    for level in reversed(range(total)):
        reports = train_scale(scales, model, recipe, wanted, level=level, total=total, seeds=seeds, start=checkpoint)
        for report in reports:
            checkpoint = report.checkpoint
        yield checkpoint


def judge(
    settings: Settings,
    sweep: Sweep,
    scales: Mapping[int, Trials],
    model: Model,
    recipe: Recipe,
    wanted: Mapping[str, Identify],
) -> Iterator[Score]:
    """Train with these settings and yield the free-running error [deg] on the test trials of `scales` after each scale.

    Args:
        settings: fields of the recipe to replace.
        scales: made from training trials alone, see `holdout.hold_out_ends`; its test trials are their ends.
    """
    changed = with_settings(recipe, settings, epochs=sweep.epochs)
    for checkpoint in train_scales(scales, model, changed, wanted, total=sweep.scales, seeds=range(sweep.seeds)):
        judged = scales[checkpoint.level].select(scales[0].test)
        yield Score(checkpoint.level, tuple(free_running_error_deg(checkpoint, judged).tolist()))


def with_settings(recipe: Recipe, settings: Settings, epochs: int | None = None) -> Recipe:
    """The recipe with some settings replaced, and the number of epochs where one is given and not among them."""
    shorter = {} if epochs is None else {"epochs": epochs}
    return Recipe.model_validate(recipe.model_dump() | shorter | dict(settings))


def free_running_error_deg(checkpoint: Checkpoint, trials: Trials) -> np.ndarray:
    """Root mean square error of the free-running prediction over all samples that are not given [deg], (S,)."""
    network = Network.of(checkpoint)
    emg, angle = to_tensors(trials, choose_device())
    predicted = predict_free_running(network, emg, angle, trials.dt).cpu().numpy()
    counted = trials.valid.copy()
    counted[:, : network.history] = False
    squared = np.square(predicted - trials.angle)[:, counted]
    return np.rad2deg(np.sqrt(squared.mean(axis=1)))
