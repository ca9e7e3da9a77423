"""Scores of networks and baselines on one split of the trials."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import pandas as pd
from torch import Tensor

from myowave.data.thinning import thin
from myowave.data.trials import Trials
from myowave.data.wavelets import decompose
from myowave.learning.baselines import given_samples, predict_baseline
from myowave.learning.evaluation import score_trials
from myowave.learning.prediction import predict_motion
from myowave.learning.task import Task
from myowave.learning.training import train_scales
from myowave.physics.model import Model
from myowave.settings import Baseline, Identify, Recipe


def split_trials(trials: Trials, train: Sequence[str], test: Sequence[str]) -> Trials:
    """The trials of a split and no others."""
    return replace(trials.select([*train, *test]), test=tuple(test))


def score_networks(
    trials: Trials,
    model: Model,
    recipe: Recipe,
    wanted: Mapping[str, Identify],
    wavelet: str,
    total: int,
    seeds: Sequence[int],
) -> pd.DataFrame:
    """A row for each test trial and seed: trial, scales, seed, test_r2, test_rmse_deg."""
    trials = thin(trials, recipe.rate_hz)
    task = Task(decompose(trials, total - 1, wavelet), model, recipe, wanted, total=total, seeds=seeds, final=False)
    *_, checkpoint = train_scales(task)
    network = checkpoint.network
    return _rows(trials, predict_motion(network, trials), network.history, seeds).assign(scales=total)


def score_baselines(
    baselines: Mapping[str, Baseline], changes: Mapping[str, Any], trials: Trials, model: Model, seeds: Sequence[int]
) -> pd.DataFrame:
    """The same of baselines by name (method), with other inputs."""
    tables = []
    for name, baseline in baselines.items():
        own = thin(trials, baseline.rate_hz)
        changed = Baseline.model_validate(baseline.model_dump() | dict(changes))
        rows = _rows(own, predict_baseline(changed, own, model, seeds), given_samples(own), seeds)
        tables.append(rows.assign(method=name, scales=1))
    return pd.concat(tables, ignore_index=True)


def _rows(trials: Trials, predicted: Tensor, given: int, seeds: Sequence[int]) -> pd.DataFrame:
    tables = [
        pd.DataFrame(
            {"trial": name, "seed": list(seeds)} | score_trials(replace(trials, test=(name,)), predicted, given)
        )
        for name in trials.test
    ]
    return pd.concat(tables, ignore_index=True).drop(columns=["test_mse", "test_nmse"])
