"""What a sweep judges: a recipe trained from the coarsest to the finest scale, run free on held-out data.

Held out are the ends of the training trials, or each training trial in turn. The test trials are in neither.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from myowave.data.trials import Trials
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.prediction import predict_motion
from myowave.learning.sweep.search import Score, Settings
from myowave.learning.task import Task
from myowave.learning.training import train_scales
from myowave.settings import Recipe


def judge(settings: Settings, task: Task, epochs: int | None) -> Iterator[Score]:
    """Train with these settings and yield the free-running error [deg] on the test trials of a task after each scale.

    Args:
        settings: fields of the recipe to replace.
        task: of training trials only, see `holdout.hold_out_ends`; its test trials are their ends.
        epochs: of all scales together; None for those of the recipe.
    """
    for checkpoint in train_scales(_tried(settings, task, epochs)):
        judged = task.scales[checkpoint.level].select(task.scales[0].test)
        yield Score(checkpoint.level, tuple(free_running_error_deg(checkpoint, judged).tolist()))


def judge_in_turn(
    settings: Settings, task: Task, epochs: int | None, names: Sequence[str] | None = None
) -> Iterator[Score]:
    """Train with these settings and each of some trials held out in turn; yield the free-running error [deg] on those
    held out so far, the mean over them, after each.

    Args:
        settings, epochs: as in `judge`.
        task: of training trials only.
        names: of the trials to hold out, at least one, among more; None for each.
    """
    names = task.scales[0].names if names is None else names
    errors, tried = [], _tried(settings, task, epochs)
    for name in names:
        *_, checkpoint = train_scales(tried.holding_out([name]))
        errors.append(free_running_error_deg(checkpoint, task.scales[0].select([name])))
        yield Score(len(names) - len(errors), tuple(np.mean(errors, axis=0).tolist()))


JUDGES: Mapping[str, Callable[..., Iterator[Score]]] = {"ends": judge, "trials": judge_in_turn}  # by `judged_on`


def _tried(settings: Settings, task: Task, epochs: int | None) -> Task:
    """The task with these settings, and no band, which judges nothing."""
    return replace(task, recipe=with_settings(task.recipe, {"band": "none", **settings}, epochs))


def with_settings(recipe: Recipe, settings: Mapping[str, float | str], epochs: int | None = None) -> Recipe:
    """The recipe with some settings replaced, and the number of epochs where one is given and not among them."""
    shorter = {} if epochs is None else {"epochs": epochs}
    return recipe.changed(shorter | dict(settings))


def free_running_error_deg(checkpoint: Checkpoint, trials: Trials) -> np.ndarray:
    """Root mean square error of the free-running prediction over all samples that are not given [deg], (S,)."""
    predicted = predict_motion(checkpoint.network, trials).numpy()
    counted = trials.valid.copy()
    counted[:, : checkpoint.network.history] = False
    squared = np.square(predicted - trials.angle)[:, counted]
    return np.rad2deg(np.sqrt(squared.mean(axis=1)))
