"""Test scores one step ahead (Fig. 4a: every measured angle given), beside the free-running ones of evaluation.csv."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd
import torch

from myowave.data.store import read_trials
from myowave.data.thinning import thin
from myowave.data.trials import Trials
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.evaluation import r_squared
from myowave.learning.paper.windowed import first_predicted, predict_teacher_forced
from myowave.learning.prediction import to_tensors
from studies.paper.bias import accelerations_seen


def score_one_step(checkpoint: Checkpoint, trials: Trials) -> tuple[list[float], list[float]]:
    """Test R2 of each seed, and the share of the accelerations that it predicts, means over test trials, without the
    samples that are given.
    """
    network = checkpoint.network
    trials = thin(trials, checkpoint.recipe["rate_hz"])
    inputs, angle = to_tensors(trials.select(trials.test), network.device, network.architecture.known)
    with torch.no_grad():
        predicted = predict_teacher_forced(network, network.encode_inputs(inputs, trials.dt), angle)
    lengths = [trials.lengths[t] for t in trials.index(trials.test)]
    given = first_predicted(network)
    scores = [r_squared(angle[t, given:n], predicted[:, t, given:n]) for t, n in enumerate(lengths)]
    shares = [
        accelerations_seen(predicted[:, t, given:n].cpu().numpy(), angle[t, given:n].cpu().numpy())
        for t, n in enumerate(lengths)
    ]
    return torch.stack(scores).mean(0).tolist(), np.mean(shares, axis=0).tolist()


def tabulate_one_step(checkpoints: Iterable[str], trials: Iterable[str]) -> pd.DataFrame:
    """One row per run and seed: dataset, recipe, scales, seed, test_r2_one_step, acceleration_share.

    Args:
        checkpoints: paths that end in `{dataset}/{model}/{recipe}/{scales}-scale/{file}`.
        trials: of all their datasets.
    """
    read = [read_trials(path) for path in trials]
    by_dataset = {each.dataset: each for each in read}
    frames = []
    for path in checkpoints:
        checkpoint, recipe = Checkpoint.load(path), Path(path).parts[-3]
        run = {"dataset": checkpoint.dataset, "recipe": recipe, "scales": checkpoint.scales}
        scores, shares = score_one_step(checkpoint, by_dataset[checkpoint.dataset])
        columns = {"seed": list(checkpoint.seeds), "test_r2_one_step": scores, "acceleration_share": shares}
        frames.append(pd.DataFrame(run | columns))
    return pd.concat(frames, ignore_index=True)
