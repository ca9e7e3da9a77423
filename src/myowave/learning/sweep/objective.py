"""What a sweep judges: a recipe trained without each training trial in turn, run free on that trial.

The test trials are in neither: a sweep is given the training trials only.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from myowave.data.trials import Trials
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.prediction import predict_motion
from myowave.learning.sweep.search import HeldOutError, Settings
from myowave.learning.task import Task
from myowave.learning.training import train_scales


def judge(settings: Settings, task: Task, epochs: int | None) -> Iterator[HeldOutError]:
    """Train with these settings and each trial held out in turn; yield the free-running error [deg] on those held out
    so far, the mean over them, after each.

    Args:
        settings: fields of the recipe to replace.
        task: of training trials only.
        epochs: of all scales together, where they are not searched; None for those of the recipe.
    """
    shorter = {} if epochs is None else {"epochs": epochs}
    task, errors = replace(task, recipe=task.recipe.changed(shorter | dict(settings)), band=False), []
    names = task.scales[0].names
    for name in names:
        *_, checkpoint = train_scales(task.holding_out([name]))
        errors.append(free_running_error_deg(checkpoint, task.scales[0].select([name])))
        yield HeldOutError(len(names) - len(errors), tuple(np.mean(errors, axis=0).tolist()))


def free_running_error_deg(checkpoint: Checkpoint, trial: Trials) -> np.ndarray:
    """Root mean square error of the free-running prediction of one trial over all samples that are not given, (S,)."""
    given = checkpoint.network.history
    error = predict_motion(checkpoint.network, trial).numpy()[:, 0, given:] - trial.angle[0, given:]
    return np.rad2deg(np.sqrt(np.square(error).mean(axis=1)))
