"""What EMG that nobody recorded before a trial does to its motion: muscles answer late, and activation lags.

Shapes: T trials (or pieces), N samples, L samples before, M muscles, C ways of all electrodes to have changed.
"""

from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray

from myowave.data.trials import Array
from myowave.diagnosis.likelihood.forcing import moved_by
from myowave.identification.output_error import Fit
from myowave.physics.constants import LATEST_S
from myowave.physics.motion import initial_state, step

WAYS = 3  # of an electrode, the strongest; they hold nearly all of its change before a sample
REACH = 1e-3  # step of the differences, in standard deviations


def by_emg_before(fit: Fit) -> Array:
    """How the observed angle moves by one standard deviation of each way in which the EMG may have come to its first
    value, (T, N, C) [rad]; 0 where padded, and in pieces before which all EMG is known."""
    # ASSUME: the fit holds the first value. The EMG came to it as within trials it comes to others.
    record, simulation, lead = fit.record, fit.simulation, round(LATEST_S / fit.record.dt)
    if record.pieces is None:
        held = simulation.emg[:, :1].expand(-1, lead, -1)
        simulation = replace(simulation, emg=torch.cat([held, simulation.emg], 1), lead=lead)
    ways = _ways(fit, lead)
    place = record.begin[:, None] - lead + np.arange(simulation.emg.shape[1])  # in the trial, (T, L + N)
    before = (place < 0)[:, :, None, None] * ways[place.clip(-lead, -1) + lead]  # (T, L + N, M, C)
    if not before.any():
        return np.zeros((*record.valid.shape, 0))
    changed = simulation.emg + REACH * torch.from_numpy(before).movedim(-1, 0)
    state, steps = fit.linear.at, slice(0, min(lead, record.valid.shape[1] - 1))

    def moves(emg: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        other, at = replace(simulation, emg=emg), state[:, 0].expand(*emg.shape[:-2], -1)
        start = initial_state(other, at[..., 0], at[..., 1])
        return start, step(other.along_time, state[:, :-1][:, steps], other.drive.part(steps))

    begin, within = ((x - y).movedim(0, -1) / REACH for x, y in zip(moves(changed), moves(simulation.emg), strict=True))
    pushes = torch.zeros(*fit.linear.after.shape, within.shape[-1], dtype=within.dtype)
    pushes[:, steps] = within
    return moved_by(fit, pushes.numpy(), begin)


def _ways(fit: Fit, lead: int) -> Array:
    """Changes of each muscle's EMG from so many samples before a sample to it, one standard deviation of each way of an
    electrode, (L, M, C)."""
    whole, model = fit.record.whole, fit.model
    found = np.zeros((lead, len(model.muscles), len(model.channels) * WAYS))
    for place, muscle in enumerate(model.leading.values()):
        emg = whole.emg[..., model.muscles.index(muscle)].numpy()
        pasts = np.concatenate([_pasts(row[:n], lead) for row, n in zip(emg, whole.lengths, strict=True)])
        variance, ways = np.linalg.eigh(pasts.T @ pasts / max(len(pasts), 1))
        own = (np.sqrt(variance.clip(min=0.0)) * ways)[:, -WAYS:]
        driven = np.equal(model.electrodes, place)
        found[:, driven, place * WAYS : place * WAYS + own.shape[1]] = own[:, None]
    return found


def _pasts(emg: NDArray[np.float64], lead: int) -> Array:
    """EMG less a sample over so many samples before it, for each sample of a trial, (n, L)."""
    if len(emg) <= lead:
        return np.zeros((0, lead))
    windows = np.lib.stride_tricks.sliding_window_view(emg, lead + 1)
    return np.asarray(windows[:, :-1] - windows[:, -1:])
