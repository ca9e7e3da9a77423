"""How good a trained network is: metrics of the paper by seed, identified parameters, and the tables they go into."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from torch import Tensor

from myowave.data.trials import Trials
from myowave.learning.band import band_about
from myowave.learning.checkpoint import Checkpoint, digest_trials
from myowave.learning.inputs import given_inputs
from myowave.learning.prediction import predict_motion
from myowave.learning.seen import gather

CONFOUNDED = 0.95  # correlation of two identified parameters above which a note names the pair


def mean_square_error(measured: Tensor, predicted: Tensor) -> Tensor:
    """MSE [rad^2] over the last axis. Source: Taneja et al. 2023, Eq. 39."""
    return (measured - predicted).square().mean(-1)


def r_squared(measured: Tensor, predicted: Tensor) -> Tensor:
    """R2 [-] over the last axis. Source: Taneja et al. 2023, Eq. 40."""
    spread = (measured - measured.mean(-1, keepdim=True)).square().sum(-1)
    return 1 - (measured - predicted).square().sum(-1) / spread


def normalised_mean_square_error(measured: Tensor, predicted: Tensor) -> Tensor:
    """NMSE [-] over the last axis, with the further 1/n of the paper. Source: Taneja et al. 2023, Eq. 44."""
    return (1 - r_squared(measured, predicted)) / measured.shape[-1]


def predict_trials(checkpoint: Checkpoint, trials: Trials) -> Tensor:
    """Free-running prediction of all trials, (S, T, N) [rad].

    Raises:
        ValueError: for trials that the network was not trained on.
    """
    checkpoint.require(dataset_digest=digest_trials(trials))
    return predict_motion(checkpoint.network, trials)


def evaluate(
    checkpoint: Checkpoint, trials: Trials, predicted: Tensor, *, recipe: str, truth: Mapping[str, float] | None = None
) -> pd.DataFrame:
    """Rows of summary.csv, one per seed.

    Args:
        trials: at scale [0].
        predicted: from `predict_trials`.
        recipe: name of the recipe.
        truth: true values of parameters where they are known.

    Returns:
        Columns as in README, "Results". Test metrics are over predicted samples only, the mean over test trials.
    """
    columns: dict[str, Any] = {
        "dataset": checkpoint.dataset,
        "model": checkpoint.model,
        "recipe": recipe,
        "scales": checkpoint.scales,
        "seed": list(checkpoint.seeds),
    }
    columns |= score_trials(trials, predicted, checkpoint.network.history)
    columns |= _band_and_range(checkpoint, trials, predicted)
    columns |= {"val_r2": checkpoint.val_r2.tolist(), "epochs": checkpoint.epochs, "seconds": checkpoint.seconds}
    for i, name in enumerate(checkpoint.names):
        columns[name] = checkpoint.values[:, i].tolist()
        columns[f"{name}_se"] = checkpoint.errors[:, i].tolist()
        columns[f"{name}_error_pct"] = _error_pct(checkpoint.values[:, i], (truth or {}).get(name)).tolist()
    return pd.DataFrame(columns)


def score_trials(trials: Trials, predicted: Tensor, given: int) -> dict[str, list[float]]:
    """Test metrics by name, (S,) each: over all samples but the first `given`, the mean over test trials."""
    measured, columns = torch.from_numpy(trials.angle), {}
    metrics = {"test_mse": mean_square_error, "test_r2": r_squared, "test_nmse": normalised_mean_square_error}
    for name, metric in metrics.items():
        ends = [(t, trials.lengths[t]) for t in trials.index(trials.test)]
        scores = [metric(measured[t, given:end], predicted[:, t, given:end]) for t, end in ends]
        columns[name] = torch.stack(scores).mean(0).tolist()
    columns["test_rmse_deg"] = np.degrees(np.sqrt(columns["test_mse"])).tolist()
    return columns


def _band_and_range(checkpoint: Checkpoint, trials: Trials, predicted: Tensor) -> dict[str, float]:
    """Share of the predicted test samples whose angle the band holds, and of those at which EMG, another input, or the
    angle or speed of the prediction is not within the range of the training trials; means over test trials, of the mean
    of all seeds. Without a band the first is not a number."""
    given, known = checkpoint.network.history, checkpoint.architecture.known
    inputs, mean = given_inputs(trials, known), predicted.mean(0).numpy()
    low, high = _ends(checkpoint, predicted)
    inside, outside = [], []
    for t in trials.index(trials.test):
        end = trials.lengths[t]
        measured = trials.angle[t, given:end]
        inside.append(np.mean((low[t, given:end] <= measured) & (measured <= high[t, given:end])))
        quantities = gather(inputs[t, :end], mean[t, :end], trials.dt)[given:]
        outside.append(np.mean(checkpoint.seen.outside(quantities).any(-1)))
    return {
        "band_coverage": float(np.mean(inside)) if checkpoint.band else math.nan,
        "outside_training": float(np.mean(outside)),
    }


def _ends(checkpoint: Checkpoint, predicted: Tensor) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper end of the band (T, N) [rad], no numbers where the network has none."""
    if checkpoint.band is None:
        nowhere = np.full(predicted.shape[1:], np.nan)
        return nowhere, nowhere
    return band_about(predicted.numpy(), checkpoint.band, checkpoint.network.history)


def _error_pct(values: Tensor, truth: float | None) -> Tensor:
    """Error in % of the truth; NaN where it is unknown, or 0."""
    return 100 * (values / truth - 1) if truth else torch.full_like(values, float("nan"))


def tabulate_predictions(checkpoint: Checkpoint, trials: Trials, predicted: Tensor) -> pd.DataFrame:
    """Long table trial, seed, time_s, angle_rad, predicted_rad, low_rad, high_rad, role (train or test).

    The band from low to high is one about the mean of all seeds.
    """
    low, high = _ends(checkpoint, predicted)
    frames = [
        pd.DataFrame(
            {
                "trial": name,
                "seed": seed,
                "time_s": trials.time[:length],
                "angle_rad": trials.angle[t, :length],
                "predicted_rad": predicted[s, t, :length].numpy(),
                "low_rad": low[t, :length],
                "high_rad": high[t, :length],
                "role": "test" if name in trials.test else "train",
            }
        )
        for t, (name, length) in enumerate(zip(trials.names, trials.lengths, strict=True))
        for s, seed in enumerate(checkpoint.seeds)
    ]
    return pd.concat(frames, ignore_index=True)


def tabulate_parameters(checkpoint: Checkpoint) -> pd.DataFrame:
    """One row per seed and identified parameter: value, standard error, and a note on identifiability."""
    rows = []
    for s, seed in enumerate(checkpoint.seeds):
        for i, name in enumerate(checkpoint.names):
            rows.append(
                {
                    "seed": seed,
                    "parameter": name,
                    "value": float(checkpoint.values[s, i]),
                    "standard_error": float(checkpoint.errors[s, i]),
                    "note": _identifiability(checkpoint, s, i),
                }
            )
    return pd.DataFrame(rows)


def _identifiability(checkpoint: Checkpoint, seed: int, parameter: int) -> str:
    missed = float(checkpoint.physics_mse[seed])
    if missed >= checkpoint.scaling.angle_std**2:
        how = f"misses the trials by {math.degrees(math.sqrt(missed)):.0f} deg" if missed < math.inf else "diverges"
        return f"not to be trusted: motion simulated with these values {how}"
    correlation = checkpoint.correlations[seed, parameter].clone()
    if correlation.isnan().any():
        return "no standard error: identified jointly with the weights"
    correlation[parameter] = 0
    other = int(correlation.abs().argmax())
    strength = float(correlation[other])
    if abs(strength) > CONFOUNDED:
        return f"hardly distinguished from {checkpoint.names[other]} (correlation {strength:.2f})"
    if other == parameter:
        return "the only one identified"
    return f"distinguished (largest correlation {strength:.2f}, with {checkpoint.names[other]})"
