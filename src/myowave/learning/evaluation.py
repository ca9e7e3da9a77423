"""How good a trained network is: metrics of the paper by seed, identified parameters, and the tables they go into."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
import torch
from torch import Tensor

from myowave.data.trials import Trials
from myowave.learning.band import band_about, gather
from myowave.learning.checkpoint import Checkpoint, digest_trials
from myowave.learning.inputs import given_inputs
from myowave.learning.prediction import predict_motion

CONFOUNDED = 0.95  # correlation of two identified parameters above which a note names the pair


def r_squared(measured: Tensor, predicted: Tensor) -> Tensor:
    """R2 [-] over the last axis. Source: Taneja et al. 2023, Eq. 40."""
    spread = (measured - measured.mean(-1, keepdim=True)).square().sum(-1)
    return 1 - (measured - predicted).square().sum(-1) / spread


def score(measured: Tensor, predicted: Tensor) -> dict[str, Tensor]:
    """Metrics over the last axis: MSE [rad^2], R2 [-] and NMSE [-], which has a further 1/n in the paper.

    Source: Taneja et al. 2023, Eqs. 39, 40 and 44."""
    mse, r2 = (measured - predicted).square().mean(-1), r_squared(measured, predicted)
    return {"test_mse": mse, "test_r2": r2, "test_nmse": (1 - r2) / measured.shape[-1]}


def predict_trials(checkpoint: Checkpoint, trials: Trials) -> Tensor:
    """Free-running prediction of all trials, (S, T, N) [rad], or a ValueError where others trained."""
    checkpoint.require(dataset_digest=digest_trials(trials))
    return predict_motion(checkpoint.network, trials)


def evaluate(
    checkpoint: Checkpoint, trials: Trials, predicted: Tensor, *, recipe: str, truth: Mapping[str, float] | None = None
) -> pd.DataFrame:
    """Rows of summary.csv, one per seed, columns as in docs/results.md, of trials at scale [0] and what
    `predict_trials` predicted of them; with the error of parameters whose truth is known."""
    columns: dict[str, Any] = {
        "dataset": checkpoint.dataset,
        "model": checkpoint.model,
        "recipe": recipe,
        "scales": checkpoint.scales,
        "seed": list(checkpoint.seeds),
        **score_trials(trials, predicted, checkpoint.network.history),
        **_band_and_range(checkpoint, trials, predicted),
        "val_r2": checkpoint.val_r2.tolist(),
        "epochs": checkpoint.epochs,
        "seconds": checkpoint.seconds,
    }
    for i, name in enumerate(checkpoint.names):
        values, true = checkpoint.values[:, i].numpy(), (truth or {}).get(name)
        columns[name], columns[f"{name}_se"] = values, checkpoint.errors[:, i].numpy()
        columns[f"{name}_error_pct"] = 100 * (values / true - 1) if true else math.nan  # a truth of 0 has none
    return pd.DataFrame(columns)


def score_trials(trials: Trials, predicted: Tensor, given: int) -> dict[str, list[float]]:
    """Test metrics by name, (S,) each: over all samples but the first `given`, the mean over test trials."""
    angle = torch.from_numpy(trials.angle)
    each = [score(angle[t, end], predicted[:, t, end]) for t, end in tested(trials, given)]
    scores = {name: torch.stack([of[name] for of in each]).mean(0) for name in each[0]}
    scores["test_rmse_deg"] = scores["test_mse"].sqrt().rad2deg()
    return {name: values.tolist() for name, values in scores.items()}


def tested(trials: Trials, given: int) -> list[tuple[int, slice]]:
    """The samples that are scored, by place of their trial: all of the test trials but the first `given`. A ValueError
    for a trial that has no two of them."""
    ends = [(t, slice(given, trials.lengths[t])) for t in trials.index(trials.test)]
    for t, end in ends:
        if end.stop < given + 2:
            raise ValueError(
                f"dataset {trials.dataset!r}, test trial {trials.names[t]!r}: {end.stop} samples are too few "
                f"to score, as the angle of the first {given} is given. Use a longer trial, or lower history_steps."
            )
    return ends


def _band_and_range(checkpoint: Checkpoint, trials: Trials, predicted: Tensor) -> dict[str, float]:
    """Share of the predicted test samples whose angle the band holds, and of those at which EMG, another input, or the
    angle or speed of the prediction is not within the range of the training trials; means over test trials, of the mean
    of all seeds. Without a band the first is not a number."""
    given, mean = checkpoint.network.history, predicted.mean(0).numpy()
    low, high = band_about(predicted.numpy(), checkpoint.band, given)
    quantities = gather(given_inputs(trials, checkpoint.architecture.known), mean, trials.dt)
    inside = (low <= trials.angle) & (trials.angle <= high)
    outside = checkpoint.seen.outside(quantities)
    ends = tested(trials, given)
    return {
        "band_coverage": float(np.mean([inside[end].mean() for end in ends])) if checkpoint.band else math.nan,
        "outside_training": float(np.mean([outside[end].any(-1).mean() for end in ends])),
    }


def tabulate_predictions(checkpoint: Checkpoint, trials: Trials, predicted: Tensor) -> pd.DataFrame:
    """Long table trial, seed, time_s, angle_rad, predicted_rad, low_rad, high_rad, role (train or test); the band from
    low to high is one about the mean of all seeds."""
    low, high = band_about(predicted.numpy(), checkpoint.band, checkpoint.network.history)
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
    rows = [
        (seed, name, float(checkpoint.values[s, i]), float(checkpoint.errors[s, i]), _identifiability(checkpoint, s, i))
        for s, seed in enumerate(checkpoint.seeds)
        for i, name in enumerate(checkpoint.names)
    ]
    return pd.DataFrame(rows, columns=["seed", "parameter", "value", "standard_error", "note"])


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
