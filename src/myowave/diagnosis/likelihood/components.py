"""All that may have made the residual of a fit to motion, as components of one likelihood.

Shapes: T trials (or pieces), N samples, K numbers of the state, M muscles, P free parameters; W waves in the band and H
above it, see `waves`.
"""

from collections.abc import Collection

import numpy as np
import torch
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from myowave.data.trials import Array
from myowave.diagnosis.likelihood.algebra import COST, Component, Residual
from myowave.diagnosis.likelihood.beginning import by_emg_before
from myowave.diagnosis.likelihood.forcing import (
    along_steps,
    answers,
    by_samples,
    excitation_of,
    through_sensor,
)
from myowave.diagnosis.likelihood.pushes import Pushes
from myowave.diagnosis.likelihood.terms import OF_SENSOR
from myowave.diagnosis.likelihood.waves import View
from myowave.identification.free_parameters import Free, scales
from myowave.identification.least_squares import scaled_slope
from myowave.identification.noise import SMALLEST_NOISE_DEG, roughness_of
from myowave.identification.output_error import Fit
from myowave.identification.record import Record
from myowave.physics.constants import OVER_TIME

# ASSUME: constants of which nothing is known are known up to a factor of e or so, in units of their scale.
WIDE = 1.0
MOST_MOTION = 1.0  # rad, by an effect
MEMORY_S = 0.3  # ASSUME: a torque that nobody recorded stays alike for so long
STARTS = np.radians([5.0, 50.0])  # how far the fitted start of a trial may be off [rad, rad/s]

NOISE, EMG, CURVES, PATHS, REPEATS, SLOW = "noise", "emg", "curves", "paths", "repeats", "slow"
COLOURED, GAINS, TISSUE, MOTOR = "coloured", "gains", "tissue", "motor"
# What stands for something that the model lacks, and is no noise.
MISSING = frozenset({CURVES, PATHS, REPEATS, SLOW, TISSUE})
# Bounds of sizes and where their search starts: rad; of the EMG; standard bumps, twice; rad of each part; rad; rad;
# a share; rad; of what the motor's torque shows.
SIZES = {
    NOISE: (1e-5, 1e-2, 0.3),
    # ASSUME: the amplitude of EMG is at most 35 times its noise, with eight electrodes on one muscle at a tenth of its
    # maximum (Clancy & Hogan 1995, IEEE Trans. Biomed. Eng. 42, 203). What would be less has another cause.
    EMG: (3e-3, 0.03, 0.6),
    CURVES: (0.03, 0.3, 6.0),
    PATHS: (0.03, 0.3, 6.0),
    REPEATS: (1e-5, 0.02, 1.0),
    SLOW: (1e-5, 0.02, 1.0),
    COLOURED: (1e-4, 1e-2, 0.3),
    GAINS: (1e-3, 0.05, 0.6),
    TISSUE: (1e-3, 0.03, 0.6),
    # ASSUME: noise of a recorded torque is in the record to be seen; a low-pass, as before a coarser grid, takes up to
    # a third of it in the finest scales. What would be more has another cause.
    MOTOR: (0.03, 1.0, 1.5),
}


def residual_of(fit: Fit, view: View, catalogue: Collection[str] = ()) -> Residual:
    """What a fit leaves, and all that may have made it; see `Pushes.of`."""
    look, pushes = view.amplitudes, Pushes.of(fit, catalogue)
    (constants, off), (starts, begun) = prior_columns(fit, view), start_columns(fit, view)
    both = np.concatenate([pushes.excitation, pushes.torque], -1)
    waves = through_sensor(fit, view.motion)
    steps = torch.from_numpy(answers(fit.linear.jacobian.numpy(), both, waves))
    by_excitation, by_torque = steps[..., :-1, :], steps[..., -1, :]  # (N - 1, T, M, W + H) and (N - 1, T, W + H)
    before, before_above = look(by_emg_before(fit)).split(view.sizes, 1)
    components = [
        *_white(view),
        Component("starts", columns=for_each(starts)),
        Component("before", before @ before.mT, tail=(before_above**2).sum(-1)),
        Component("constants", columns=constants),
        _forced(EMG, by_samples(fit, by_excitation), view),
        _slow(by_torque, view, fit.record.samples),
        _sized(REPEATS, columns=_repeating(fit, view, look(pushes.repeating), catalogue)),
        _sized(CURVES, columns=look(pushes.curves)),
        _sized(PATHS, columns=look(pushes.paths)),
    ]
    if fit.record.pieces is None:
        activation = along_steps(fit)[2]
        artefact = torch.cat([activation, activation[:, -1:]], 1).numpy() * fit.record.valid[..., None]
        of_electrodes = torch.eye(len(fit.model.channels), dtype=torch.float64)[[*fit.model.electrodes]]  # (M, C)
        excitation = torch.from_numpy(excitation_of(fit))
        by_gain = torch.einsum("ntmw,tnm,mc->tcw", by_excitation, excitation, of_electrodes)
        components += [
            coloured(view, view.memory_s),
            _forced(GAINS, by_gain[None], view),
            _sized(TISSUE, columns=look(artefact)),
        ]
    if noise := _noise_of_torque(fit.record):
        components.append(_forced(MOTOR, by_torque[:, :, None] * noise, view, cost=0.0))
    values = view.left(fit) + constants @ torch.from_numpy(off) + (starts @ torch.from_numpy(begun)[..., None])[..., 0]
    return Residual(values, view.there, tuple(components), view.sizes[1])


def residual_above(fit: Fit, view: View) -> Residual:
    """What a fit leaves of the waves above the band of the motion alone: noise of the sensor."""
    view = view.above_alone
    noises = (*_white(view), coloured(view, view.memory_s))
    return Residual(view.left(fit), view.there, noises, view.sizes[1])


def _white(view: View) -> tuple[Component, Component]:
    """Noise of the sensor without a memory: the least, which passes no filter, and what has passed its filter."""
    floor, there = float(np.radians(SMALLEST_NOISE_DEG)), view.above.there
    in_band, one = torch.diag_embed(view.band.there.double()), there.double()
    least = Component("floor", in_band, tail=one, low=floor, first=floor, high=floor)
    return least, _sized(NOISE, view.band.noise.mT @ view.band.noise, (view.above.noise**2).sum(1), cost=0.0)


def prior_columns(fit: Fit, view: View) -> tuple[Tensor, Array]:
    """What one standard deviation of what is known of each free parameter does, (T, W + H, P), and by how many of them
    it is above where it is expected, (P,)."""
    deviation, centre = prior_of(fit)
    slope = view.amplitudes(fit.normal.slope)
    return slope * torch.from_numpy(deviation), (fit.values / scales(fit.free) - centre) / deviation


def start_columns(fit: Fit, view: View) -> tuple[Tensor, Array]:
    """What one standard deviation of each number of a trial's start does to that trial, (T, W + H, 2), and by how many
    of them it is above where it is expected, (T, 2)."""
    deviation, centre = start_prior(fit)
    columns = view.amplitudes(scaled_slope(fit.sensitive.by_start, deviation[:, None], fit.record.valid))
    return columns, (fit.starts - centre) / deviation


def for_each(columns: Tensor) -> Tensor:
    """Columns (T, L, C) that each trial has for itself as those of all of them, (T, L, T C)."""
    return torch.einsum("tlc,tu->tluc", columns, torch.eye(len(columns), dtype=columns.dtype)).flatten(2)


def start_prior(fit: Fit) -> tuple[Array, Array]:
    """Standard deviations of angle and velocity at a trial's start, and where they are expected, (T, 2) each: a piece
    begins where it was measured to, a trial near where the fit has it."""
    if fit.record.pieces is None:
        return np.broadcast_to(STARTS, fit.starts.shape), fit.starts
    return fit.record.start_error, fit.record.motion[:, 0].numpy()


def prior_of(fit: Fit) -> tuple[Array, Array]:
    """Standard deviation of each free parameter before any trial and where it is expected, in its scale, (P,) each;
    one of which nothing is known about where it stands, that of an effect about 0."""
    deviation = [
        usual if is_of_effect(p) else min(p.deviation / p.scale, WIDE)
        for p, usual in zip(fit.free, usual_strength(fit.normal.slope, fit.record.samples), strict=True)
    ]
    centre = [
        0.0 if is_of_effect(p) else (p.start if np.isfinite(p.deviation) else value) / p.scale
        for p, value in zip(fit.free, fit.values, strict=True)
    ]
    return np.array(deviation), np.array(centre)


def usual_strength(slope: Array, samples: int) -> Array:
    """Standard deviation of parameters of effects before any trial, in units of their scales, (E,): as is typical, but
    no larger than moves the arm by `MOST_MOTION` (root mean square).

    Args:
        slope: d angle / d parameter in units of their scales, (T, N, E); of so many samples that are not padded.
    """
    # ASSUME: what is typical of an arm is too much for a pendulum of a thousandth of its inertia: what would throw it
    # about is not expected.
    by = np.sqrt((slope**2).sum((0, 1)) / samples)
    return np.asarray(WIDE * MOST_MOTION / np.maximum(by, MOST_MOTION))


def is_of_effect(free: Free) -> bool:
    return "." in free.name


def coloured(view: View, memory_s: float) -> Component:
    """Noise of the sensor with a memory, as it is before any filter."""
    return _sized(COLOURED, *view.with_memory(memory_s))


def _sized(
    name: str,
    blocks: Tensor | None = None,
    tail: Tensor | None = None,
    columns: Tensor | None = None,
    cost: float = COST,
) -> Component:
    low, first, high = SIZES[name]
    return Component(name, blocks, columns, tail, low, first, high, cost)


def _forced(name: str, by_push: Tensor, view: View, cost: float = COST) -> Component:
    """Independent pushes, whose effect on the waves is known, (steps, T, C, W + H)."""
    band, above = by_push.transpose(0, 1).flatten(1, 2).split(view.sizes, -1)
    return _sized(name, band.mT @ band, tail=(above**2).sum(1), cost=cost)


def _noise_of_torque(record: Record) -> float:
    """Of a motor's torque as it was recorded over time [N m], by its finest scales; 0 where none was."""
    if "motor" not in record.known or record.course is None:
        return 0.0
    return roughness_of([*record.joined(record.course[..., OVER_TIME.index("motor")].numpy()).values()])


def _slow(by_torque: Tensor, view: View, samples: int) -> Component:
    """Torques that stay alike for a while and move the arm by a root mean square of 1 rad; their effect on the waves is
    known, (N - 1, T, W + H)."""
    width = MEMORY_S / view.dt
    alike = gaussian_filter1d(by_torque.numpy(), width, axis=0, mode="constant", truncate=5.0)
    alike = torch.from_numpy(alike * np.sqrt(2 * np.pi) * width)
    (own, above), (alike, alike_above) = (x.transpose(0, 1).split(view.sizes, -1) for x in (by_torque, alike))
    blocks = own.mT @ alike
    power = blocks.diagonal(dim1=-2, dim2=-1).sum() / samples
    tail = (above * alike_above).sum(1).clamp(0.0)
    return _sized(SLOW, (blocks + blocks.mT) / (2 * power), tail / power)


def _repeating(fit: Fit, view: View, by_pushes: Tensor, catalogue: Collection[str]) -> Tensor:
    """What each part of the general correction does, a root mean square of 1 rad each, (T, W + H, C)."""
    q, v = fit.sensitive.motion.state[..., :2].unbind(-1)
    parts = [term(q, v, v).numpy() * fit.record.valid for name, term in OF_SENSOR.items() if name not in catalogue]
    columns = torch.cat([by_pushes, *(view.amplitudes(part[..., None]) for part in parts)], -1)
    return columns / ((columns**2).sum((0, 1)) / fit.record.samples).sqrt().clamp(1e-300)
