"""The excitation to expect behind a noisy recording.

Noise of the excitation is also in the derivatives by which a fit moves its parameters, so estimates are off by a share
that no number of samples lowers (errors in variables). The force that the expected excitation leaves unexplained goes
with nothing that the model knows (regression calibration: Carroll et al. 2006, Measurement Error in Nonlinear Models).

Shapes: T trials, N samples, M muscles.
"""

from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.ndimage import convolve1d
from scipy.signal import firwin2, freqz, welch

from myowave.data.processing.filters import before_low_pass
from myowave.data.trials import Array
from myowave.identification.record import Record

SEGMENT = 64  # samples over which a spectrum is taken, and one less than the filter has
FEWEST = 16  # fewer are no spectrum
WHITE = np.ones(1)


def behind_noise(record: Record, noise: float) -> Record:
    """The same trials, or pieces, with the EMG to expect behind noise of a standard deviation [-], white but for the
    low-pass that the EMG has passed; as recorded where that is 0."""
    if not noise:
        return record
    lead = np.ones((len(record.valid), record.lead), bool)  # of pieces what is before their start counts, too
    passed = WHITE
    if record.emg_low_pass_hz is not None:
        passed = before_low_pass(WHITE, 1 / record.dt, record.emg_low_pass_hz)
    emg = expected_excitation(record.emg.numpy(), np.concatenate([lead, record.valid], 1), noise, passed)
    cut = record.pieces and replace(record.pieces, whole=behind_noise(record.whole, noise))
    return replace(record, emg=torch.from_numpy(emg), emg_noise=noise, pieces=cut)


def expected_excitation(emg: Array, valid: NDArray[np.bool_], noise: float, passed: Array = WHITE) -> Array:
    """The best linear guess of what each channel was without its noise, (T, N, M): Wiener's filter.

    Args:
        emg: recorded, (T, N, M).
        valid: False where a shorter trial is padded, (T, N).
        noise: standard deviation at every sample [-].
        passed: the answer to an impulse, of a norm of 1, of the filter that white noise has passed, (n,).
    """
    found = emg.copy()
    lengths = valid.sum(1)
    segment = min(SEGMENT, int(lengths.min())) // 2 * 2  # even, so that the last frequency is half the sampling rate
    if segment < FEWEST:
        return found
    for muscle in range(emg.shape[-1]):
        trials = [x[:n, muscle] for x, n in zip(emg, lengths, strict=True)]
        spectra = [welch(x, nperseg=segment, detrend="linear") for x in trials]
        frequency = spectra[0][0]
        power = np.average([spectrum for _, spectrum in spectra], axis=0, weights=lengths)
        of_noise = 2 * noise**2 * np.abs(freqz(passed, worN=frequency, fs=1.0)[1]) ** 2
        of_noise[-1] /= 2  # waves of half the sampling rate have no negative twin
        share = np.clip(1 - of_noise / np.maximum(power, 1e-300), 0.0, 1.0)
        share[0] = 1.0
        taps = firwin2(2 * (segment // 2) + 1, frequency / frequency[-1], share)
        for x, row, n in zip(trials, found, lengths, strict=True):
            row[:n, muscle] = np.clip(convolve1d(x, taps / taps.sum(), mode="nearest"), 0.0, max(1.0, x.max()))
    return found
