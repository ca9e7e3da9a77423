"""Is the residual independent of what drives the arm? If not, structure is left that the model does not explain.

For output-error models independence of the inputs counts; whiteness does not, as measurement noise may be coloured
(Ljung, System Identification, 2nd ed., Sec. 16.6). Two slow signals correlate by chance, and a bound that allows for
that hides all that a slow residual has to say. So the residual is whitened by an autoregressive filter of its own, and
the inputs pass the same filter: what is left of independent noise is white then, whatever its colour was, and its
correlation with any signal is normal with variance 1/n (Box, Jenkins, Reinsel, Time Series Analysis, Sec. 12.2.1).
A fit takes from the noise what its parameters can imitate. That part is left out of the inputs too, or its absence
would look like a correlation.

Shapes: T trials, N samples, M muscles.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter
from scipy.stats import norm

from myowave.identification.output_error import Fit
from myowave.identification.record import SMALLEST_NOISE_DEG

Array = NDArray[np.float64]

LONGEST_LAG_S, LAGS = 0.5, 11
SIGNIFICANCE = 1e-3  # of all inputs and lags together
NOTHING = 1e-6  # share of an input's square that is as good as none
HIGHEST_ORDER = 20  # of the whitening filter; the BIC chooses


@dataclass(frozen=True)
class Independence:
    """Correlation of the residual with the inputs, both through the filter that whitens the residual, and the inputs
    without what the fitted parameters can imitate.

    Args:
        inputs: their names.
        lags_s: how far the input is ahead of the residual [s], (L,).
        correlation: (inputs, L) [-].
        bound: what independent signals exceed at one lag with a probability such that all together do so in 1 of 1000
            recordings, (inputs,) [-].
    """

    inputs: tuple[str, ...]
    lags_s: Array
    correlation: Array
    bound: Array

    @property
    def holds(self) -> bool:
        return bool((np.abs(self.correlation) <= self.bound[:, None]).all())

    @property
    def worst(self) -> str:
        """The input with which the residual has most in common, measured by the bound."""
        return self.inputs[int(np.argmax(np.abs(self.correlation).max(1) / self.bound))]


def check_independence(fit: Fit) -> Independence:
    """Cross-correlate a fit's residual with activations, angle, velocity, gravity and accumulated activation."""
    record, valid = fit.record, fit.record.valid
    signals = inputs_of(fit)
    residual = _centred(fit.normal.residual, valid)
    floor = np.radians(SMALLEST_NOISE_DEG) ** 2  # less than this is as good as nothing
    whitener = whitening_filter(residual, record.samples, floor)
    kept = valid & (np.arange(valid.shape[1]) >= len(whitener) - 1)  # without the filter's run-in
    whiten = partial(_filter, whitener, kept)
    white = whiten(residual)
    fitted = np.concatenate([whiten(fit.normal.slope), _by_trial(whiten(fit.normal.by_start))], -1)
    imitated, _ = np.linalg.qr(fitted.reshape(white.size, -1))
    size = (white**2).sum() + floor * kept.sum()
    longest = max(1, round(LONGEST_LAG_S / record.dt))
    lags = np.unique(np.round(np.linspace(-longest, longest, LAGS)).astype(int))
    critical = norm.isf(SIGNIFICANCE / 2 / (len(signals) * len(lags)))
    correlation = np.empty((len(signals), len(lags)))
    for i, signal in enumerate(signals.values()):
        ahead = np.stack([_ahead(whiten(_centred(signal, valid)), lag) for lag in lags]) * kept
        ahead = ahead.reshape(len(lags), -1)
        alone = ahead - ahead @ imitated @ imitated.T
        # What the parameters imitate entirely says nothing; rounding must not be taken for it.
        scale = np.sqrt(size * np.maximum((alone**2).sum(-1), NOTHING * (ahead**2).sum(-1)))
        correlation[i] = alone @ white.ravel() / np.maximum(scale, 1e-300)
    bound = np.full(len(signals), critical / np.sqrt(kept.sum()))
    return Independence(tuple(signals), lags * record.dt, correlation, bound)


def whitening_filter(residual: Array, samples: int, floor: float) -> Array:
    """Coefficients 1, -a_1, ..., -a_p of the autoregression that predicts a residual from its past.

    Args:
        residual: centred, 0 where padded, (T, N).
        samples: how many are not padding.
        floor: variance of white noise that is taken to be in it besides [of its unit squared].

    Returns:
        The coefficients, (p + 1,), of the order that has the lowest BIC; [1] for white noise.
    """
    covariance = _autocovariance(residual)
    covariance[0] += samples * floor
    best, chosen = samples * np.log(covariance[0]), np.ones(1)
    for order in range(1, min(HIGHEST_ORDER, len(covariance) - 1) + 1):
        past = solve_toeplitz(covariance[:order], covariance[1 : order + 1])
        left = covariance[0] - past @ covariance[1 : order + 1]
        criterion = samples * np.log(left) + order * np.log(samples)
        if criterion < best:
            best, chosen = criterion, np.concatenate([[1.0], -past])
    return chosen


def inputs_of(fit: Fit) -> dict[str, Array]:
    """What drives the arm, at every sample: {name: (T, N)}."""
    drive = fit.simulation.drive
    activation = torch.cat([drive.activation[..., 0, :], drive.activation[..., -1:, -1, :]], -2)
    activation = activation.expand(len(fit.record.names), *activation.shape[-2:]).numpy()
    state = fit.sensitive.motion.state.numpy()
    q, qdot = state[..., 0], state[..., 1]
    signals = {f"activation {m.name}": activation[..., i] for i, m in enumerate(fit.model.muscles)}
    signals |= {"angle": q, "velocity": qdot, "sine of the angle": np.sin(q)}
    total = activation.mean(-1)
    return signals | {"accumulated activation": np.cumsum(total, -1) * fit.record.dt}


def _centred(signal: Array, valid: NDArray[np.bool_]) -> Array:
    mean = (signal * valid).sum(-1, keepdims=True) / valid.sum(-1, keepdims=True)
    return (signal - mean) * valid


def _autocovariance(signal: Array) -> Array:
    """Sums of products at lags 0 ... N / 4, all trials together; beyond, the estimate is noise."""
    spectrum = np.fft.rfft(signal, 2 * signal.shape[-1], axis=-1)
    return np.fft.irfft(np.abs(spectrum) ** 2, axis=-1).sum(0)[: max(2, signal.shape[-1] // 4)]


def _filter(coefficients: Array, kept: NDArray[np.bool_], signal: Array) -> Array:
    """A signal (T, N) or several (T, N, C) through a filter along time; 0 where not kept."""
    filtered = lfilter(coefficients, [1.0], signal, axis=1)
    return filtered * kept.reshape(*kept.shape, *(1,) * (signal.ndim - 2))


def _by_trial(columns: Array) -> Array:
    """Columns (T, N, S) that belong to one trial each, as columns over all trials (T, N, T S)."""
    trials, samples, count = columns.shape
    apart = np.zeros((trials, samples, trials, count))
    apart[np.arange(trials), :, np.arange(trials)] = columns
    return apart.reshape(trials, samples, trials * count)


def _ahead(signal: Array, lag: int) -> Array:
    """The signal (T, N) at t - lag, 0 where there is none."""
    moved = np.roll(signal, lag, axis=-1)
    if lag >= 0:
        moved[:, :lag] = 0.0
    else:
        moved[:, lag:] = 0.0
    return moved
