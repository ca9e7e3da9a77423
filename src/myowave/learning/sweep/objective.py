"""What a sweep judges: a recipe trained without each training trial in turn, run free on that trial.

The test trials are in neither: a sweep is given the training trials only.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from myowave.learning.sweep.search import Judgement, Settings
from myowave.learning.task import Task
from myowave.learning.training import hold_out_each


def judge(settings: Settings, task: Task, epochs: int | None) -> Iterator[Judgement]:
    """Train with these settings in the recipe and each trial of the task held out in turn; yield the root mean square
    error [deg] of those held out so far, the mean over them, after each. Where they are not searched, `epochs` are of
    all scales together; None for those of the recipe."""
    shorter = {} if epochs is None else {"epochs": epochs}
    task, errors = replace(task, recipe=task.recipe.changed(shorter | dict(settings))), []
    for angle, predicted in hold_out_each(task):
        errors.append(np.rad2deg(np.sqrt(np.square(predicted - angle).mean(axis=1))))
        yield len(task.scales[0].names) - len(errors), np.mean(errors, axis=0).tolist()
