"""All arms on the trials of one draw: networks trained with the same budget, and their errors on the unseen trials."""

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
import pandas as pd
import torch

from myowave.data.trials import Trials
from myowave.learning.evaluation import mean_square_error, r_squared
from myowave.learning.network import Network
from myowave.learning.prediction import predict_motion
from myowave.learning.task import Task
from myowave.learning.training import train_scales
from myowave.physics.model import Model
from myowave.settings import Identify, Recipe
from studies.scales.arms import ARMS, Arm


def compete(
    trials: Trials,
    model: Model,
    recipe: Recipe,
    identify: Mapping[str, Identify],
    *,
    scales: int,
    seeds: Sequence[int],
    names: Iterable[str] = ARMS,
) -> Iterator[pd.DataFrame]:
    """Scores of one arm after the other, one row per seed.

    Args:
        trials: as recorded; their test trials are predicted free running at scale [0].
        recipe: its epochs are those of an arm, all stages together.
        scales: number of stages K of arms with several.
        names: of the arms.

    Yields:
        arm, seed, test_r2, test_rmse_deg (root mean square over test trials), steps of the optimiser, seconds.
    """
    for name in names:
        arm, started = ARMS[name], time.process_time()
        network, steps = train_arm(arm, trials, model, recipe, identify, scales, seeds)
        tests = trials.select(trials.test)
        angle, predicted = torch.from_numpy(tests.angle), predict_motion(network, tests)
        mse, r2 = (
            np.mean(
                [
                    score(angle[t, network.history : n], predicted[:, t, network.history : n]).tolist()
                    for t, n in enumerate(tests.lengths)
                ],
                axis=0,
            )
            for score in (mean_square_error, r_squared)
        )
        columns = {"arm": name, "seed": list(seeds), "test_r2": r2, "test_rmse_deg": np.degrees(np.sqrt(mse))}
        yield pd.DataFrame({**columns, "steps": steps, "seconds": time.process_time() - started})


def train_arm(
    arm: Arm,
    trials: Trials,
    model: Model,
    recipe: Recipe,
    identify: Mapping[str, Identify],
    scales: int,
    seeds: Sequence[int],
) -> tuple[Network, int]:
    """The network that an arm ends with, and how many steps it took."""
    stages = arm.stages(trials, scales)
    epochs = recipe.epochs * (scales if arm.times else 1)
    # What validates stops no stage: every arm takes all of its steps.
    settings = recipe.model_copy(update={"epochs": epochs, "epochs_are": "shared", "patience": epochs})
    task = Task(stages, model, settings, identify, total=len(stages), seeds=seeds)
    *_, checkpoint = train_scales(task)
    return checkpoint.network, checkpoint.epochs * settings.batches
