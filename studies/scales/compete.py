"""All ways on the trials of one draw: networks trained with the same budget, and their errors on the unseen trials."""

import time
from collections.abc import Iterable, Iterator, Sequence

import pandas as pd

from myowave.data.trials import Trials
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.evaluation import evaluate
from myowave.learning.prediction import predict_motion
from myowave.learning.task import Task
from myowave.learning.training import train_scales
from myowave.physics.model import Model
from myowave.settings import Recipe
from studies.scales.ways import WAYS, Way


def compete(
    trials: Trials,
    model: Model,
    recipe: Recipe,
    *,
    scales: int,
    seeds: Sequence[int],
    names: Iterable[str] = WAYS,
) -> Iterator[pd.DataFrame]:
    """Scores of one way after the other, one row per seed.

    Args:
        trials: as recorded; their test trials are predicted free running at scale [0].
        recipe: its epochs are those of a way, all stages together.
        scales: number of stages K of ways with several.
        names: of the ways.

    Yields:
        way, seed, test_r2, test_rmse_deg (root mean square over test trials), steps of the optimiser, seconds.
    """
    for name in names:
        started = time.process_time()
        checkpoint = train_way(WAYS[name], trials, model, recipe, scales, seeds)
        rows = evaluate(checkpoint, trials, predict_motion(checkpoint.network, trials), recipe=name)
        steps = checkpoint.epochs * recipe.model_dump().get("batches", 1)
        yield rows[["seed", "test_r2", "test_rmse_deg"]].assign(
            way=name, steps=steps, seconds=time.process_time() - started
        )


def train_way(
    way: Way,
    trials: Trials,
    model: Model,
    recipe: Recipe,
    scales: int,
    seeds: Sequence[int],
) -> Checkpoint:
    """What a way ends with, after its last stage."""
    stages = way.stages(trials, scales)
    epochs = recipe.epochs * (scales if way.times else 1)
    settings = recipe.model_copy(update={"epochs": epochs, "patience": None})  # every way takes all of its steps
    task = Task(stages, model, settings, {}, total=len(stages), seeds=seeds, band=False)
    *_, checkpoint = train_scales(task)
    return checkpoint
