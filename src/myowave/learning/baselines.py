"""What an engineer would try first: predictors of the angle without physics, scales or their own predictions.

They have the same trials, inputs and scores as the networks. All but `hold` see EMG, and what is told beside it, of the
last `REACH_S`, and nothing of the angle. What they are set to was chosen on training trials of the person, each left
out in turn.

Shapes: S seeds, T trials, N samples, X inputs, B pieces, K samples of a piece, H channels of a layer.
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import pandas as pd
import torch
import torch.nn.functional as F
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.linear_model import RidgeCV
from sklearn.model_selection import LeaveOneGroupOut
from torch import Tensor

from myowave.data.trials import Array, Trials
from myowave.learning.evaluation import score_trials
from myowave.learning.inputs import Given, given_inputs
from myowave.learning.network import Scaling
from myowave.learning.optimisers import Adam
from myowave.physics.model import Model
from myowave.settings import Baseline

GIVEN_S = 0.16  # known angles at the start, as long as the recipes have them [s]
REACH_S = 2.4  # of EMG that an angle is predicted from [s]; at 25 Hz the convolution reaches as far
TREE_LAGS = 16  # of those: trees gain nothing by neighbours that are alike
TREES = {"max_iter": 150, "learning_rate": 0.1, "max_leaf_nodes": 15, "max_features": 0.5, "early_stopping": False}
PENALTIES = 10.0 ** np.arange(0, 6)  # of ridge, of which training trials left out in turn choose
WIDTH, KERNEL, DILATIONS = 32, 5, (1, 2, 4, 8)  # of the convolution; a gru has as many units
# Trained on pieces of trials, in a step on a quarter more than all samples, but on so few or many seconds; half of them
# and three quarters of the steps cost 0.014 of R2. R2 on training trials left out in turn, of the person and of case 3:
# gru with pieces of 8 s 0.927 and 0.851, of 4 s 0.941 and 0.847 in two thirds of the time.
PIECE_S, STEP_S, STEPS = {"gru": 4.0, "convolution": 8.0}, (64.0, 128.0), 400
RATE, BETAS, DECAY, GAIN = 3e-3, (0.9, 0.999), 1e-3, 0.2  # of Adam; of the gains of EMG, log-normal


@dataclass(frozen=True)
class Standardised:
    """Trials as a baseline sees them."""

    x: tuple[Array, ...]  # inputs of each trial, (N_i, X) each, the first `channels` of them EMG
    z: tuple[Array, ...]  # angles, (N_i,) each
    zero: Array  # value of an EMG of 0, (channels,)
    train: tuple[int, ...]  # which of the trials train
    dt: float


def score_baseline(
    baseline: Baseline, trials: Trials, model: Model, seeds: Sequence[int], *, name: str
) -> pd.DataFrame:
    """Rows of summary.csv, one per seed, of a baseline that is trained on the training trials, which are at the rate at
    which they were stored; the column recipe has its name."""
    started, trials = time.perf_counter(), trials.thinned(baseline.rate_hz)
    predicted = predict_baseline(baseline, trials, model, seeds)
    labels = {"dataset": trials.dataset, "model": "base", "recipe": name, "scales": 1, "seed": list(seeds)}
    rows = pd.DataFrame(labels | score_trials(trials, predicted, given_samples(trials)))
    epochs = STEPS if baseline.kind in TRAINED else 0
    nothing = dict.fromkeys(("band_coverage", "outside_training", "val_r2"), math.nan)
    return rows.assign(**nothing, epochs=epochs, seconds=time.perf_counter() - started)


def predict_baseline(baseline: Baseline, trials: Trials, model: Model, seeds: Sequence[int]) -> Tensor:
    """Angles of all trials, (S, T, N) [rad], by a baseline that is trained on the training trials."""
    train = trials.select(trials.train)
    given = Given.of(train, model, baseline)
    scaling = Scaling.of(train, given)
    inputs = (given.see(given_inputs(trials, given.known)) - scaling.input_mean) / scaling.input_std
    angle = (trials.angle - scaling.angle_mean) / scaling.angle_std
    channels = slice(len(trials.channels))
    seen = Standardised(
        tuple(x[:n] for x, n in zip(inputs, trials.lengths, strict=True)),
        tuple(z[:n] for z, n in zip(angle, trials.lengths, strict=True)),
        -np.array(scaling.input_mean[channels]) / scaling.input_std[channels],
        tuple(trials.index(train.names)),
        trials.dt,
    )
    known = given_samples(trials)
    predicted = torch.from_numpy(angle).expand(len(seeds), -1, -1).clone()
    if baseline.kind == "hold":
        predicted[..., known:] = predicted[..., known - 1, None]
    else:
        for t, by_seed in enumerate(PREDICTORS[baseline.kind](seen, seeds)):
            predicted[:, t, known : trials.lengths[t]] = torch.as_tensor(by_seed).double()[:, known:]
    return predicted * scaling.angle_std + scaling.angle_mean


def given_samples(trials: Trials) -> int:
    """Samples at the start whose angle is known."""
    return max(2, round(GIVEN_S / trials.dt))


def _lagged(x: Array, lags: Sequence[int]) -> Array:
    """Inputs (N, X) as they were so many samples ago, the first held before it, (N, lags X)."""
    at = np.arange(len(x))
    return np.concatenate([x[np.maximum(at - lag, 0)] for lag in lags], axis=1)


def _lagged_trials(seen: Standardised, lags: Sequence[int]) -> tuple[list[Array], Array, Array]:
    """Lagged inputs of each trial, and those and the angles of all that train, one after the other."""
    x = [_lagged(values, lags) for values in seen.x]
    return x, np.concatenate([x[t] for t in seen.train]), np.concatenate([seen.z[t] for t in seen.train])


def _ridge(seen: Standardised, seeds: Sequence[int]) -> list[Array]:
    """Linear in the inputs of all samples within reach; seeds agree."""
    x, *data = _lagged_trials(seen, range(round(REACH_S / seen.dt) + 1))
    rows = np.repeat(seen.train, [len(seen.z[t]) for t in seen.train])
    each_out = list(LeaveOneGroupOut().split(rows, groups=rows)) if len(seen.train) > 1 else None
    fit = RidgeCV(PENALTIES, fit_intercept=False, cv=each_out, scoring="neg_mean_squared_error").fit(*data)
    return [np.tile(fit.predict(values), (len(seeds), 1)) for values in x]


def _trees(seen: Standardised, seeds: Sequence[int]) -> list[Array]:
    """Boosted regression trees."""
    lags = np.unique(np.linspace(0, round(REACH_S / seen.dt), TREE_LAGS).astype(int)).tolist()
    x, *data = _lagged_trials(seen, lags)
    fits = [HistGradientBoostingRegressor(**TREES, random_state=seed).fit(*data) for seed in seeds]
    return [np.stack([fit.predict(values) for fit in fits]) for values in x]


Weights = dict[str, Tensor]
Run = Callable[[Weights, Tensor], Tensor]


def _convolution(weights: Weights, x: Tensor) -> Tensor:
    """Dilated causal layers, the first sample held before it: inputs (S, B, X, K) to angles (S, B, K)."""
    seeds = len(x)
    x = x.transpose(0, 1).flatten(1, 2)  # the seeds are groups of channels
    for i, dilation in enumerate(DILATIONS):
        kernel, bias = (weights[f"{name}{i}"].flatten(0, 1) for name in ("layer", "bias"))
        padded = F.pad(x, ((KERNEL - 1) * dilation, 0), mode="replicate")
        made = F.gelu(F.conv1d(padded, kernel, bias, dilation=dilation, groups=seeds))
        x = made if i == 0 else x + made
    return _read_out(weights, x.unflatten(1, (seeds, -1)).transpose(0, 1))


def _gru(weights: Weights, x: Tensor) -> Tensor:
    """Gated recurrent units that see no angle: inputs (S, B, X, K) to angles (S, B, K)."""
    x = x.movedim(3, 1).transpose(2, 3)  # (S, K, X, B): what a step works on is then one block
    driven = (weights["input"].unsqueeze(1) @ x + weights["bias"].unsqueeze(1)).transpose(0, 1).contiguous()
    parts = driven.split((2 * WIDTH, WIDTH), dim=2)
    hidden, states = driven.new_zeros(len(x), WIDTH, x.shape[-1]), []
    for gates, candidate in zip(*(part.unbind(0) for part in parts), strict=True):
        gates_back, candidate_back = torch.bmm(weights["hidden"], hidden).split((2 * WIDTH, WIDTH), dim=1)
        reset, update = torch.sigmoid(gates + gates_back).split(WIDTH, dim=1)
        hidden = torch.lerp(torch.tanh(torch.addcmul(candidate, reset, candidate_back)), hidden, update)
        states.append(hidden)
    return _read_out(weights, torch.stack(states, dim=-1).transpose(1, 2))


def _read_out(weights: Weights, x: Tensor) -> Tensor:
    """Angles (S, B, K) from the last layer (S, B, H, K)."""
    return torch.einsum("sbhk,sh->sbk", x, weights["output"]) + weights["output_bias"].unsqueeze(-1)


def _start(kind: str, inputs: int, seed: int) -> Weights:
    """Fresh weights of a seed."""
    random = torch.Generator().manual_seed(seed)

    def uniform(rows: int, columns: int) -> Tensor:
        return (2 * torch.rand(rows, columns, generator=random) - 1) / math.sqrt(columns)

    if kind == "gru":
        weights = {"input": uniform(3 * WIDTH, inputs), "hidden": uniform(3 * WIDTH, WIDTH)}
        weights["bias"] = torch.zeros(3 * WIDTH, 1)
    else:
        widths = {f"layer{i}": WIDTH if i else inputs for i in range(len(DILATIONS))}
        weights = {name: uniform(WIDTH, KERNEL * n).unflatten(1, (KERNEL, n)).mT for name, n in widths.items()}
        weights |= {f"bias{i}": torch.zeros(WIDTH) for i in range(len(DILATIONS))}
    return weights | {"output": uniform(1, WIDTH)[0], "output_bias": torch.zeros(1)}


def _train(kind: str, seen: Standardised, seeds: Sequence[int]) -> list[Tensor]:
    run, each = TRAINED[kind], [_start(kind, seen.x[0].shape[1], seed) for seed in seeds]
    weights = {name: torch.stack([of[name] for of in each]).requires_grad_() for name in each[0]}
    randoms = [np.random.default_rng([seed, 17]) for seed in seeds]
    optimiser = Adam(list(weights.values()), BETAS, DECAY)
    for step in range(STEPS):
        drawn = zip(*(_draw(seen, PIECE_S[kind], random) for random in randoms), strict=True)
        x, z = (torch.from_numpy(np.stack(part)).float() for part in drawn)
        optimiser.zero_grad()
        (run(weights, x) - z).square().mean((1, 2)).sum().backward()
        optimiser.move(RATE * 0.5 * (1 + math.cos(math.pi * step / STEPS)))
    with torch.no_grad():
        whole = (torch.from_numpy(x.T.copy()).float().expand(len(seeds), 1, -1, -1) for x in seen.x)
        return [run(weights, x)[:, 0] for x in whole]


def _draw(seen: Standardised, piece_s: float, random: np.random.Generator) -> tuple[Array, Array]:
    """Pieces of training trials under other gains of their EMG: inputs (B, X, K) and angles (B, K)."""
    lengths = np.array([len(seen.z[t]) for t in seen.train])
    length = min(round(piece_s / seen.dt), *lengths)
    places = lengths - length + 1.0
    count = round(np.clip(1.25 * lengths.sum() * seen.dt, *STEP_S) / (length * seen.dt))
    chosen = random.choice(seen.train, size=count, p=places / places.sum())
    pieces = [(t, random.integers(len(seen.z[t]) - length + 1)) for t in chosen]
    x = np.stack([seen.x[t][at : at + length].T for t, at in pieces])
    channels = len(seen.zero)
    gain, zero = np.exp(GAIN * random.standard_normal((channels, count, 1))), seen.zero[:, None]
    x[:, :channels] = zero + gain.transpose(1, 0, 2) * (x[:, :channels] - zero)
    return x, np.stack([seen.z[t][at : at + length] for t, at in pieces])


TRAINED: Mapping[str, Run] = {"gru": _gru, "convolution": _convolution}
PREDICTORS: Mapping[str, Callable[[Standardised, Sequence[int]], Sequence[Array | Tensor]]] = {
    "ridge": _ridge,
    "trees": _trees,
    **{kind: partial(_train, kind) for kind in TRAINED},
}
