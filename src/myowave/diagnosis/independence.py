"""Is the residual independent of what drives the arm? If not, structure is left that the model does not explain.

For output-error models independence of the inputs counts; whiteness does not, as measurement noise may be coloured
(Ljung, System Identification, 2nd ed., Sec. 16.6).

Shapes: T trials, N samples, M muscles.
"""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.stats import norm

from myowave.diagnosis.fit import Fit
from myowave.diagnosis.record import SMALLEST_NOISE_DEG
from myowave.physics.model import bind
from myowave.physics.motion import drive_muscles

Array = NDArray[np.float64]

LONGEST_LAG_S, LAGS = 0.5, 11
SIGNIFICANCE = 1e-3  # of all inputs and lags together


@dataclass(frozen=True)
class Independence:
    """Correlation of the residual with the inputs.

    Args:
        inputs: their names.
        lags_s: how far the input is ahead of the residual [s], (L,).
        correlation: (inputs, L) [-].
        bound: what independent signals of the same spectra exceed at one lag with a probability such that all together
            do so in 1 of 1000 recordings, (inputs,) [-].
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
    valid = fit.record.valid
    signals = inputs_of(fit)
    residual = _centred(fit.normal.residual, valid)
    own = _autocovariance(residual)
    own[0] += fit.record.samples * np.radians(SMALLEST_NOISE_DEG) ** 2  # less than this is as good as nothing
    longest = max(1, round(LONGEST_LAG_S / fit.record.dt))
    lags = np.unique(np.round(np.linspace(-longest, longest, LAGS)).astype(int))
    critical = norm.isf(SIGNIFICANCE / 2 / (len(signals) * len(lags)))
    correlation, bound = np.empty((len(signals), len(lags))), np.empty(len(signals))
    for i, signal in enumerate(signals.values()):
        centred = _centred(signal, valid)
        theirs = _autocovariance(centred)
        scale = max(np.sqrt(own[0] * theirs[0]), 1e-300)
        correlation[i] = [_product(residual, centred, lag) / scale for lag in lags]
        # Bartlett: the variance of a cross-correlation is the sum of the products of the autocorrelations.
        spread = (own[0] * theirs[0] + 2 * (own[1:] * theirs[1:]).sum()) / fit.record.samples
        bound[i] = critical * np.sqrt(max(spread, own[0] * theirs[0] / fit.record.samples)) / scale
    return Independence(tuple(signals), lags * fit.record.dt, correlation, bound)


def inputs_of(fit: Fit) -> dict[str, Array]:
    """What drives the arm, at every sample: {name: (T, N)}."""
    bound = bind(fit.model, fit.params, fit.record.emg)
    drive = drive_muscles(bound, fit.record.emg, fit.record.dt)
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


def _product(residual: Array, signal: Array, lag: int) -> float:
    """Sum over time of the residual at t times the signal at t - lag."""
    if lag >= 0:
        return float((residual[:, lag:] * signal[:, : signal.shape[-1] - lag]).sum())
    return float((residual[:, :lag] * signal[:, -lag:]).sum())
