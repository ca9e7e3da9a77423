"""Motion on EMG that was never recorded, simulated with the identified parameters.

Four trials are too few to learn how muscles of any activation move an elbow at any angle and speed; physics whose
parameters are known needs no measurement to tell. The EMG is made from that of the training trials: warped in time,
mixed between trials and channels, with the noise redrawn at its measured level.

Shapes: S seeds, T trials, N samples, C channels.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from myowave.data.trials import Trials
from myowave.data.wavelets import estimate_noise, max_level, project
from myowave.physics.model import Model
from myowave.physics.motion import simulate
from myowave.physics.simulation import Simulation, channels_of

SMOOTH_S = 0.25  # EMG slower than this is the command, faster is noise
WARP = (0.6, 1.7)  # range of the factor on time
GAIN = (0.8, 1.2)  # range of the factor on EMG
MARGIN = 0.3  # a simulated angle may leave the recorded range by this share of it


def imagine_emg(trials: Trials, count: int, seed: int) -> NDArray[np.float64]:
    """EMG that a subject might have shown, (count, N, C) [-], from trials with N samples."""
    # ASSUME: what training trials show of command and noise, stretched, mixed and shifted, is what other trials hold.
    random = np.random.default_rng([seed, 7])
    samples = trials.emg.shape[1]
    parts = [emg[:length] for emg, length in zip(trials.emg, trials.lengths, strict=True)]
    noise = np.array([estimate_noise(*(p[:, c] for p in parts)) for c in range(len(trials.channels))])
    wanted = round(np.log2(SMOOTH_S / trials.dt))
    commands = [project(p, int(np.clip(wanted, 0, max_level(len(p)))), "db2") for p in parts]
    low, high = (f([f(p, axis=0) for p in parts], axis=0) for f in (np.min, np.max))
    emg = np.empty((count, samples, len(trials.channels)))
    for made in emg:
        for channel in range(made.shape[1]):
            mix = random.beta(0.5, 0.5)
            donors = random.integers(len(commands), size=2)
            first, second = (_stretch(commands[donor][:, channel], samples, random) for donor in donors)
            made[:, channel] = random.uniform(*GAIN) * (mix * first + (1 - mix) * second)
        made += noise * random.standard_normal(made.shape)
    return np.clip(emg, low, high)


def _stretch(command: NDArray[np.float64], samples: int, random: np.random.Generator) -> NDArray[np.float64]:
    """A stretch of a command at another speed, running back and forth where the record ends, (samples,)."""
    low, high = WARP
    speed = low * (high / low) ** random.uniform()
    last = len(command) - 1
    place = random.uniform(0, 2 * last) + speed * np.arange(samples)
    place = last - np.abs(last - place % (2 * last))
    return np.interp(place, np.arange(len(command)), command)


def simulate_imagined(
    model: Model, params: dict[str, Tensor], trials: Trials, emg: NDArray[np.float64], seed: int
) -> tuple[Tensor, Tensor, NDArray[np.int64]]:
    """Motion on made-up EMG, for each seed's parameters.

    Args:
        params: identified parameters, (S, 1) each.
        trials: the training trials, for where motions start, how far they go, and what was known of them.
        emg: (T, N, C).

    Returns:
        Angle (S, T, N) [rad], which of these trials stay in the recorded range, (S, T), and the positions of the
        training trials whose known constants they have, (T,).
    """
    random = np.random.default_rng([seed, 11])
    donors = random.integers(len(trials.names), size=len(emg))
    known = {name: torch.from_numpy(value[donors]) for name, value in trials.known(model.defaults).items()}
    starts = trials.angle[donors, random.integers(min(trials.lengths), size=len(emg))]
    drive = channels_of(model, trials.channels, torch.from_numpy(emg))
    simulation = Simulation(model, {**known, **params}, drive, trials.dt)
    angle = simulate(simulation, torch.from_numpy(starts)).angle
    low, high = trials.angle.min(), trials.angle.max()
    margin = MARGIN * (high - low)
    inside = ((angle > low - margin) & (angle < high + margin)).all(-1)
    return torch.where(inside.unsqueeze(-1), angle, float(trials.angle.mean())), inside, donors
