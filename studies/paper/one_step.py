"""Test scores one step ahead (Fig. 4a: every measured angle given), beside the free-running ones of evaluation.csv."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd
import torch

from myowave.data.store import read_trials
from myowave.data.trials import Trials
from myowave.learning.checkpoint import Checkpoint
from myowave.learning.evaluation import evaluate, tested
from myowave.learning.inputs import to_tensors
from myowave.learning.methods.paper.one_step import predict_teacher_forced


def score_one_step(checkpoint: Checkpoint, trials: Trials) -> pd.DataFrame:
    """One row per seed: test_r2_one_step, and acceleration_share, the share of the measured accelerations that the
    predictions have; means over test trials, without the samples that are given."""
    network = checkpoint.network
    trials = trials.thinned(checkpoint.recipe["rate_hz"])
    inputs, angle = to_tensors(trials, network.device, network.architecture.known)
    with torch.no_grad():
        predicted = predict_teacher_forced(network, network.encode_inputs(inputs, trials.dt), angle).cpu()
    rows = evaluate(checkpoint, trials, predicted, recipe="")
    shares = [
        accelerations_seen(predicted[:, t, end].numpy(), trials.angle[t, end])
        for t, end in tested(trials, network.history)
    ]
    return pd.DataFrame(
        {"seed": rows["seed"], "test_r2_one_step": rows["test_r2"], "acceleration_share": np.mean(shares, axis=0)}
    )


def accelerations_seen(predicted: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Share of the measured accelerations that predictions have, (S,): the slope of their second differences.

    Args:
        predicted: one step ahead, (S, N) [rad].
        measured: (N,) [rad].
    """
    wanted, found = np.diff(measured, 2), np.diff(predicted, 2, axis=-1)
    return found @ wanted / (wanted @ wanted)


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
        frames.append(score_one_step(checkpoint, by_dataset[checkpoint.dataset]).assign(**run))
    return pd.concat(frames, ignore_index=True)
