"""Scores of networks and baselines on one split of the trials."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import pandas as pd
from torch import Tensor

from myowave.data.trials import Trials
from myowave.data.wavelets import decompose
from myowave.learning.baselines import given_samples, predict_baseline
from myowave.learning.evaluation import score_trials
from myowave.learning.prediction import predict_motion
from myowave.learning.task import Task
from myowave.learning.training import train_scales
from myowave.physics.model import Model
from myowave.settings import Baseline, Identify, Recipe

# What every method sees: the load where it differs, or EMG over the torque that holds forearm and load, and no load.
INPUTS = {
    "given": {"emg_over": "maximum", "known_inputs": ["load"]},
    "weighed": {"emg_over": "weight", "known_inputs": []},
}


def score_networks(
    trials: Trials, model: Model, recipe: Recipe, wanted: Mapping[str, Identify], wavelet: str, total: int, seeds: int
) -> Iterator[pd.DataFrame]:
    """Tables of networks trained at `total` scales with each kind of inputs, a row for each test trial and seed."""
    for inputs, changes in INPUTS.items():
        own = recipe.changed(changes)
        thinned = trials.thinned(own.rate_hz)
        scales = decompose(thinned, total - 1, wavelet)
        *_, last = train_scales(Task(scales, model, own, wanted, total=total, seeds=range(seeds), final=False))
        predicted = predict_motion(last.network, thinned)
        yield _rows(thinned, predicted, last.network.history, seeds).assign(scales=total, inputs=inputs)


def score_baselines(
    baselines: Mapping[str, Baseline], trials: Trials, model: Model, seeds: int
) -> Iterator[pd.DataFrame]:
    """The same of baselines by name (method)."""
    for inputs, changes in INPUTS.items():
        for name, baseline in baselines.items():
            own = trials.thinned(baseline.rate_hz)
            changed = Baseline.model_validate(baseline.model_dump() | changes)
            rows = _rows(own, predict_baseline(changed, own, model, range(seeds)), given_samples(own), seeds)
            yield rows.assign(method=name, scales=1, inputs=inputs)


def split_trials(trials: Trials, train: Sequence[str], test: Sequence[str]) -> Trials:
    """The trials of a split and no others."""
    return replace(trials.select([*train, *test]), test=tuple(test))


def _rows(trials: Trials, predicted: Tensor, given: int, seeds: int) -> pd.DataFrame:
    """Each test trial by itself, running free: trial, seed, test_r2, test_rmse_deg."""
    tables = [
        pd.DataFrame({"trial": t, "seed": range(seeds)} | score_trials(replace(trials, test=(t,)), predicted, given))
        for t in trials.test
    ]
    return pd.concat(tables, ignore_index=True)[["trial", "seed", "test_r2", "test_rmse_deg"]]
